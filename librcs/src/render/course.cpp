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
// ... where views before have brought records to a goal.
constexpr double kMostBesideKnown = 0.7;
// ... and the first records, as far as they can be fewer.
constexpr double kMostForOverture = 0.4;
// A splat that lights glossy surfaces takes so many times as long as a look at the error: 2.1 to 2.9 in castle, sponza
// and sibenik, 1000x1000; more with smaller pictures.
constexpr double kSplatWithLobes = 3.4;
constexpr int kMostRounds = 64;
// A round that takes no more than this off the error is not worth it.
constexpr double kWorthARound = 0.98;
// Errors of lobes and records are in different pixels, for the most part: so much of one is added to the other.
constexpr double kLobesAdd = 0.8;

// What probes found of views before steers one as long as less of their records has changed: else it would be judged
// by other ones, found once it is done.
constexpr double kStillTrue = 0.15;
// Times what any error takes.
constexpr double kHardlyMore = 1.02;
// Of the goal: records that are placed before their views come are to be good enough for those between them as well.
constexpr double kAhead = 0.8;

constexpr double kForecastErrors[] = {0.2, 0.1, 0.05, 0.03, 0.02, 0.01};

double seconds_of(const RenderStats& stats, const char* stage)
{
    for (const auto& [name, seconds] : stats.stage_seconds)
        if (name == stage) return seconds;
    return 0.0;
}

/// What contacts that turn out noisy take yet, over what they took so far: rays of those of a few scenes [s].
double contact_seconds(const RenderStats& stats)
{
    constexpr double kMore = 2.0;
    return kMore * seconds_of(stats, "contacts");
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

/// The first view's picture, lit like this, as its errors are judged.
class JudgedPicture {
public:
    JudgedPicture(const Frame& frame, ShownLight light, const ErrorParts& left, const ErrorScale& scale)
        : pool_(frame.session.pool()), scale_(scale)
    {
        const PictureLayers layers = error_layers(light.layers);
        accumulate_pass(
            frame.gbuffer, frame.view(), frame.shading,
            {layers, light.direct, light.indirect, light.of_lamps, light.indirect_error, light.traced, left}, {},
            nullptr, picture_, pool_);
        finish_passes(1, picture_);
    }
    /// Mean relative errors.
    double image() const { return estimate_picture_error(picture_, scale_, pool_).mean_relative; }
    double indirect() const { return estimate_indirect_error(picture_, scale_, pool_).mean_relative; }

private:
    ThreadPool& pool_;
    const ErrorScale& scale_;
    LayeredImage picture_;
};

/// Rounds that bring the error of one down to what records leave room for.
double rounds_to(double error, double room)
{
    const double too_much = kLobesAdd * error / room;
    return std::clamp(std::ceil(too_much * too_much), 1.0, kMostRounds * 1.0);
}

/// What the coarse records and one round of lobes say of the picture that will be, and what the stages took.
struct Prospect {
    double target = 0.0;                      ///< 0: none
    double before = 0.0;                      ///< spent already [s]
    double rest = 0.0;                        ///< what follows the first view's records takes [s]
    double round_seconds = 0.0;               ///< one more round of traced lobes in every pass
    double direct_seconds = 0.0;              ///< the same of direct light
    double of_lobes = 0.0, of_records = 0.0;  ///< errors of indirect light
    double of_direct = 0.0;                   ///< error of the picture, where that is aimed at
    double left_by_records = 0.0;             ///< of an error that is aimed at
    double records_by = 1.0;  ///< times that, what records come down to: less where they make more of the picture's
    const RecordForecast& records;

    /// Wall time of render() for a mean relative error [s].
    double seconds_to(double error) const
    {
        const double room = std::max(1.0 - kShareOfGoal, left_by_records) * error;
        return before + rest + records.seconds_to(records_by * error) +
               (rounds_to(of_lobes, room) - 1.0) * round_seconds + (rounds_to(of_direct, room) - 1.0) * direct_seconds;
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
        return looks_after(passes, lobes) * records.look_seconds + (passes - 1) * pass_seconds + contact_seconds(stats);
    };
    const auto passes_cost = [&] { return rest_of(course.passes) - rest_of(1); };
    while (budget > 0.0 && course.passes > 1 && passes_cost() > kMostForPasses * (budget - p.before - rest_of(1)))
        --course.passes;
    p.rest = rest_of(course.passes);
    course.pass_seconds = rest_of(2) - rest_of(1);

    const PassLight& others = frame.light;
    const ShownLight light{*others.layers, others.direct, records.sums, others.of_lamps, records.errors, others.traced};
    const ErrorScale unscaled;
    // Every pass samples lobes and lamps by itself.
    const double by_passes = 1.0 / std::sqrt(static_cast<double>(course.passes));
    if (!others.traced.radiance.empty())
        p.of_lobes = by_passes * JudgedPicture(frame, light, {.direct = 0.0f, .records = 0.0f}, unscaled).indirect();
    if (aims_at_picture(frame.asked))
        p.of_direct = by_passes * JudgedPicture(frame, light, {.lobes = 0.0f, .records = 0.0f}, unscaled).image();
    const JudgedPicture by_records(frame, light, {.lobes = 0.0f, .direct = 0.0f}, records.scale);
    p.of_records = std::max(1e-6, by_records.indirect());
    // Records leave room for the lobes: they stop short of the goal, and are not all of the light.
    const double told =
        std::max(1e-6, mean_errors(records.sums, records.errors, records.scale, frame.session.pool()).total);
    p.left_by_records = 1.0 - kShareOfGoal * p.of_records / told;
    if (aims_at_picture(frame.asked)) p.records_by = std::min(1.0, told / std::max(1e-6, by_records.image()));
    p.round_seconds = seconds_of(stats, "glossy") * course.passes;
    p.direct_seconds = seconds_of(stats, "direct") * course.passes;
    return p;
}

void tell_forecast(Frame& frame, const Prospect& prospect)
{
    const auto seconds_to = [&](double error) { return prospect.seconds_to(error); };
    Forecast& forecast = frame.stats().forecast;
    for (const double error : kForecastErrors) forecast.points.push_back({error, seconds_to(error)});
    forecast.settled_error = error_within(seconds_to, kHardlyMore * seconds_to(1.0));
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
    double left = frame.deadline.left() - (course.passes - 1) * pass_seconds - contact_seconds(frame.stats());
    if (p.round_seconds > 0.0) {
        const double share = p.of_lobes / (p.of_lobes + p.of_records);
        const double for_light = std::max(0.0, left - looks * records.look_seconds);
        course.rounds.lobes = 1 + static_cast<int>(std::min(share * for_light / p.round_seconds, kMostRounds * 1.0));
        left -= (course.rounds.lobes - 1) * p.round_seconds;
    }
    return {p.target, std::max(1e-3, left), looks, frame.stats().forecast.goal_error};
}

}  // namespace

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
    const double part = frame.session.state().noise.reached ? kMostBesideKnown : kMostForDirect;
    const double room = part * frame.deadline.left();
    if (seconds(asked) * kWithPenumbras <= room) return asked;
    DirectSettings fewer = asked;
    for (fewer.lamp_picks = asked.area_samples;; fewer.lamp_picks /= 2) {
        fewer.area_samples = fewer.lamp_picks;
        if (fewer.lamp_picks == 1 || seconds(fewer) <= room) return fewer;
    }
}

