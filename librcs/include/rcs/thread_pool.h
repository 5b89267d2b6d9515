#pragma once

#include <cstddef>
#include <functional>
#include <memory>

#include "rcs/api.h"

namespace rcs {

/// A fixed set of worker threads. Results never depend on its size: work items write to their own
/// slots, and nothing is reduced in the order in which threads finish.
class RCS_API ThreadPool {
public:
    /// @param threads  >= 1, or 0 for one per available core
    explicit ThreadPool(int threads = 0);
    ~ThreadPool();
    ThreadPool(const ThreadPool&) = delete;
    ThreadPool& operator=(const ThreadPool&) = delete;

    /// Threads, the caller's among them.
    int size() const noexcept;

    /// Calls body(begin, end, thread) over [0, count) in chunks of at most `grain` items, and
    /// returns when all are done. `thread` is in [0, size()). The first exception of a body is
    /// rethrown here, after the others have ended. Calls must not be nested.
    void parallel_for(std::size_t count, std::size_t grain,
                      const std::function<void(std::size_t begin, std::size_t end, int thread)>& body);

    struct State;
    /// For the library's own use.
    State& state() noexcept { return *state_; }

private:
    std::unique_ptr<State> state_;
};

}  // namespace rcs
