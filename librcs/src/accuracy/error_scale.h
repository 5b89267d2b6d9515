#pragma once

#include <vector>

namespace rcs {

/// What probes have found of an error map, as functions of the error that it tells: it may be right on plain walls and
/// wrong in corners. All errors are mean absolute ones, relative to the light.
class ErrorScale {
public:
    /// A part of the probes, and its means.
    struct Part {
        double told = 0.0;     ///< by the map
        double found = 0.0;    ///< relative to what the splat says, as the map's
        double judged = 0.0;   ///< relative to the truth, as `compare` has it: in a crevice the truth may be next to 0
        double typical = 0.0;  ///< the same without the few that are much larger than all others
    };
    ErrorScale() = default;
    /// @param parts  from small errors to large ones, all > 0
    explicit ErrorScale(const std::vector<Part>& parts);

    /// What a map's error is to be multiplied by.
    double of_map(double told) const;
    /// An error relative to the picture, made relative to the truth: in the mean, and most of them.
    struct Judged {
        double mean, typical;
    };
    Judged judged(double found) const;

private:
    /// Of a part, for curves between them by logarithms, and beyond them as at the nearest.
    struct Point {
        double told, found;
        float log_told, log_found;
        float log_of_map, log_judged, log_typical;  ///< factors
    };
    std::vector<Point> points_;
};

}  // namespace rcs
