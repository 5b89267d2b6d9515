// What Service does once frames and jobs have ended: their pictures are delivered, and they are announced.
#include <algorithm>

#include "batch/delivered_name.h"
#include "batch/frames.h"
#include "server/service.h"
#include "wire/errors.h"

namespace rcs::service {
namespace {

constexpr int kFramesAtATime = 16;                             // frames that the deliverer is given
constexpr std::int64_t kFirstPause = 1000, kLongest = 60'000;  // after a delivery that failed [ms]

}  // namespace

/// Takes down what was delivered, and gives the deliverer more. What fails is repeated: the picture stays here.
void Service::deliver(std::int64_t now)
{
    if (!deliverer_) return;
    try {
        for (const DeliveryEnd& end : deliverer_->take()) {
            being_delivered_.erase(end.key);
            queue_.end_delivery(end.key, end.error);
            if (end.error.empty()) {
                delivery_pause_ms_ = 0;
                continue;
            }
            if (delivery_pause_ms_ == 0)
                log_.write(Level::warning, "not_delivered", {{"job", end.key.job}, {"why", end.error}});
            delivery_pause_ms_ = std::clamp(2 * delivery_pause_ms_, kFirstPause, kLongest);
            deliver_after_ms_ = now + delivery_pause_ms_;
        }
        queue_.commit();
        if (now < deliver_after_ms_ || !being_delivered_.empty()) return;
        for (const JobQueue::Undelivered& frame : queue_.undelivered(kFramesAtATime)) give_to_deliverer(frame);
    } catch (const ServiceError& e) {
        queue_.roll_back();  // it is delivered once more
        log_.write(Level::error, "not_delivered", {{"why", e.what()}});
    }
}

void Service::give_to_deliverer(const JobQueue::Undelivered& frame)
{
    const auto job = queue_.job(frame.key.job);
    if (!job) return;
    DeliveryTask task{frame.key, path_of(frame.folder), folder_beneath(config_.deliver_root, job->deliver()), {}};
    const v1::FrameStatus made = queue_.files_of(frame.key);
    const int frames = queue_.status(frame.key.job)->frames();
    for (const v1::OutputFile& file : made.files()) {
        const auto output = std::find_if(job->outputs().begin(), job->outputs().end(),
                                         [&](const v1::Output& asked) { return asked.name() == file.name(); });
        const std::string given = output != job->outputs().end() ? output->file_name() : "";
        const std::string pattern = delivered_name(given, file.name(), frames);
        task.files.emplace_back(file.name(), path_of_frame(pattern, made.number()));
    }
    being_delivered_.insert(frame.key);
    deliverer_->give(std::move(task));
}

/// Runs the operator's command for jobs that have ended.
void Service::announce(std::int64_t now)
{
    try {
        for (const std::uint64_t job : completion_command_.take(now)) queue_.end_announcement(job);
        queue_.commit();
        if (config_.on_completion.empty() || stopping_ || !completion_command_.has_room()) return;
        for (const std::uint64_t job : queue_.unannounced(kFramesAtATime)) {
            if (completion_command_.has_room() && !completion_command_.runs_for(job))
                completion_command_.start(*queue_.status(job), now);
        }
    } catch (const ServiceError& e) {
        queue_.roll_back();  // it is announced once more
        log_.write(Level::error, "not_announced", {{"why", e.what()}});
    }
}

}  // namespace rcs::service