RecordSettings first_records(const Frame& frame)
{
    RecordSettings settings = frame.settings.records;
    if (!has_goal(frame.asked)) return settings;
    settings.error_tolerance = 0.25f;
    // Looks at lit points come beside the strata that spacing needs.
    settings.rays = frame.guide() ? 96 : 64;
    // What is gathered again where the scene has changed takes its place among those that are there.
    settings.noise_target = frame.session.state().noise.reached.value_or(settings.noise_target);
    return settings;
}

namespace {

using SetGoal = std::function<std::optional<RecordGoal>(const RecordForecast&)>;

/// @param seconds  that the coarse records may take; 0: as many as it takes
Steered steer(Frame& frame, double seconds, const SetGoal& set_goal)
{
    float done = 0.0f;
    const auto report = [&](float fraction) {
        done = std::max(done, std::min(0.99f, done + 0.1f * fraction));  // how many rounds there will be, nobody knows
        if (frame.hooks.progress && !frame.hooks.progress("records", done))
            throw Error(ErrorCode::cancelled, "cancelled while gathering records");
    };
    RecordStats& stats = frame.stats().records;
    Placement placement(frame.lit(), frame.gbuffer, frame.view(), first_records(frame), frame.session.pool(),
                        frame.records, stats, report);
    const auto tell = [&](const RecordLook& look) { tell_step(frame, look); };
    Session::State& session = frame.session.state();
    Overture overture{seconds, target_error(frame.asked)};
    if (const auto& kept = session.error_scale; kept && kept->others < kStillTrue && session.noise.reached)
        overture.known = {kept->scale, *session.noise.reached, session.noise.seconds_per_ray};
    bool is_steered = false;
    const auto goal_of = [&](const RecordForecast& cost) {
        std::optional<RecordGoal> goal = set_goal(cost);
        is_steered = goal.has_value();
        return goal;
    };
    Steered steered = place_to_goal(placement, frame.view(), frame.asked.overlap, overture, frame.session.pool(),
                                    frame.records, stats, {goal_of, tell});
    frame.course.records = placement.options();
    if (is_steered && session.options.keep_records) {
        session.noise.reached = frame.course.records.noise_target;
        session.noise.seconds_per_ray = steered.seconds_per_ray;
    }
    return steered;
}

}  // namespace

