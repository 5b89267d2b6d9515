#pragma once

#include <chrono>
#include <functional>
#include <string>
#include <thread>

#include <gtest/gtest.h>

#include "rcs/scene.h"
#include "stability/export_glb.h"
#include "support/server.h"
#include "support/temporary_folder.h"

/// What tests of the render service have in common.
namespace rcs::test {

using Clock = std::chrono::steady_clock;

inline double seconds_since(Clock::time_point begin)
{
    return std::chrono::duration<double>(Clock::now() - begin).count();
}

template <typename Use>
v1::ErrorCode code_of(const Use& use)
{
    try {
        use();
    } catch (const service::ServiceError& e) {
        return e.code();
    }
    return v1::ERROR_CODE_UNSPECIFIED;
}

inline void wait_until(const std::function<bool()>& holds)
{
    for (int i = 0; i < 3000 && !holds(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(10));
    ASSERT_TRUE(holds());
}

/// Waits until a job's frame has begun to render.
inline void wait_until_rendering(service::Client& client, std::uint64_t job)
{
    wait_until([&] {
        const v1::JobStatus status = client.details(job).status();
        return status.running_size() > 0 && status.running(0).fraction() > 0.1f;
    });
}

class RenderService : public ::testing::Test {
protected:
    /// A built-in scene as a file, without its textures and sky. @return its path
    std::string scene_file(const std::string& name)
    {
        const std::string path = folder_ / (name + ".glb");
        stability::export_glb(load_scene("demo:" + name), path);
        return path;
    }

    TemporaryFolder folder_;
};

}  // namespace rcs::test
