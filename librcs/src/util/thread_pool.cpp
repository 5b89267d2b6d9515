#include "rcs/thread_pool.h"

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "rcs/error.h"
#include "util/counters.h"

namespace rcs {

struct ThreadPool::State {
    using Body = std::function<void(std::size_t, std::size_t, int)>;

    std::vector<std::jthread> workers;
    std::mutex mutex;
    std::condition_variable work_ready;
    std::condition_variable work_done;
    int wanted = 0;  // workers that are to join the current loop
    int busy = 0;    // those that have not yet left it
    bool stopping = false;

    const Body* body = nullptr;
    std::size_t count = 0;
    std::size_t grain = 1;
    std::atomic<std::size_t> next{0};
    std::exception_ptr failure;
    Counts counts;

    void run_chunks(int thread)
    {
        for (;;) {
            const std::size_t begin = next.fetch_add(grain, std::memory_order_relaxed);
            if (begin >= count) return counts.take_own();
            try {
                (*body)(begin, std::min(begin + grain, count), thread);
            } catch (...) {
                const std::scoped_lock lock(mutex);
                if (!failure) failure = std::current_exception();
                next.store(count, std::memory_order_relaxed);
            }
        }
    }

    void work(int thread)
    {
        std::unique_lock lock(mutex);
        for (;;) {
            work_ready.wait(lock, [&] { return stopping || wanted > 0; });
            if (stopping) return;
            --wanted;
            lock.unlock();
            run_chunks(thread);
            lock.lock();
            if (--busy == 0) work_done.notify_all();
        }
    }
};

ThreadPool::ThreadPool(int threads) : state_(std::make_unique<State>())
{
    if (threads < 0)
        throw Error(ErrorCode::bad_argument,
                    "threads is " + std::to_string(threads) + ", expected 0 (all cores) or more");
    if (threads == 0) threads = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
    for (int thread = 1; thread < threads; ++thread)
        state_->workers.emplace_back([state = state_.get(), thread] { state->work(thread); });
}

ThreadPool::~ThreadPool()
{
    {
        const std::scoped_lock lock(state_->mutex);
        state_->stopping = true;
    }
    state_->work_ready.notify_all();
}

int ThreadPool::size() const noexcept { return static_cast<int>(state_->workers.size()) + 1; }

void ThreadPool::parallel_for(std::size_t count, std::size_t grain, const State::Body& body)
{
    if (count == 0) return;
    State& s = *state_;
    grain = std::max<std::size_t>(grain, 1);
    // To wake a thread takes longer than many a loop of one chunk.
    const std::size_t helpers = std::min(s.workers.size(), (count - 1) / grain);
    {
        const std::scoped_lock lock(s.mutex);
        s.body = &body;
        s.count = count;
        s.grain = grain;
        s.next.store(0, std::memory_order_relaxed);
        s.failure = nullptr;
        s.wanted = s.busy = static_cast<int>(helpers);
    }
    for (std::size_t i = 0; i < helpers; ++i) s.work_ready.notify_one();
    s.run_chunks(0);
    std::unique_lock lock(s.mutex);
    // Who is not yet awake is not waited for.
    s.busy -= std::exchange(s.wanted, 0);
    s.work_done.wait(lock, [&] { return s.busy == 0; });
    if (s.failure) std::rethrow_exception(std::exchange(s.failure, nullptr));
}

std::array<std::uint64_t, kCounts> total_counts(ThreadPool& pool)
{
    pool.state().counts.take_own();
    return pool.state().counts.totals();
}

}  // namespace rcs
