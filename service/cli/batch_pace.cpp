#include "cli/batch_pace.h"

#include <algorithm>
#include <cstdio>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "process/clock.h"
#include "rcs/error.h"
#include "report/encoding.h"

namespace rcs::service {

namespace {

constexpr double kLate = 0.05;  ///< of the time there was: less is in time

// Records that frames share are brought, in no more than that part of the time, to so many times the error that is
// thought to be possible. That shows what a frame and a look ahead take.
constexpr double kFirstGo = 0.5, kCoarser = 2.0;
// Then goes take so much of what is left beside the frames, which may take so many times what is known, while that is
// more than that part of the time: some at once, others later, as frames take less.
constexpr double kInto = 0.7, kFramesTake = 1.15, kWorthAGo = 0.1;
constexpr int kMostGoes = 3, kLooksAtLeast = 9;
// Frames are aimed at so many times the error that a look ahead has left...
constexpr double kLooser = 1.3;
// ... where they have that part of the time that they take.
constexpr double kEnough = 0.9;
// The last one gets its time where that is so many times what it takes.
constexpr double kMuchMore = 1.5;
constexpr std::size_t kRecent = 5;  ///< frames that say what one takes

}  // namespace

double BatchPace::left() const { return 1e-3 * static_cast<double>(*arguments_.deadline_ms - steady_ms()); }

void BatchPace::begin(std::set<int> waiting)
{
    if (!arguments_.deadline_ms || waiting.empty()) return;
    waiting_ = std::move(waiting);
    asked_ = left();
    pace_.learn(maker_.forecast(*waiting_.begin()));
    const double each = left() / static_cast<double>(waiting_.size());
    const std::string frames = std::to_string(waiting_.size()) + (waiting_.size() == 1 ? " frame" : " frames");
    std::string words = frames + " in " + duration_text(asked_) + ": " + duration_text(each) + " each";
    if (pace_.knows()) {
        const double error = maker_.places_for(*waiting_.begin()).size() < 2
                                 ? pace_.error_in(each)
                                 : pace_.error_of_shot(left(), waiting_.size());
        words += error < Pace::kMostError ? ", which makes an error of about " + percent_text(error)
                                          : ", which is little: each gets its time, whatever the error";
    }
    say(words);
}

void BatchPace::say(const std::string& words) const
{
    if (arguments_.render.report.quiet) return;
    std::printf("%s\n", words.c_str());
    std::fflush(stdout);
}

/// Places the records that this frame shares with others, to an error that leaves time for more.
void BatchPace::begin_part(int number)
{
    part_ = maker_.places_for(number);
    looks_ = 0;
    if (!pace_.knows()) return;
    const double guess = shared_ > 0.0 ? shared_ : pace_.error_of_shot(for_part(), part_.size());
    const double error = std::min(Pace::kMostError, kCoarser * guess);
    look_ahead(number, TargetError{error}, kFirstGo * for_part());
}

void BatchPace::look_ahead(int number, const Quality& quality, double seconds)
{
    const std::optional<AheadStats> ahead = maker_.place_ahead(number, quality, seconds);
    looks_ = ahead ? ahead->views : std::max(kLooksAtLeast, 2 * looks_);  // more than were to be expected
    if (looks_ == 0) return;
    pace_.learn(maker_.forecast(number));
    shared_ = std::max(pace_.settled_error(), ahead ? ahead->error : 0.0);
}

/// Lets what the frames do not need make the records that they share better.
void BatchPace::spend(int number)
{
    for (int go = 0; looks_ > 0 && go < kMostGoes; ++go) {
        const double each = usual_seconds();
        const double room = for_part() - kFramesTake * frames_of_part() * each;
        if (room < kWorthAGo * for_part() || kInto * room < looks_ * each) return;
        look_ahead(number, Budget{kInto * room / looks_}, room);
    }
}

/// What frames that share records take, as long as these are good enough: a few that take more do not count.
double BatchPace::usual_seconds() const
{
    if (recent_.empty()) return pace_.seconds_to(Pace::kMostError) + maker_.seconds_around();
    std::vector<double> sorted(recent_.begin(), recent_.end());
    const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
    std::nth_element(sorted.begin(), middle, sorted.end());
    return *middle;
}

double BatchPace::frames_of_part() const
{
    return static_cast<double>(std::count_if(part_.begin(), part_.end(), [&](int n) { return waiting_.contains(n); }));
}

/// The time there is for them [s].
double BatchPace::for_part() const { return left() * frames_of_part() / static_cast<double>(waiting_.size()); }

void BatchPace::share_records(int number)
{
    try {
        const bool begins = !maker_.places_for(number).empty();
        if (begins) begin_part(number);
        spend(number);
        if (begins && looks_ > 0)
            say("the records of frames " + std::to_string(part_.front()) + " to " + std::to_string(part_.back()) +
                " are there, which makes an error of about " + percent_text(shared_));
    } catch (const Error& e) {
        if (e.code() == ErrorCode::cancelled) throw;
        looks_ = 0;  // the frame itself will say why
    }
}

void BatchPace::aim(int number)
{
    if (!waiting_.contains(number)) return;
    share_records(number);
    const double each = left() / static_cast<double>(waiting_.size());
    double error = pace_.error_in(each);
    bool is_last = waiting_.size() == 1;  // which ends in time, and is about as good as the one before
    if (looks_ > 0) {
        // Where records are shared none is to differ by much: the others would pay for it.
        const double usual = usual_seconds();
        is_last = is_last && each > kMuchMore * usual;
        const bool is_enough = each > kEnough * usual || waiting_.size() == 1;
        error = is_enough ? kLooser * shared_ : std::max(error, kLooser * shared_);
    }
    const bool is_aimed = !is_last && error < Pace::kMostError;
    aimed_at_ = is_aimed ? error : 0.0;
    if (is_aimed)
        maker_.aim(TargetError{error});
    else
        maker_.aim(Budget{std::max(1e-3, each - maker_.seconds_around())});
}

void BatchPace::learn(FrameResult& result)
{
    if (waiting_.erase(result.number) == 0 || result.end != FrameEnd::rendered) return;
    pace_.learn(maker_.last_forecast());
    if (looks_ > 0 && !is_first_) recent_.push_back(result.figures.seconds);
    if (recent_.size() > kRecent) recent_.pop_front();
    is_first_ = false;
    if (aimed_at_ > 0.0 && looks_ == 0 && pace_.knows()) pace_.learn(aimed_at_, result.figures.seconds);
    if (!waiting_.empty() || -left() <= kLate * asked_) return;
    const std::string late = "the frames were done " + duration_text(-left()) + " after the deadline";
    maker_.warn(late);
    result.figures.warnings.push_back(late);
}

}  // namespace rcs::service
