#pragma once

#include <vector>

namespace rcs {

/// A pixel whose light was sampled twice more, by luminances.
struct FilterCheck {
    double sampled = 0.0;   ///< what the picture has sampled
    double filtered = 0.0;  ///< what the filter makes of that
    double again[2] = {};   ///< by samples that neither of the two knows
    double error = 0.0;     ///< that the sampled light is said to have, a standard error
    double light = 0.0;     ///< > 0, that errors are relative to
};

/// How filtered and sampled light are mixed for the least error, by how noisy a pixel is, and what is left of its
/// error. Of an error's square, (x - a)(x - b) with independent a, b is right in the mean, whatever x is.
class FilterMixture {
public:
    explicit FilterMixture(std::vector<FilterCheck> checks);

    /// Part of the filtered light at a pixel with such an error, relative to its light. 0: the sampled one stays.
    double filtered(double relative_error) const { return read(relative_error, &Class::filtered); }
    /// What error is left then, relative to the light.
    double left(double relative_error) const { return read(relative_error, &Class::left); }

    /// Root mean squares of the checks' relative errors, of sampled light and of the mixture.
    double error_before() const { return error_before_; }
    double error_after() const { return error_after_; }

private:
    /// Pixels that are about as noisy.
    struct Class {
        double log_error = 0.0, filtered = 0.0, left = 0.0;
        double before = 0.0, after = 0.0;  ///< squared errors
    };
    static Class judge(const FilterCheck* begin, const FilterCheck* end);
    double read(double relative_error, double Class::* value) const;

    std::vector<Class> classes_;  ///< from small errors to large ones
    double error_before_ = 0.0, error_after_ = 0.0;
};

}  // namespace rcs
