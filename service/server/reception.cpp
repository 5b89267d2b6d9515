#include "server/reception.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <string>

#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include "process/clock.h"
#include "rcs/version.h"
#include "wire/errors.h"

namespace rcs::service {
namespace {

constexpr std::size_t kMostUnknown = 32;
constexpr std::size_t kMostToldSo = 8;      // connections beyond the limit, each to be told that there is one
constexpr std::int64_t kAcceptPause = 500;  // where file descriptors ran out [ms]
constexpr std::int64_t kSilence = 1000;     // after which a place may be given to another [ms]
constexpr std::int64_t kForStrangers = 2;  // of a turn: greetings of TLS cost time, and users of this machine wait [ms]
// Who comes by each of the two ways, at once, and how long after that from one to the next. More wait at the door, so
// that a crowd that comes and goes leaves processor time to those inside.
constexpr std::int64_t kAtOnce = 64, kGap = 2;  // the latter [ms]

auto silent_of_kind(bool local)
{
    return [local](const Connection& connection) { return connection.is_local() == local && !connection.known(); };
}

bool has_news(const std::vector<pollfd>& polled, std::size_t index, const Connection& connection)
{
    return connection.has_pending() ||
           (index < polled.size() && polled[index].fd == connection.fd() && polled[index].revents != 0);
}

}  // namespace

struct Reception::Rules {
    explicit Rules(const ServerConfig& config)
        : group(config.group),
          max_connections(static_cast<std::size_t>(config.max_connections)),
          message_seconds(config.message_seconds),
          max_upload(config.blobs.max_file),
          secrets(read_secrets(config))
    {
    }
    std::string group;
    std::size_t max_connections;
    double message_seconds;
    std::uint64_t max_upload;
    Secrets secrets;
};

Reception::Bell::Bell() : fd(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK))
{
    if (!fd) fail_file("make", "an event");
}

void Reception::Bell::ring() const
{
    const std::uint64_t one = 1;
    [[maybe_unused]] const ssize_t full_rings_too = ::write(fd.get(), &one, sizeof one);
}

void Reception::Bell::silence() const
{
    std::uint64_t count = 0;
    [[maybe_unused]] const ssize_t was_silent = ::read(fd.get(), &count, sizeof count);
}

Reception::Reception(const ServerConfig& config, const ServerLog& log, Counters& counters)
    : log_(log),
      counters_(counters),
      rules_(std::make_shared<const Rules>(config)),
      listeners_(config, log, rules_->secrets.tls.has_value()),
      thread_([this](const std::stop_token& stop) { run(stop); })
{
}

Reception::~Reception()
{
    thread_.request_stop();
    order_.ring();
}

std::list<Connection> Reception::take()
{
    arrival_.silence();
    const std::lock_guard lock(mutex_);
    return std::exchange(arrived_, {});
}

void Reception::see_off(std::list<Connection> leaving)
{
    if (leaving.empty()) return;
    {
        const std::lock_guard lock(mutex_);
        to_see_off_.splice(to_see_off_.end(), leaving);
    }
    order_.ring();
}

void Reception::adopt(const ServerConfig& config)
{
    auto rules = std::make_shared<const Rules>(config);
    {
        const std::lock_guard lock(mutex_);
        new_rules_ = std::move(rules);
    }
    order_.ring();
}

void Reception::run(const std::stop_token& stop)
{
    while (!stop.stop_requested()) turn();
    newcomers_.splice(newcomers_.end(), take());
    const std::int64_t now = steady_ms();
    for (Connection& newcomer : newcomers_) {
        newcomer.finish(error_message(v1::ERROR_CODE_UNAVAILABLE, "the server has stopped"), now);
        newcomer.flush(now);
    }
}

void Reception::turn()
{
    wait();
    take_orders();
    hear_all();
    for (Connection& connection : leaving_) connection.flush(steady_ms());
    if ((polled_[1].revents & POLLIN) != 0) let_in_all(true);
    if ((polled_[2].revents & POLLIN) != 0) let_in_all(false);
    hand_over();
    drop(steady_ms());
}

