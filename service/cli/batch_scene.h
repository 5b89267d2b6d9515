#pragma once

#include <optional>
#include <string>

#include "cli/arguments.h"
#include "cli/shutter.h"
#include "rcs/session.h"

namespace rcs::service {

/// The scene of a batch: which files it is made from, and what it comes to at a time.
class BatchScene {
public:
    /// Reads all files once. @throws rcs::Error that names the file
    explicit BatchScene(const SceneArguments& arguments);

    /// What the scene is and how it is seen at a time, as a hash: of files, not of names. The same hash, the same
    /// light.
    std::string source_at(double time) const;
    /// Makes the session show it. Nothing is loaded where the last one shown looks the same.
    void show(Session& session, double time, const LogFunction& log);
    /// What the session is to show while the shutter is open, which then shows the last of it.
    MomentFunction moments(const Session& session, const Shutter& shutter, double time);
    bool is_animated() const { return is_animated_; }
    CameraChoice camera_at(double time) const { return camera_.at(time); }
    /// The camera at a time, whatever the session shows.
    Camera camera(const Session& session, double time, const LogFunction& log) const;
    /// @throws rcs::Error io, if a file is another than when the batch began
    void check_unchanged() const;

private:
    std::string stamps() const;  ///< sizes and times of the files

    SceneArguments arguments_;
    CameraSource camera_;
    std::vector<std::string> files_;
    std::string content_;  ///< hash of the files' bytes
    std::string stamps_;
    bool is_animated_;
    std::optional<double> shown_;  ///< time
};

}  // namespace rcs::service