void steer_records(Frame& frame, bool go_on)
{
    const Deadline& deadline = frame.deadline;
    const double most = deadline.is_set() ? std::max(1e-3, kMostForOverture * deadline.left()) : 0.0;
    Steered steered = steer(frame, most, [&](const RecordForecast& cost) -> std::optional<RecordGoal> {
        const Prospect prospect = look_ahead(frame, cost);
        tell_forecast(frame, prospect);
        if (!go_on) return std::nullopt;
        return deadline.is_set() ? goal_in_time(frame, prospect) : RecordGoal{prospect.records_by * prospect.target};
    });
    frame.probes = std::move(steered.probes);
}

void steer_records_ahead(Frame& frame)
{
    const Deadline& deadline = frame.deadline;
    const double most = deadline.is_set() ? std::max(1e-3, kMostForOverture * deadline.left()) : 0.0;
    const Steered steered = steer(frame, most, [&](const RecordForecast& cost) {
        if (!deadline.is_set()) return std::optional(RecordGoal{kAhead * target_error(frame.asked)});
        const double left = std::max(1e-3, deadline.left());
        return std::optional(RecordGoal{0.0, left, 1.0, error_within(cost.seconds_to, left), true});
    });
    frame.stats().forecast.settled_error = steered.error;
    if (steered.probes) frame.session.state().keep_error_scale(steered.scale);
}

Rounds next_round(const Frame& frame, const Rounds& done)
{
    const bool has_lobes = frame.needs(Effect::traced_lobes), has_lamps = frame.settings.has_lamps;
    const Rounds lobes{done.lobes + 1, done.direct}, direct{done.lobes, done.direct + 1};
    if (has_lobes && done.lobes < frame.course.rounds.lobes) return lobes;
    if (has_lamps && done.direct < frame.course.rounds.direct) return direct;
    const double target = target_error(frame.asked);
    if (!frame.is_first_view() || target == 0.0) return done;
    // Every pass samples by itself.
    const float by_passes = 1.0f / std::sqrt(static_cast<float>(frame.course.passes));
    const auto with = [&](const ErrorParts& left) {
        return JudgedPicture(frame, shown(frame.light), left, frame.error_scale);
    };
    const auto without_lobes = [&] { return with({.lobes = 0.0f, .direct = by_passes}); };
    const JudgedPicture now = with({by_passes, by_passes});
    const bool more_lobes = has_lobes && done.lobes < kMostRounds, more_direct = has_lamps && done.direct < kMostRounds;
    const double indirect = now.indirect();
    if (indirect > target && more_lobes && without_lobes().indirect() < kWorthARound * indirect) return lobes;
    if (!aims_at_picture(frame.asked)) return done;
    const double image = now.image();
    if (image <= target) return done;
    const double by_lobes = more_lobes ? without_lobes().image() : image;
    const double by_direct = more_direct ? with({.lobes = by_passes, .direct = 0.0f}).image() : image;
    if (std::min(by_lobes, by_direct) >= kWorthARound * image) return done;
    return by_lobes < by_direct ? lobes : direct;
}

void add_round(DirectLightResult& light, const DirectLightResult& more, int rounds)
{
    const float share = 1.0f / static_cast<float>(rounds + 1);
    const auto average = [&](std::vector<glm::vec3>& sum, const std::vector<glm::vec3>& next) {
        for (std::size_t i = 0; i < sum.size(); ++i) sum[i] = glm::mix(sum[i], next[i], share);
    };
    // Of a round in which all that was sampled twice agreed there are none.
    const auto average_errors = [&](std::vector<float>& sum, const std::vector<float>& next) {
        if (sum.empty()) sum.assign(next.size(), 0.0f);
        for (std::size_t i = 0; i < sum.size(); ++i)
            sum[i] = std::hypot((1.0f - share) * sum[i], next.empty() ? 0.0f : share * next[i]);
    };
    // As each pixel found it: they put together what all rounds found.
    const bool is_apart = !light.apart.irradiance.empty(), is_more_apart = !more.apart.irradiance.empty();
    average(is_apart ? light.apart.irradiance : light.irradiance,
            is_more_apart ? more.apart.irradiance : more.irradiance);
    average(light.glossy, more.glossy);
    for (std::size_t i = 0; i < light.in_part.size(); ++i)
        light.in_part[i] = static_cast<std::uint8_t>(light.in_part[i] | more.in_part[i]);
    for (std::size_t k = 0; k < light.again.size(); ++k)
        for (std::size_t n = 0; n < 2; ++n) {
            light.again[k].irradiance[n] = glm::mix(light.again[k].irradiance[n], more.again[k].irradiance[n], share);
            light.again[k].glossy[n] = glm::mix(light.again[k].glossy[n], more.again[k].glossy[n], share);
        }
    average_errors(is_apart ? light.apart.error : light.irradiance_error,
                   is_more_apart ? more.apart.error : more.irradiance_error);
    average_errors(light.glossy_error, more.glossy_error);
}

}  // namespace rcs