void Reception::wait()
{
    const std::int64_t now = steady_ms();
    std::int64_t until = now + kSilence;
    polled_.clear();
    polled_.push_back({order_.get(), POLLIN, 0});
    for (const bool local : {true, false}) {
        const bool wanted = now >= accept_after_ms_ && door_[local].count(now) > 0 && has_room(local, now);
        if (door_[local].count(now) == 0) until = std::min(until, now + 1);
        polled_.push_back({listeners_.fd(local), static_cast<short>(wanted ? POLLIN : 0), 0});
    }
    for (const auto* connections : {&newcomers_, &leaving_}) {
        for (const Connection& connection : *connections) {
            polled_.push_back({connection.fd(), connection.events(), 0});
            if (connection.has_pending()) until = now;
            until = std::min(until, connection.deadline(rules_->message_seconds));
        }
    }
    if (accept_after_ms_ > now) until = std::min(until, accept_after_ms_);
    ::poll(polled_.data(), polled_.size(), static_cast<int>(std::max<std::int64_t>(0, until - now)));
}

void Reception::take_orders()
{
    if (polled_[0].revents == 0) return;
    order_.silence();
    std::list<Connection> leaving;
    {
        const std::lock_guard lock(mutex_);
        leaving.swap(to_see_off_);
        if (new_rules_) rules_ = std::exchange(new_rules_, nullptr);
    }
    for (const Connection& connection : leaving) --inside_[connection.is_local()];
    leaving_.splice(leaving_.end(), leaving);
}

/// Users of this machine first.
void Reception::hear_all()
{
    std::vector<Connection*> strangers;
    std::size_t next = 3;
    for (Connection& newcomer : newcomers_) {
        if (!has_news(polled_, next++, newcomer)) continue;
        newcomer.is_local() ? hear(newcomer) : strangers.push_back(&newcomer);
    }
    const std::int64_t until = steady_ms() + kForStrangers;
    for (Connection* stranger : strangers) {
        if (steady_ms() >= until) break;  // the rest still has something to say in the next turn
        hear(*stranger);
    }
}

void Reception::hear(Connection& newcomer)
{
    try {
        std::vector<v1::Request> requests;
        newcomer.receive(requests, steady_ms());
        if (!newcomer.known() && !requests.empty()) {
            greet(newcomer, requests.front());
            requests.clear();
            newcomer.receive(requests, steady_ms());
        }
        newcomer.keep(std::move(requests));
    } catch (const ServiceError& e) {
        ++counters_.connections_refused;
        log_.write(Level::warning, "sent_away", {{"owner", newcomer.caller().owner}, {"why", e.what()}});
        newcomer.finish(error_message(e.code(), e.what()), steady_ms());
    }
    newcomer.flush(steady_ms());
}

void Reception::greet(Connection& newcomer, const v1::Request& request) const
{
    if (!request.has_hello()) throw ServiceError(v1::ERROR_CODE_UNAUTHENTICATED, "the first request has to be hello");
    newcomer.greet(request.hello(), rules_->secrets.token);
    v1::Response response;
    response.set_id(request.id());
    v1::HelloReply& hello = *response.mutable_hello();
    hello.set_server(std::string("rcsplat ") + kVersion);
    hello.set_max_message_bytes(kMaxMessage);
    hello.set_max_chunk_bytes(kMaxChunk);
    hello.set_max_upload_bytes(rules_->max_upload);
    newcomer.send(response);
}

std::int64_t Reception::Door::count(std::int64_t now)
{
    credit_ms_ = std::min(kAtOnce * kGap, credit_ms_ + now - since_ms_);
    since_ms_ = now;
    return credit_ms_ / kGap;
}

void Reception::Door::take() { credit_ms_ -= kGap; }

std::size_t Reception::silent(bool local) const
{
    return static_cast<std::size_t>(std::count_if(newcomers_.begin(), newcomers_.end(), silent_of_kind(local)));
}

