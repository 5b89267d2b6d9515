#include "server/guests.h"

#include <sys/socket.h>

#include "process/clock.h"

namespace rcs::service {
namespace {

constexpr std::size_t kMostBrowsers = 32;
constexpr std::int64_t kBrowserSilence = 1000;  // after which a place may be given to another [ms]

}  // namespace

Guests::Guests(const ServerConfig& config, const ServerLog& log, Counters& counters)
    : config_(config), log_(log), http_(listen_for_browsers(config, log)), reception_(config, log, counters)
{
}

bool Guests::has_room_for_browser(std::int64_t now) const
{
    return browsers_.size() < kMostBrowsers || browsers_.front().since_ms() + kBrowserSilence <= now;
}

void Guests::add_doors_to(std::vector<pollfd>& polled, std::int64_t now)
{
    first_door_ = polled.size();
    polled.push_back({reception_.fd(), POLLIN, 0});
    polled.push_back({http_.get(), static_cast<short>(has_room_for_browser(now) ? POLLIN : 0), 0});
}

void Guests::let_in(const std::vector<pollfd>& polled)
{
    if (polled[first_door_].revents != 0) connections_.splice(connections_.end(), reception_.take());
    if (polled[first_door_ + 1].revents != 0) let_in_browsers();
}

void Guests::let_in_browsers()
{
    for (const std::int64_t now = steady_ms(); has_room_for_browser(now);) {
        Fd fd(::accept4(http_.get(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
        if (!fd) return;
        if (browsers_.size() >= kMostBrowsers) browsers_.pop_front();  // the oldest goes for one that has come
        browsers_.emplace_back(std::move(fd), now);
    }
}

void Guests::drop(std::int64_t now)
{
    browsers_.remove_if([&](const HttpConnection& browser) { return browser.done(now); });
    std::list<Connection> leaving;
    for (auto connection = connections_.begin(); connection != connections_.end();) {
        const auto here = connection++;
        const bool late = !here->closed() && now >= here->deadline(config_.message_seconds);
        if (late) log_.write(Level::warning, "timed_out", {{"owner", here->caller().owner}});
        if (late) here->close();
        if (here->closed() || here->is_finishing()) leaving.splice(leaving.end(), connections_, here);
    }
    reception_.see_off(std::move(leaving));
}

}  // namespace rcs::service
