#include "report/converged.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "rcs/metrics.h"
#include "report/encoding.h"
#include "report/paths.h"

namespace rcs::service {
namespace {

ConvergedReference mean_of(const GrowingPaths& a, const GrowingPaths& b)
{
    ConvergedReference mean{a.image(), a.samples() + b.samples(), a.seconds() + b.seconds(), 0.0};
    merge_references(mean.image, b.image());
    // One half less the mean is half the difference of the halves.
    mean.error = compare_images(a.image(), mean.image, "indirect").mean_relative_error;
    return mean;
}

/// The share of all work that is done, when the error falls as the root of the samples; a round goes on from `done`.
ProgressFunction towards(const ProgressFunction& progress, const std::string& stage, double done, double round,
                         double all)
{
    return [&progress, stage, done, round, all](std::string_view, float fraction) {
        return progress(stage, static_cast<float>((done + round * static_cast<double>(fraction)) / all));
    };
}

}  // namespace

ConvergedReference converge(const RayScene& rays, const View& view, const ReferenceOptions& options,
                            const KeptHalves& kept, double wanted_error, ThreadPool& pool, const LogFunction& log,
                            const ProgressFunction& progress)
{
    ReferenceOptions second = options;
    ++second.seed;
    GrowingPaths a(kept.folder + "/reference-" + kept.key + "-a.exr", kept.key + "-a", view, options);
    GrowingPaths b(kept.folder + "/reference-" + kept.key + "-b.exr", kept.key + "-b", view, second);
    ConvergedReference reference;
    double all = 32.0 * kSmallestRound;  // a guess, until there is something to judge
    std::string stage = "reference";
    while (true) {
        if (a.samples() > 0 && a.samples() == b.samples()) {
            reference = mean_of(a, b);
            if (reference.error <= wanted_error || reference.paths >= options.samples) break;
            const double missing = std::pow(reference.error / wanted_error, 2.0);
            // It is judged after a round of both halves, no sooner.
            all = std::max(std::min<double>(options.samples, reference.paths * missing),
                           reference.paths + 2.0 * next_round(a.samples()));
            stage = "reference (its error ";
            stage.append(percent_text(reference.error))
                .append(", wanted ")
                .append(percent_text(wanted_error))
                .append(")");
        }
        GrowingPaths& behind = a.samples() <= b.samples() ? a : b;
        const int done = a.samples() + b.samples();
        const int round = next_round(behind.samples());
        behind.add_round(rays, pool, towards(progress, stage, done, round, std::max<double>(all, done + round)));
    }
    if (reference.error > wanted_error && log) {
        log(LogLevel::warning, "the reference took " + std::to_string(reference.paths) +
                                   " paths a pixel, the most allowed, and has an error of " +
                                   percent_text(reference.error) + ", not the " + percent_text(wanted_error) +
                                   " wanted");
    }
    return reference;
}

}  // namespace rcs::service
