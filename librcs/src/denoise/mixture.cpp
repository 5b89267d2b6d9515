#include "denoise/mixture.h"

#include <algorithm>
#include <cmath>

namespace rcs {
namespace {

// So many checks tell of a class; and there are no more classes than that.
constexpr std::size_t kChecks = 192;
constexpr std::size_t kMostClasses = 8;
// Fewer checks tell of nothing.
constexpr std::size_t kLeastChecks = 32;

/// A mean, and how sure it is.
class Mean {
public:
    void add(double value) { ++count_, sum_ += value, squares_ += value * value; }
    double mean() const { return sum_ / count_; }
    double standard_error() const { return std::sqrt(std::max(0.0, squares_ / count_ - mean() * mean()) / count_); }

private:
    double count_ = 0.0, sum_ = 0.0, squares_ = 0.0;
};

double relative_error(const FilterCheck& c) { return c.error / c.light; }

}  // namespace

FilterMixture::FilterMixture(std::vector<FilterCheck> checks)
{
    if (checks.size() < kLeastChecks) return;
    std::stable_sort(checks.begin(), checks.end(),
                     [](const FilterCheck& a, const FilterCheck& b) { return relative_error(a) < relative_error(b); });
    const std::size_t count = std::clamp<std::size_t>(checks.size() / kChecks, 1, kMostClasses);
    for (std::size_t k = 0; k < count; ++k)
        classes_.push_back(
            judge(checks.data() + k * checks.size() / count, checks.data() + (k + 1) * checks.size() / count));
    double before = 0.0, after = 0.0;
    for (const Class& c : classes_) before += c.before, after += c.after;
    error_before_ = std::sqrt(std::max(0.0, before / static_cast<double>(count)));
    error_after_ = std::sqrt(std::max(0.0, after / static_cast<double>(count)));
}

FilterMixture::Class FilterMixture::judge(const FilterCheck* begin, const FilterCheck* end)
{
    const FilterCheck& middle = begin[(end - begin) / 2];
    Class found{.log_error = std::log(std::max(1e-12, relative_error(middle)))};
    // The least squares of what is mixed, held against the other samples.
    double along = 0.0, squares = 0.0;
    for (const FilterCheck* c = begin; c != end; ++c) {
        const double way = (c->filtered - c->sampled) / c->light;
        along += way * (0.5 * (c->again[0] + c->again[1]) - c->sampled) / c->light;
        squares += way * way;
    }
    const double mixed = squares > 0.0 ? std::clamp(along / squares, 0.0, 1.0) : 0.0;
    Mean told, before, gain, left;
    for (const FilterCheck* c = begin; c != end; ++c) {
        const auto square = [&](double light) {
            return (light - c->again[0]) * (light - c->again[1]) / (c->light * c->light);
        };
        const double after = square(std::lerp(c->sampled, c->filtered, mixed));
        left.add(after);
        before.add(square(c->sampled));
        gain.add(square(c->sampled) - after);
        told.add(relative_error(*c) * relative_error(*c));
    }
    // Where it is not sure that it helps, nothing is done.
    found.before = found.after = before.mean();
    found.left = std::sqrt(told.mean());
    const double after = std::max(left.mean(), left.standard_error());
    if (!(gain.mean() > gain.standard_error()) || !(after < before.mean())) return found;
    found.filtered = mixed;
    found.after = after;
    found.left = std::sqrt(found.after);
    return found;
}

double FilterMixture::read(double relative_error, double Class::* value) const
{
    if (classes_.empty()) return 0.0;
    const double log_error = std::log(std::max(1e-12, relative_error));
    const auto above =
        std::find_if(classes_.begin(), classes_.end(), [&](const Class& c) { return c.log_error > log_error; });
    if (above == classes_.begin()) return classes_.front().*value;
    if (above == classes_.end()) return classes_.back().*value;
    const Class &low = *(above - 1), &high = *above;
    return std::lerp(low.*value, high.*value, (log_error - low.log_error) / (high.log_error - low.log_error));
}

}  // namespace rcs
