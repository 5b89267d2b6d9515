#include "report/headline.h"

#include <algorithm>

#include "report/encoding.h"

namespace rcs::service {
namespace {

constexpr double kRoundErrors[] = {0.5, 0.3, 0.2, 0.15, 0.1, 0.07, 0.05, 0.03, 0.02, 0.015, 0.01, 0.005};
constexpr std::size_t kMostErrors = 3;

/// The round errors between the coarsest and the finest point; the finest ones if there are many.
std::vector<double> errors_reached(const std::vector<CostPoint>& renders)
{
    const auto by_error = [](const CostPoint& a, const CostPoint& b) { return a.error < b.error; };
    const auto [finest, coarsest] = std::minmax_element(renders.begin(), renders.end(), by_error);
    std::vector<double> errors;
    for (const double error : kRoundErrors) {
        if (error >= finest->error && error <= coarsest->error) errors.push_back(error);
    }
    if (errors.size() > kMostErrors) errors.erase(errors.begin(), errors.end() - kMostErrors);
    if (errors.empty()) errors.push_back(finest->error);
    return errors;
}

}  // namespace

std::optional<PathCost> path_seconds_for_error(const std::vector<CostPoint>& paths, double error)
{
    if (paths.empty() || !(error > 0.0)) return std::nullopt;
    if (const std::optional<double> seconds = seconds_for_error(paths, error)) return PathCost{*seconds, false};
    const CostPoint& last = paths[pareto_front(paths).back()];
    const double ratio = last.error / error;
    return PathCost{last.seconds * ratio * ratio, true};
}

std::string headline(const std::vector<CostPoint>& renders, const std::vector<CostPoint>& paths)
{
    if (renders.empty()) return "Nothing was rendered.";
    std::string sentence;
    const std::vector<double> errors = errors_reached(renders);
    for (const double error : errors) {
        const std::optional<double> seconds = seconds_for_error(renders, error);
        sentence.append(sentence.empty() ? "An error of " : "; ").append(percent_text(error)).append(" costs ");
        sentence += duration_text(seconds.value_or(0.0));
    }
    if (const std::optional<PathCost> cost = path_seconds_for_error(paths, errors.back())) {
        sentence.append("; the path tracer needs ").append(cost->extrapolated ? "about " : "");
        sentence.append(duration_text(cost->seconds)).append(" for ").append(percent_text(errors.back()));
    }
    return sentence + ".";
}

}  // namespace rcs::service
