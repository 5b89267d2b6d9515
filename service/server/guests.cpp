#include "server/guests.h"

#include <algorithm>
#include <cerrno>
#include <cstring>

#include <sys/socket.h>
#include <unistd.h>

#include "process/clock.h"
#include "wire/errors.h"

namespace rcs::service {
namespace {

constexpr std::size_t kMostBrowsers = 32, kMostUnknown = 32;
constexpr std::size_t kMostToldSo = 8;      // connections beyond the limit, each to be told that there is one
constexpr std::int64_t kAcceptPause = 500;  // where file descriptors ran out [ms]
constexpr std::int64_t kSilence = 1000;     // after which a place may be given to another [ms]
constexpr int kGuestsAtATime = 64, kFromAfarAtATime = 8;

/// Whether one more may come to the `most` that are silent. Newer ones stand behind older ones.
template <typename Guest, typename IsSilent>
bool has_room_among_silent(const std::list<Guest>& guests, std::size_t most, std::int64_t now,
                           const IsSilent& is_silent)
{
    if (static_cast<std::size_t>(std::count_if(guests.begin(), guests.end(), is_silent)) < most) return true;
    return std::find_if(guests.begin(), guests.end(), is_silent)->since_ms() + kSilence <= now;
}

/// The oldest of them goes for one that has come.
template <typename Guest, typename IsSilent>
void make_room_among_silent(std::list<Guest>& guests, std::size_t most, const IsSilent& is_silent)
{
    if (static_cast<std::size_t>(std::count_if(guests.begin(), guests.end(), is_silent)) < most) return;
    guests.erase(std::find_if(guests.begin(), guests.end(), is_silent));
}

auto silent_of_kind(bool local)
{
    return [local](const Connection& connection) { return connection.is_local() == local && !connection.known(); };
}

bool is_browser(const HttpConnection&) { return true; }

}  // namespace

Guests::Guests(const ServerConfig& config, const ServerLog& log, Counters& counters)
    : config_(config), log_(log), counters_(counters), listeners_(config, log)
{
}

std::size_t Guests::most_silent() const
{
    return std::min(kMostUnknown, std::max<std::size_t>(1, static_cast<std::size_t>(config_.max_connections) / 2));
}

bool Guests::has_room(bool local, std::int64_t now) const
{
    const auto count = std::count_if(connections_.begin(), connections_.end(),
                                     [&](const Connection& connection) { return connection.is_local() == local; });
    return static_cast<std::size_t>(count) < static_cast<std::size_t>(config_.max_connections) + kMostToldSo &&
           has_room_among_silent(connections_, most_silent(), now, silent_of_kind(local));
}

bool Guests::has_room_for_browser(std::int64_t now) const
{
    return has_room_among_silent(browsers_, kMostBrowsers, now, is_browser);
}

void Guests::add_listeners_to(std::vector<pollfd>& polled, std::int64_t now)
{
    const bool may = now >= accept_after_ms_;
    listeners_.add_to(polled, may && has_room(true, now), may && has_room(false, now),
                      may && has_room_for_browser(now));
}

void Guests::let_in(const std::vector<pollfd>& polled)
{
    const Listeners::Waiting waiting = listeners_.waiting(polled);
    if (waiting.unix_client) let_in_clients(true);
    if (waiting.tcp_client) let_in_clients(false);
    for (std::int64_t now = steady_ms(); waiting.browser && has_room_for_browser(now);) {
        Fd fd(::accept4(listeners_.http_fd(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
        if (!fd) return;
        make_room_among_silent(browsers_, kMostBrowsers, is_browser);
        browsers_.emplace_back(std::move(fd), now);
    }
}

void Guests::let_in_clients(bool local)
{
    const int listener = local ? listeners_.unix_fd() : listeners_.tcp_fd();
    const std::int64_t now = steady_ms();
    for (int i = 0; i < (local ? kGuestsAtATime : kFromAfarAtATime) && has_room(local, now); ++i) {
        Fd fd(::accept4(listener, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
        if (!fd && (errno == EMFILE || errno == ENFILE || errno == ENOMEM || errno == ENOBUFS)) {
            accept_after_ms_ = now + kAcceptPause;  // it stays readable: without a pause this would go round and round
            log_.write(Level::warning, "not_accepted", {{"why", std::strerror(errno)}});
        }
        if (!fd) return;
        ++counters_.connections;
        make_room_among_silent(connections_, most_silent(), silent_of_kind(local));
        try {
            let_in(std::move(fd), local, now);
        } catch (const std::exception& e) {
            log_.write(Level::warning, "not_accepted", {{"why", e.what()}});
        }
    }
}

void Guests::let_in(Fd fd, bool local, std::int64_t now)
{
    const auto count = std::count_if(connections_.begin(), connections_.end(),
                                     [&](const Connection& connection) { return connection.is_local() == local; });
    std::optional<v1::Error> refusal;
    if (count >= config_.max_connections) {
        refusal = error_message(v1::ERROR_CODE_LIMIT,
                                "the server has " + std::to_string(count) + " such connections, no more are allowed");
    }
    if (local) {
        const Peer peer = peer_of(fd.get());
        if (!may_connect(peer, config_.group)) {
            log_.write(Level::warning, "refused", {{"uid", peer.uid}});
            refusal = error_message(v1::ERROR_CODE_FORBIDDEN, "this user may not use the server");
        }
        connections_.emplace_back(Stream(std::move(fd)), "uid:" + std::to_string(peer.uid), peer.uid == ::getuid(),
                                  now);
    } else {
        connections_.emplace_back(listeners_.stream_of(std::move(fd)), "", false, now);
    }
    if (refusal) {
        ++counters_.connections_refused;
        connections_.back().finish(*refusal, now);
    }
    connections_.back().flush(now);
}

void Guests::drop(std::int64_t now)
{
    browsers_.remove_if([&](const HttpConnection& browser) { return browser.done(now); });
    connections_.remove_if([&](Connection& connection) {
        if (!connection.closed() && now >= connection.deadline(config_.message_seconds)) {
            log_.write(Level::warning, "timed_out", {{"owner", connection.caller().owner}});
            return true;
        }
        return connection.closed();
    });
}

}  // namespace rcs::service
