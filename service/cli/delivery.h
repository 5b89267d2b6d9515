#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>

#include "client/client.h"

namespace rcs::service {

/// Writes the pictures of a job's frames, each once, as they come to be.
class Delivery {
public:
    /// @param patterns  paths by the names of the job's outputs; a job of several frames has a place for the number
    /// @param written   told of each file   @param warned  of what was said while a frame was rendered
    Delivery(Client& client, std::uint64_t job, std::map<std::string, std::string> patterns,
             std::function<void(const std::string&)> written, std::function<void(const std::string&)> warned);

    /// Frames that have ended since the last call.
    void take_new();
    /// All frames, or one. @return the frames that have no pictures, with the reason; "" if there are none
    /// @throws rcs::Error not_found: there is no such frame
    std::string take_all(std::optional<int> frame = std::nullopt);

private:
    void take(const v1::FrameStatus& frame);

    Client& client_;
    std::uint64_t job_;
    std::map<std::string, std::string> patterns_;
    std::function<void(const std::string&)> written_, warned_;
    std::set<int> taken_;
    std::uint32_t first_open_ = 0;  ///< of the job's frames in their order: those before have ended
};

/// Where an output of a job goes in a folder: as whoever submitted it called it.
std::string path_of_output(const std::string& folder, const v1::Output& output, int frames);

}  // namespace rcs::service