std::size_t Reception::count(bool local) const
{
    std::size_t count = inside_[local];
    for (const auto* connections : {&newcomers_, &leaving_}) {
        for (const Connection& connection : *connections) count += connection.is_local() == local;
    }
    return count;
}

std::size_t Reception::most_silent() const
{
    return std::clamp<std::size_t>(rules_->max_connections / 2, 1, kMostUnknown);
}

/// Whether one more may come. Newer ones stand behind older ones.
bool Reception::has_room(bool local, std::int64_t now) const
{
    if (count(local) >= rules_->max_connections + kMostToldSo) return false;
    if (silent(local) < most_silent()) return true;
    const auto oldest = std::find_if(newcomers_.begin(), newcomers_.end(), silent_of_kind(local));
    return oldest->since_ms() + kSilence <= now;
}

void Reception::let_in_all(bool local)
{
    const std::int64_t now = steady_ms();
    for (std::int64_t left = door_[local].count(now); left > 0 && has_room(local, now); --left) {
        Fd fd(::accept4(listeners_.fd(local), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
        if (!fd && (errno == EMFILE || errno == ENFILE || errno == ENOMEM || errno == ENOBUFS)) {
            accept_after_ms_ = now + kAcceptPause;  // it stays readable: without a pause this would go round and round
            log_.write(Level::warning, "not_accepted", {{"why", std::strerror(errno)}});
        }
        if (!fd) return;
        ++counters_.connections;
        door_[local].take();
        if (silent(local) >= most_silent()) {
            newcomers_.erase(std::find_if(newcomers_.begin(), newcomers_.end(), silent_of_kind(local)));
        }
        try {
            let_in(std::move(fd), local, now);
        } catch (const std::exception& e) {
            log_.write(Level::warning, "not_accepted", {{"why", e.what()}});
        }
    }
}

void Reception::let_in(Fd fd, bool local, std::int64_t now)
{
    std::optional<v1::Error> refusal;
    if (const std::size_t others = count(local); others >= rules_->max_connections) {
        refusal = error_message(v1::ERROR_CODE_LIMIT,
                                "the server has " + std::to_string(others) + " such connections, no more are allowed");
    }
    if (local) {
        const Peer peer = peer_of(fd.get());
        if (!may_connect(peer, rules_->group)) {
            log_.write(Level::warning, "refused", {{"uid", peer.uid}});
            refusal = error_message(v1::ERROR_CODE_FORBIDDEN, "this user may not use the server");
        }
        newcomers_.emplace_back(Stream(std::move(fd)), "uid:" + std::to_string(peer.uid), peer.uid == ::getuid(), now);
    } else {
        const auto& tls = rules_->secrets.tls;
        newcomers_.emplace_back(tls ? Stream(std::move(fd), tls->get(), true) : Stream(std::move(fd)), "", false, now);
    }
    if (refusal) {
        ++counters_.connections_refused;
        newcomers_.back().finish(*refusal, now);
    }
    newcomers_.back().flush(now);
}

/// Who has asked for something goes in; who is to go is not heard any more.
void Reception::hand_over()
{
    std::list<Connection> asking;
    for (auto newcomer = newcomers_.begin(); newcomer != newcomers_.end();) {
        const auto here = newcomer++;
        if (here->is_finishing()) {
            leaving_.splice(leaving_.end(), newcomers_, here);
        } else if (here->has_asked() && !here->closed()) {
            ++inside_[here->is_local()];
            asking.splice(asking.end(), newcomers_, here);
        }
    }
    if (asking.empty()) return;
    {
        const std::lock_guard lock(mutex_);
        arrived_.splice(arrived_.end(), asking);
    }
    arrival_.ring();
}

void Reception::drop(std::int64_t now)
{
    for (auto* connections : {&newcomers_, &leaving_}) {
        connections->remove_if([&](const Connection& connection) {
            if (!connection.closed() && now >= connection.deadline(rules_->message_seconds)) {
                log_.write(Level::warning, "timed_out", {{"owner", connection.caller().owner}});
                return true;
            }
            return connection.closed();
        });
    }
}

}  // namespace rcs::service
