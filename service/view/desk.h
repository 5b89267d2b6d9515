#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <optional>

#include "view/look.h"

namespace rcs::service {

/// Between the thread that serves the page and the one that renders: the newest look, whatever came before it; which
/// frame is on its way; whether anybody is there. Holds one of each.
class Desk {
public:
    using Clock = std::chrono::steady_clock;

    // The page's side.
    /// A page is there, in place of any before it.
    void come();
    /// It has gone.
    void go();
    void put(const Look& look);
    /// Light is to be forgotten before the last look is rendered again.
    void put_afresh();
    void put(const Shown& shown);

    // The renderer's side.
    enum class Turn {
        look,   ///< there is a new one, and nothing on its way to the page
        rest,   ///< there is none, and it is time
        leave,  ///< nobody is there any more
    };
    /// Waits for one of them, for a signal, or for `grace` after the last page has gone.
    /// @param rest_at  when to rest; none: never
    Turn wait(std::optional<Clock::time_point> rest_at, std::optional<Clock::duration> grace);
    /// The newest look, if it is new. @param afresh  whether light is to be forgotten
    std::optional<Look> take(bool& afresh);
    /// Whether what is rendered is of no use any more: there is a newer look, or nobody, or a signal came.
    bool is_called() const;
    /// Whether a frame may be sent: none is on its way.
    bool may_send() const;
    /// Waits for that. @return false: called first
    bool wait_to_send();
    void sent(std::uint64_t frame);
    /// The last look there was.
    std::optional<Look> last() const;

private:
    mutable std::mutex mutex_;
    std::condition_variable changed_;
    std::optional<Look> new_, last_;
    bool afresh_ = false, is_there_ = false, was_there_ = false;
    std::uint64_t on_its_way_ = 0;  // number of a frame; 0: none
    Clock::time_point gone_at_{};
};

}  // namespace rcs::service
