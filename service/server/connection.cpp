#include "server/connection.h"

#include <algorithm>

#include <poll.h>

#include <openssl/crypto.h>

#include "wire/errors.h"

namespace rcs::service {
namespace {

constexpr std::int64_t kBetweenNews = 100;     // to a watcher of a job [ms]
constexpr std::int64_t kHelloTime = 10'000;    // [ms]
constexpr std::int64_t kIdleTime = 3'600'000;  // of a client that watches nothing [ms]
constexpr std::size_t kMostWatches = 64;
constexpr std::size_t kRequestsOfATurn = 16;     // so that others have their turn
constexpr std::size_t kReadOfATurn = 256 << 10;  // [bytes]

bool same_secret(const std::string& a, const std::string& b)
{
    return a.size() == b.size() && !a.empty() && CRYPTO_memcmp(a.data(), b.data(), a.size()) == 0;
}

}  // namespace

Connection::Connection(Stream stream, const std::string& owner, bool sees_all, std::int64_t now)
    : stream_(std::move(stream)),
      caller_{owner, sees_all, presence_},
      local_(!owner.empty()),
      since_ms_(now),
      heard_ms_(now)
{
    out_ = greeting();
    unsent_since_ms_ = now;
}

void Connection::receive(std::vector<v1::Request>& requests, std::int64_t now)
{
    if (finishing_ || !may_read()) return;
    if (has_asked()) {
        requests = std::exchange(kept_, {});
        return;
    }
    char bytes[64 << 10];
    for (std::size_t total = 0; !backlog_ && total < kReadOfATurn && reader_.held() < kMaxMessage;) {
        const long count = stream_.read(bytes, sizeof bytes);
        if (count == Stream::kLater) break;
        if (count == Stream::kEnd) {
            closed_ = true;
            return;
        }
        if (!reader_.half_sent()) heard_ms_ = now;
        reader_.append({bytes, static_cast<std::size_t>(count)});
        total += static_cast<std::size_t>(count);
        if (static_cast<std::size_t>(count) < sizeof bytes) break;
    }
    if (!greeted_) {
        const auto first = reader_.take(kGreetingSize);
        if (!first) return;
        check_greeting(*first);
        greeted_ = true;
    }
    backlog_ = false;
    while (const auto message = reader_.next()) {
        v1::Request request;
        parse(*message, request);
        requests.push_back(std::move(request));
        heard_ms_ = now;
        if (requests.size() == (hello_ ? kRequestsOfATurn : 1)) {
            backlog_ = reader_.half_sent();
            break;
        }
    }
}

void Connection::send(const v1::Response& response)
{
    if (finishing_ || closed_) return;
    out_ += frame(response);
}

void Connection::flush(std::int64_t now)
{
    bool wrote = false;
    while (!closed_ && sent_ < out_.size()) {
        const long count = stream_.write(std::string_view(out_).substr(sent_));
        if (count == Stream::kLater) break;
        if (count == Stream::kEnd) {
            closed_ = true;
            return;
        }
        sent_ += static_cast<std::size_t>(count);
        wrote = true;
    }
    if (sent_ == out_.size()) {
        out_.clear();
        if (out_.capacity() > kMaxChunk / 4) out_.shrink_to_fit();
        sent_ = 0;
        unsent_since_ms_ = 0;
    } else if (wrote || unsent_since_ms_ == 0) {
        out_.erase(0, sent_);
        sent_ = 0;
        unsent_since_ms_ = now;
    }
}

void Connection::finish(const v1::Error& error, std::int64_t now)
{
    if (finishing_) return;
    v1::Response response;
    *response.mutable_error() = error;
    send(response);
    finishing_ = true;
    watches_.clear();
    if (unsent_since_ms_ == 0) unsent_since_ms_ = now;
}

void Connection::greet(const v1::HelloRequest& hello, const std::string& token)
{
    if (hello_) throw ServiceError(v1::ERROR_CODE_PROTOCOL, "a second hello");
    if (caller_.owner.empty()) {
        const std::string name = stream_.peer_name();
        if (!name.empty()) {
            caller_ = {"certificate:" + utf8_text(name), false, presence_};
        } else if (same_secret(hello.token(), token)) {
            caller_ = {"token", false, presence_};
        } else {
            throw ServiceError(v1::ERROR_CODE_UNAUTHENTICATED,
                               hello.token().empty() ? "this server wants a token" : "the token is wrong");
        }
    }
    hello_ = true;
}

void Connection::watch(std::uint64_t job, std::uint64_t request)
{
    if (watches_.size() >= kMostWatches) {
        throw ServiceError(v1::ERROR_CODE_LIMIT,
                           "a connection watches at most " + std::to_string(kMostWatches) + " jobs at a time");
    }
    if (!watches_.emplace(request, Watch{job, true, 0}).second) {
        throw ServiceError(v1::ERROR_CODE_PROTOCOL, "two watch requests have the id " + std::to_string(request));
    }
}

void Connection::touch(std::uint64_t job, bool now)
{
    for (auto& [request, watch] : watches_) {
        if (watch.job != job) continue;
        watch.changed = true;
        if (now) watch.told_ms = 0;
    }
}

std::vector<std::pair<std::uint64_t, std::uint64_t>> Connection::due(std::int64_t now)
{
    std::vector<std::pair<std::uint64_t, std::uint64_t>> due;
    if (finishing_ || out_.size() > kMaxChunk) return due;  // the newest state waits until he has read the last one
    for (auto& [request, watch] : watches_) {
        if (!watch.changed || now < watch.told_ms + kBetweenNews) continue;
        watch.changed = false;
        watch.told_ms = now;
        due.emplace_back(watch.job, request);
    }
    return due;
}

void Connection::unwatch(std::uint64_t request) { watches_.erase(request); }

std::optional<std::int64_t> Connection::next_due() const
{
    std::optional<std::int64_t> next;
    for (const auto& [request, watch] : watches_) {
        if (watch.changed) next = std::min(next.value_or(watch.told_ms + kBetweenNews), watch.told_ms + kBetweenNews);
    }
    return next;
}

short Connection::events() const
{
    short events = 0;
    if (!finishing_ && may_read()) events |= POLLIN;
    if (!out_.empty() || stream_.wants_write()) events |= POLLOUT;
    return events;
}

std::int64_t Connection::deadline(double message_seconds) const
{
    const auto message = static_cast<std::int64_t>(1e3 * message_seconds);
    std::int64_t at = heard_ms_ + (watches_.empty() ? kIdleTime : kIdleTime * 1000);
    if (!hello_) at = std::min(at, heard_ms_ + std::min(kHelloTime, message));
    if (reader_.half_sent() && may_read()) at = std::min(at, heard_ms_ + message);
    if (unsent_since_ms_ != 0 && !out_.empty()) at = std::min(at, unsent_since_ms_ + message);
    return at;
}

}  // namespace rcs::service
