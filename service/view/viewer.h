#pragma once

#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <string>

#include "rcs/camera.h"
#include "rcs/render.h"
#include "rcs/session.h"
#include "rcs/tone_map.h"
#include "view/desk.h"
#include "view/frame_message.h"

namespace rcs::service {

/// What a look asks of the library.
struct ViewRequest {
    Camera camera;
    RenderOptions options;
    std::string command;  ///< line that renders the same
};

/// Where pictures go.
struct Display {
    std::function<void(std::string message)> show;  ///< a frame, frame_message()
    std::function<void(std::string text)> tell;     ///< why there is none: one line
};

/// Renders what the page looks at: glances while the camera moves, as large as there is time for, and once it rests the
/// picture that was asked for, step by step. Uses one session, which keeps its records, in the thread that calls run().
class Viewer {
public:
    using RequestFunction = std::function<ViewRequest(const Look&)>;

    Viewer(Session& session, ToneMapper& mapper, Desk& desk, RequestFunction request, Display display);

    /// Until the last page has been gone for `grace`, or a signal came.
    /// @param grace  none: only the signal ends it
    void run(std::optional<Desk::Clock::duration> grace);

    /// What lies at a part of the picture last shown, in scene space [m]; from any thread.
    std::optional<glm::dvec3> pick(const Pick& pick) const;

private:
    void look();
    void rest();
    void render(Desk::Clock::time_point begin);
    void glance_at(const View& size, double gather_seconds, Progress progress, Desk::Clock::time_point begin);
    void take(LayeredImage image, const ErrorEstimates& errors, Progress progress, Desk::Clock::time_point begin);
    void send();
    void settle_pace(double seconds);
    ProgressFunction until_called() const;

    Session& session_;
    ToneMapper& mapper_;
    Desk& desk_;
    RequestFunction request_;
    Display display_;
    Look look_;
    ViewRequest asked_;
    std::size_t pace_ = 2;   // which of the parts of the size pictures in motion have
    bool is_fresh_ = false;  // light has just been forgotten
    std::optional<Desk::Clock::time_point> rest_at_;
    std::uint64_t frames_ = 0;
    std::size_t records_ = 0;   // when they were last there to be counted
    mutable std::mutex mutex_;  // of what pick() reads
    std::optional<ViewPicture> picture_;
};

}  // namespace rcs::service
