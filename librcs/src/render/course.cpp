#include "render/course.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "direct/direct.h"
#include "placement/error_driven.h"
#include "radiance/lobes.h"
#include "rcs/error.h"
#include "render/frame.h"

namespace rcs {
namespace {

// Of the time that a budget leaves, what passes beyond the first may take.
constexpr double kMostForPasses = 0.4;
// ... and what direct light of the first may, which takes so many times what it does without penumbras.
constexpr double kMostForDirect = 0.25;
constexpr double kWithPenumbras = 2.0;
// ... and the first records, as far as they can be fewer.
constexpr double kMostForOverture = 0.4;
// A splat that lights glossy surfaces takes so many times as long as a look at the error: 2.1 to 2.9 in castle, sponza
// and sibenik, 1000x1000; more with smaller pictures.
constexpr double kSplatWithLobes = 3.4;
constexpr int kMostLobeRounds = 64;
// Errors of lobes and records are in different pixels, for the most part: so much of one is added to the other.
constexpr double kLobesAdd = 0.8;

constexpr double kForecastErrors[] = {0.2, 0.1, 0.05, 0.03, 0.02, 0.01};

double seconds_of(const RenderStats& stats, const char* stage)
{
    for (const auto& [name, seconds] : stats.stage_seconds)
        if (name == stage) return seconds;
    return 0.0;
}

/// Part of the pixels whose lobes records light.
double part_with_lobes(const Frame& frame)
{
    const std::size_t pixels = frame.gbuffer.size();
    if (!frame.settings.records.radiance || !frame.shading.has_lobes() || pixels == 0) return 0.0;
    std::size_t lit = 0;
    for (std::size_t i = 0; i < pixels; ++i) lit += frame.shading.recorded(i) ? 1 : 0;
    return static_cast<double>(lit) / static_cast<double>(pixels);
}

/// What follows the first view's records, in looks at the error: each view is splatted, its error estimated, its layers
/// added up; further ones are searched for holes as well.
double looks_after(int passes, double lobes)
{
    return passes * (std::lerp(1.0, kSplatWithLobes, lobes) + 0.5) + (passes - 1) * 2.0;
}

/// The smallest error that takes no more than `seconds`.
template <typename SecondsTo>
double error_within(const SecondsTo& seconds_to, double seconds)
{
    double low = 1e-3, high = 1.0;
    for (int step = 0; step < 20; ++step) {
        const double middle = std::sqrt(low * high);
        (seconds_to(middle) > seconds ? low : high) = middle;
    }
    return high;
}

/// The error of the first view's picture, lit like this. @param lobes  factor of the error of traced lobes
double picture_error(const Frame& frame, PassLight light, float lobes, const ErrorScale& scale)
{
    for (float& error : light.traced.error) error *= lobes;
    LayeredImage picture;
    accumulate_pass(frame.gbuffer, frame.view(), frame.shading, light, {}, nullptr, picture);
    finish_passes(1, picture);
    return estimate_errors(picture, scale, frame.session.pool()).indirect.mean_relative;
}

/// Mean relative error that one round of traced lobes alone leaves.
double lobe_error(const Frame& frame, PassLight light)
{
    if (light.traced.radiance.empty()) return 0.0;
    for (auto* part : {&light.indirect_error.noise, &light.indirect_error.spread})
        std::fill(part->begin(), part->end(), 0.0f);
    return picture_error(frame, std::move(light), 1.0f, {});
}

/// What the coarse records and one round of lobes say of the picture that will be, and what the stages took.
struct Prospect {
    double target = 0.0;                      ///< 0: none
    double before = 0.0;                      ///< spent already [s]
    double rest = 0.0;                        ///< what follows the first view's records takes [s]
    double round_seconds = 0.0;               ///< one more round of traced lobes in every pass
    double of_lobes = 0.0, of_records = 0.0;  ///< errors
    double left_by_records = 0.0;             ///< of an error that is aimed at
    const RecordForecast& records;

