#include "view/viewer.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <utility>

#include "rcs/error.h"

namespace rcs::service {
namespace {

using Clock = Desk::Clock;

// Where the time of a frame goes, of a tenth of a second from the hand to the eye: the page takes its part.
constexpr double kFrameSeconds = 0.055;
constexpr double kFinerBelow = 0.8;                             // of that time, by which a finer picture must be made
constexpr double kGatherSeconds = 0.01;                         // for records of a frame in motion
constexpr double kFirstGather = 0.05;                           // ... and of the first picture at rest
constexpr auto kRest = std::chrono::milliseconds(100);          // without a new look
constexpr auto kBetweenSteps = std::chrono::milliseconds(300);  // of a picture that comes nearer
constexpr double kFirstPart = 1.5;                              // of the size that picture has: it is soon followed
// The size of pictures in motion, in parts of the one at rest.
constexpr std::array<double, 8> kParts = {1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0};

double seconds_since(Clock::time_point begin) { return std::chrono::duration<double>(Clock::now() - begin).count(); }

View size_of(const RenderOptions& options, double part)
{
    View view;
    view.width = std::max(1, static_cast<int>(std::lround(options.width / part)));
    view.height = std::max(1, static_cast<int>(std::lround(options.height / part)));
    return view;
}

}  // namespace

Viewer::Viewer(Session& session, ToneMapper& mapper, Desk& desk, RequestFunction request, Display display)
    : session_(session), mapper_(mapper), desk_(desk), request_(std::move(request)), display_(std::move(display))
{
}

ProgressFunction Viewer::until_called() const
{
    return [this](std::string_view, float) { return !desk_.is_called(); };
}

void Viewer::run(std::optional<Clock::duration> grace)
{
    for (;;) {
        const Desk::Turn turn = desk_.wait(rest_at_, grace);
        if (turn == Desk::Turn::leave) return;
        try {
            turn == Desk::Turn::look ? look() : rest();
        } catch (const Error& e) {
            if (e.code() == ErrorCode::cancelled) continue;  // there is something newer
            rest_at_.reset();
            display_.tell(e.what());
        }
    }
}

void Viewer::look()
{
    bool afresh = false;
    const std::optional<Look> next = desk_.take(afresh);
    if (!next) return;
    const bool is_same = picture_ && same_picture(*next, look_) && !afresh;
    const bool is_done = is_same && picture_->progress == Progress::done;
    look_ = *next;
    asked_ = request_(look_);
    rest_at_.reset();
    if (!is_done) rest_at_ = Clock::now() + kRest;
    if (is_same) return send();  // otherwise shown
    if (afresh) {
        session_.forget_light();
        is_fresh_ = true;
        return;
    }
    const Clock::time_point begin = Clock::now();
    is_fresh_ = false;
    glance_at(size_of(asked_.options, kParts[pace_]), kGatherSeconds, Progress::moving, begin);
    settle_pace(seconds_since(begin));
    rest_at_ = Clock::now() + kRest;
}

/// Pictures in motion become coarser where they take too long, and finer where there is time.
void Viewer::settle_pace(double seconds)
{
    const double pixel_seconds = seconds * kParts[pace_] * kParts[pace_];
    const auto takes = [&](std::size_t pace) { return pixel_seconds / (kParts[pace] * kParts[pace]); };
    if (seconds > kFrameSeconds && pace_ + 1 < kParts.size())
        ++pace_;
    else if (pace_ > 0 && takes(pace_ - 1) < kFinerBelow * kFrameSeconds)
        --pace_;
}

void Viewer::glance_at(const View& size, double gather_seconds, Progress progress, Clock::time_point begin)
{
    RenderOptions options = asked_.options;
    options.width = size.width;
    options.height = size.height;
    // A frame that has begun is shown: the next one begins with what is newest then.
    const ProgressFunction on = progress == Progress::moving ? ProgressFunction{} : until_called();
    RenderResult result = glance(session_, asked_.camera, options, {.gather_seconds = gather_seconds}, on);
    const double filled = static_cast<double>(result.stats.unserved_pixels) / (size.width * size.height);
    take(std::move(result.image), result.stats.errors, progress, begin);
    picture_->filled = filled;
    send();
}

void Viewer::rest()
{
    const Clock::time_point begin = Clock::now();
    rest_at_.reset();
    try {
        // What was forgotten is to come out as a render of its own would.
        if (!is_fresh_) glance_at(size_of(asked_.options, kFirstPart), kFirstGather, Progress::refining, begin);
        render(begin);
        is_fresh_ = false;
    } catch (const Error& e) {
        if (e.code() == ErrorCode::cancelled) rest_at_ = Clock::now() + kRest;
        is_fresh_ = false;
        throw;
    }
}

void Viewer::render(Clock::time_point begin)
{
    Clock::time_point last = Clock::now();
    // Records are at work meanwhile, where nothing can show them.
    const auto is_due = [&] {
        return look_.layer != ViewLayer::records && desk_.may_send() && Clock::now() - last >= kBetweenSteps;
    };
    const auto show = [&](LayeredImage image, const ErrorEstimates& errors) {
        take(std::move(image), errors, Progress::refining, begin);
        send();
        last = Clock::now();
    };
    RenderHooks hooks{.progress = until_called()};
    hooks.after_step = [&](const std::function<PictureSoFar()>& make) {
        if (!is_due()) return;
        PictureSoFar so_far = make();
        show(std::move(so_far.image), so_far.errors);
    };
    hooks.after_pass = [&](int, int, const std::function<LayeredImage()>& make) {
        if (!is_due()) return;
        LayeredImage image = make();
        const ErrorEstimates errors = estimate_errors(image);
        show(std::move(image), errors);
    };
    RenderResult result = rcs::render(session_, asked_.camera, asked_.options, hooks);
    take(std::move(result.image), result.stats.errors, Progress::done, begin);
    if (desk_.wait_to_send()) send();
}

void Viewer::take(LayeredImage image, const ErrorEstimates& errors, Progress progress, Clock::time_point begin)
{
    const std::scoped_lock lock(mutex_);
    ViewPicture& picture = picture_.emplace();
    const Image& beauty = image.layers.at("beauty");
    picture.view.camera = asked_.camera;
    picture.view.width = beauty.width;
    picture.view.height = beauty.height;
    picture.image = std::move(image);
    picture.progress = progress;
    picture.error = errors.image.mean_relative;
    picture.indirect_error = errors.indirect.mean_relative;
    picture.seconds = seconds_since(begin);
}

void Viewer::send()
{
    if (!desk_.may_send()) return;
    const Image display = develop(*picture_, look_, session_.records(), mapper_, session_.pool());
    const float exposure = mapper_.exposure(picture_->image.layers.at("beauty"));
    if (!session_.records().empty()) records_ = session_.records().size();
    std::string message = frame_message(*picture_, look_, ++frames_, records_, asked_.command, display, exposure);
    desk_.sent(frames_);
    display_.show(std::move(message));
}

std::optional<glm::dvec3> Viewer::pick(const Pick& pick) const
{
    const std::scoped_lock lock(mutex_);
    return picture_ ? point_at(*picture_, pick) : std::nullopt;
}

}  // namespace rcs::service
