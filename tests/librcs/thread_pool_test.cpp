#include "rcs/thread_pool.h"

#include <atomic>
#include <cstddef>
#include <limits>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "rcs/error.h"

namespace rcs {
namespace {

TEST(ThreadPool, VisitsEveryIndexOnceForAnySizeGrainAndNumberOfThreads)
{
    for (const int threads : {1, 2, 3, 7}) {
        ThreadPool pool(threads);
        for (const std::size_t count : {0u, 1u, 2u, 15u, 16u, 17u, 1000u, 65537u}) {
            for (const std::size_t grain : {1u, 3u, 16u, 1000u, 1000000u}) {
                std::vector<std::atomic<int>> visits(count);
                std::atomic<int> wrong{0};
                pool.parallel_for(count, grain, [&](std::size_t begin, std::size_t end, int thread) {
                    if (begin >= end || end > count || end - begin > grain || thread < 0 || thread >= threads) ++wrong;
                    for (std::size_t i = begin; i < end; ++i) ++visits[i];
                });
                EXPECT_EQ(wrong, 0) << threads << " threads, " << count << " by " << grain;
                for (std::size_t i = 0; i < count; ++i) ASSERT_EQ(visits[i], 1) << i << " of " << count;
            }
        }
    }
}

TEST(ThreadPool, TakesAGrainOfZeroForOne)
{
    ThreadPool pool(2);
    std::vector<std::atomic<int>> visits(100);
    pool.parallel_for(visits.size(), 0, [&](std::size_t begin, std::size_t end, int) {
        EXPECT_EQ(end, begin + 1);
        ++visits[begin];
    });
    for (const auto& count : visits) EXPECT_EQ(count, 1);
}

TEST(ThreadPool, RunsOneBodyPerThreadNumberAtATime)
{
    // What a workspace per thread relies on.
    ThreadPool pool(4);
    std::vector<std::atomic<int>> inside(4);
    std::atomic<int> collisions{0};
    pool.parallel_for(20000, 1, [&](std::size_t, std::size_t, int thread) {
        auto& mine = inside[static_cast<std::size_t>(thread)];
        if (++mine != 1) ++collisions;
        --mine;
    });
    EXPECT_EQ(collisions, 0);
}

/// Threads that a loop has no chunks for are left alone, and so is one that wakes too late.
TEST(ThreadPool, LoopsOfFewChunksVisitEveryIndexOnce)
{
    ThreadPool pool(8);
    const std::thread::id caller = std::this_thread::get_id();
    for (int loop = 0; loop < 2000; ++loop) {
        std::atomic<int> visits{0};
        const auto chunks = static_cast<std::size_t>(loop % 4);
        pool.parallel_for(16 * chunks, 16, [&](std::size_t begin, std::size_t end, int) {
            visits += static_cast<int>(end - begin);
            if (chunks == 1) {
                EXPECT_EQ(std::this_thread::get_id(), caller);
            }
        });
        ASSERT_EQ(visits, static_cast<int>(16 * chunks));
    }
}

TEST(ThreadPool, RethrowsAnExceptionOfABodyAndCanBeUsedAgain)
{
    for (const int threads : {1, 2, 5}) {
        ThreadPool pool(threads);
        for (int round = 0; round < 50; ++round) {
            try {
                pool.parallel_for(1000, 1, [&](std::size_t begin, std::size_t, int) {
                    if (begin % 100 == 37) throw std::runtime_error("body " + std::to_string(begin));
                });
                FAIL() << "nothing was thrown";
            } catch (const std::runtime_error& e) {
                EXPECT_EQ(std::string(e.what()).substr(0, 5), "body ");
            }
            std::atomic<std::size_t> sum{0};
            pool.parallel_for(101, 8, [&](std::size_t begin, std::size_t end, int) {
                for (std::size_t i = begin; i < end; ++i) sum += i;
            });
            ASSERT_EQ(sum, 5050u);
        }
    }
}

TEST(ThreadPool, StopsHandingOutWorkAfterAnException)
{
    ThreadPool pool(1);
    int calls = 0;
    EXPECT_THROW(pool.parallel_for(1000, 1,
                                   [&](std::size_t, std::size_t, int) {
                                       if (++calls == 3) throw std::runtime_error("enough");
                                   }),
                 std::runtime_error);
    EXPECT_EQ(calls, 3);
}

TEST(ThreadPool, OfOneThreadWorksInTheCallersOrder)
{
    ThreadPool pool(1);
    EXPECT_EQ(pool.size(), 1);
    std::vector<std::size_t> order;
    pool.parallel_for(10, 3, [&](std::size_t begin, std::size_t, int thread) {
        EXPECT_EQ(thread, 0);
        order.push_back(begin);
    });
    EXPECT_EQ(order, (std::vector<std::size_t>{0, 3, 6, 9}));
}

TEST(ThreadPool, ZeroMeansEveryCoreAndLessIsAnError)
{
    EXPECT_GE(ThreadPool(0).size(), 1);
    for (const int threads : {-1, std::numeric_limits<int>::min()}) {
        try {
            const ThreadPool pool(threads);
            FAIL() << threads;
        } catch (const Error& e) {
            EXPECT_EQ(e.code(), ErrorCode::bad_argument);
            EXPECT_NE(std::string(e.what()).find("threads is " + std::to_string(threads)), std::string::npos)
                << e.what();
        }
    }
}

}  // namespace
}  // namespace rcs