    /// Wall time of render() for a mean relative error [s].
    double seconds_to(double error) const
    {
        const double too_much = kLobesAdd * of_lobes / (std::max(1.0 - kShareOfGoal, left_by_records) * error);
        const double rounds = std::clamp(std::ceil(too_much * too_much), 1.0, kMostLobeRounds * 1.0);
        return before + rest + records.seconds_to(error) + (rounds - 1.0) * round_seconds;
    }
};

/// Settles how many passes there are. @return what is to be expected with them
Prospect look_ahead(Frame& frame, const RecordForecast& records)
{
    const double budget = budget_seconds(frame.asked), lobes = part_with_lobes(frame);
    const RenderStats& stats = frame.stats();
    Course& course = frame.course;
    Prospect p{.target = target_error(frame.asked), .before = frame.deadline.elapsed(), .records = records};
    const double pass_seconds =
        seconds_of(stats, "gbuffer") + seconds_of(stats, "direct") + seconds_of(stats, "glossy");
    const auto rest_of = [&](int passes) {
        return looks_after(passes, lobes) * records.look_seconds + (passes - 1) * pass_seconds;
    };
    const auto passes_cost = [&] { return rest_of(course.passes) - rest_of(1); };
    while (budget > 0.0 && course.passes > 1 && passes_cost() > kMostForPasses * (budget - p.before - rest_of(1)))
        --course.passes;
    p.rest = rest_of(course.passes);
    course.pass_seconds = rest_of(2) - rest_of(1);

    PassLight light = frame.light;
    light.indirect = records.sums;
    light.indirect_error = records.errors;
    p.of_lobes = lobe_error(frame, light) / std::sqrt(static_cast<double>(course.passes));
    p.of_records = std::max(1e-6, picture_error(frame, std::move(light), 0.0f, records.scale));
    // Records leave room for the lobes: they stop short of the goal, and are not all of the light.
    p.left_by_records = 1.0 - kShareOfGoal * p.of_records /
                                  std::max(1e-6, mean_errors(records.sums, records.errors, records.scale).total);
    p.round_seconds = seconds_of(stats, "glossy") * course.passes;
    return p;
}

void tell_forecast(Frame& frame, const Prospect& prospect)
{
    const auto seconds_to = [&](double error) { return prospect.seconds_to(error); };
    Forecast& forecast = frame.stats().forecast;
    for (const double error : kForecastErrors) forecast.points.push_back({error, seconds_to(error)});
    forecast.passes = frame.course.passes;
    forecast.goal_error = prospect.target;
    if (frame.deadline.is_set())
        forecast.goal_error = std::max(forecast.goal_error, error_within(seconds_to, budget_seconds(frame.asked)));
    forecast.goal_seconds = seconds_to(forecast.goal_error);
    if (frame.hooks.forecast) frame.hooks.forecast(forecast);
}

/// What the records of a budget are to reach; settles how often lobes are traced, since time goes where the error is.
RecordGoal goal_in_time(Frame& frame, const Prospect& p)
{
    Course& course = frame.course;
    const RecordForecast& records = p.records;
    const double looks = looks_after(course.passes, part_with_lobes(frame));
    const double pass_seconds = seconds_of(frame.stats(), "gbuffer") + seconds_of(frame.stats(), "direct") +
                                seconds_of(frame.stats(), "glossy");
    double left = frame.deadline.left() - (course.passes - 1) * pass_seconds;
    if (p.round_seconds > 0.0) {
        const double share = p.of_lobes / (p.of_lobes + p.of_records);
        const double for_light = std::max(0.0, left - looks * records.look_seconds);
        course.lobe_rounds = 1 + static_cast<int>(std::min(share * for_light / p.round_seconds, kMostLobeRounds * 1.0));
        left -= (course.lobe_rounds - 1) * p.round_seconds;
    }
    return {p.target, std::max(1e-3, left), looks, frame.stats().forecast.goal_error};
}

/// What the coarse records are made with, which error and time are forecast from.
/// @param looks  whether records also look at lit points: those come beside the strata that spacing needs
RecordSettings overture(RecordSettings settings, bool looks)
{
    settings.error_tolerance = 0.25f;
    settings.rays = looks ? 96 : 64;
    return settings;
}

}  // namespace

Deadline::Deadline(const Quality& quality) : budget_(0.0), start_(std::chrono::steady_clock::now())
{
    if (const Budget* budget = std::get_if<Budget>(&quality)) budget_ = budget->seconds;
}

double Deadline::elapsed() const
{
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
}

double Deadline::left() const { return budget_ - elapsed(); }

Course begin_course(const Settings& settings)
{
    return {.direct = settings.direct, .records = settings.records, .passes = settings.passes};
}

bool wants_pass(Course& course, const Deadline& deadline, int done, int most)
{
    if (deadline.is_set() && done > 0) {
        const double now = deadline.elapsed(), left = deadline.left();
        if (done > 1) course.pass_seconds = now - course.passes_ended;
        course.passes_ended = now;
        // One that would end too late by more than there is left is left out, one that fits is added.
        if (done < course.passes ? course.pass_seconds > 2.0 * left : course.pass_seconds > left)
            course.passes = done;
        else
            course.passes = std::min(std::max(course.passes, done + 1), most);
    }
    return done < course.passes;
}

DirectSettings affordable_direct(const Frame& frame)
{
    DirectSettings asked = frame.settings.direct;
    asked.gathered = &frame.gathered;
    if (!frame.deadline.is_set()) return asked;
    const auto seconds = [&](const DirectSettings& tried) {
        return try_direct_light(frame.rays, frame.gbuffer, frame.view(), frame.shading, tried, frame.session.pool());
    };
    const double room = kMostForDirect * frame.deadline.left();
    if (seconds(asked) * kWithPenumbras <= room) return asked;
    DirectSettings fewer = asked;
    for (fewer.lamp_picks = asked.area_samples;; fewer.lamp_picks /= 2) {
        fewer.area_samples = fewer.lamp_picks;
        if (fewer.lamp_picks == 1 || seconds(fewer) <= room) return fewer;
    }
}

void steer_records(Frame& frame, bool go_on)
{
    float done = 0.0f;
    const auto report = [&](float fraction) {
        done = std::max(done, std::min(0.99f, done + 0.1f * fraction));  // how many rounds there will be, nobody knows
        if (frame.hooks.progress && !frame.hooks.progress("records", done))
            throw Error(ErrorCode::cancelled, "cancelled while gathering records");
    };
    const Deadline& deadline = frame.deadline;
    RecordStats& stats = frame.stats().records;
    Placement placement({frame.rays, frame.light_cache, frame.guide.get(), &frame.gathered}, frame.gbuffer,
                        frame.view(), overture(frame.settings.records, frame.guide != nullptr), frame.session.pool(),
                        frame.records, stats, report);
    const double most = deadline.is_set() ? std::max(1e-3, kMostForOverture * deadline.left()) : 0.0;
    const auto set_goal = [&](const RecordForecast& cost) -> std::optional<RecordGoal> {
        const Prospect prospect = look_ahead(frame, cost);
        tell_forecast(frame, prospect);
        if (!go_on) return std::nullopt;
        return deadline.is_set() ? goal_in_time(frame, prospect) : RecordGoal{prospect.target};
    };
    frame.probes = place_to_goal(placement, frame.view(), frame.asked.overlap, {most, target_error(frame.asked)},
                                 frame.session.pool(), frame.records, stats, set_goal);
    frame.course.records = placement.options();
}

bool wants_more_lobes(const Frame& frame, int rounds)
{
    const TargetError* target = std::get_if<TargetError>(&frame.asked.quality);
    if (!target || frame.light.traced.radiance.empty() || rounds >= kMostLobeRounds) return false;
    // Every pass traces by itself.
    const double error =
        picture_error(frame, frame.light, 1.0f / std::sqrt(static_cast<float>(frame.course.passes)), frame.error_scale);
    return error > target->error && picture_error(frame, frame.light, 0.0f, frame.error_scale) < 0.98 * error;
}

void add_round(TracedLight& light, const TracedLight& more, int rounds)
{
    const float share = 1.0f / static_cast<float>(rounds + 1);
    for (std::size_t i = 0; i < light.radiance.size(); ++i) {
        light.radiance[i] = glm::mix(light.radiance[i], more.radiance[i], share);
        light.error[i] = std::hypot((1.0f - share) * light.error[i], share * more.error[i]);
    }
}

}  // namespace rcs
