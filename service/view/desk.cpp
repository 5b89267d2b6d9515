#include "view/desk.h"

#include <algorithm>
#include <utility>

#include "process/interrupt.h"

namespace rcs::service {
namespace {

constexpr auto kLookForSignals = std::chrono::milliseconds(100);

}  // namespace

void Desk::come()
{
    const std::scoped_lock lock(mutex_);
    is_there_ = was_there_ = true;
    on_its_way_ = 0;
    changed_.notify_all();
}

void Desk::go()
{
    const std::scoped_lock lock(mutex_);
    is_there_ = false;
    on_its_way_ = 0;
    gone_at_ = Clock::now();
    changed_.notify_all();
}

void Desk::put(const Look& look)
{
    const std::scoped_lock lock(mutex_);
    new_ = last_ = look;
    changed_.notify_all();
}

void Desk::put_afresh()
{
    const std::scoped_lock lock(mutex_);
    if (!last_) return;
    new_ = last_;
    afresh_ = true;
    changed_.notify_all();
}

void Desk::put(const Shown& shown)
{
    const std::scoped_lock lock(mutex_);
    if (shown.frame == on_its_way_) on_its_way_ = 0;
    changed_.notify_all();
}

Desk::Turn Desk::wait(std::optional<Clock::time_point> rest_at, std::optional<Clock::duration> grace)
{
    std::unique_lock lock(mutex_);
    for (;;) {
        const Clock::time_point now = Clock::now();
        if (interrupt_signal() != 0) return Turn::leave;
        if (!is_there_ && was_there_ && grace && now >= gone_at_ + *grace) return Turn::leave;
        if (is_there_ && new_ && on_its_way_ == 0) return Turn::look;
        if (is_there_ && !new_ && rest_at && now >= *rest_at) return Turn::rest;
        Clock::time_point until = now + kLookForSignals;
        if (is_there_ && rest_at && !new_) until = std::min(until, *rest_at);
        changed_.wait_until(lock, until);
    }
}

std::optional<Look> Desk::take(bool& afresh)
{
    const std::scoped_lock lock(mutex_);
    afresh = std::exchange(afresh_, false);
    return std::exchange(new_, std::nullopt);
}

bool Desk::is_called() const
{
    const std::scoped_lock lock(mutex_);
    return new_ || !is_there_ || interrupt_signal() != 0;
}

bool Desk::may_send() const
{
    const std::scoped_lock lock(mutex_);
    return is_there_ && on_its_way_ == 0;
}

bool Desk::wait_to_send()
{
    std::unique_lock lock(mutex_);
    for (;;) {
        if (new_ || !is_there_ || interrupt_signal() != 0) return false;
        if (on_its_way_ == 0) return true;
        changed_.wait_for(lock, kLookForSignals);
    }
}

void Desk::sent(std::uint64_t frame)
{
    const std::scoped_lock lock(mutex_);
    if (is_there_) on_its_way_ = frame;
}

std::optional<Look> Desk::last() const
{
    const std::scoped_lock lock(mutex_);
    return last_;
}

}  // namespace rcs::service
