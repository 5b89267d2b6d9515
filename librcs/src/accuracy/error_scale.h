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
    double of_map(double told) const { return of_map_.at(told); }
    /// An error relative to the picture, made relative to the truth: in the mean, and most of them.
    double judged(double found) const { return found * judged_.at(found); }
    double typical(double found) const { return found * typical_.at(found); }

private:
    /// A factor by an error: between the parts by logarithms, beyond them as at the nearest. Without parts it is 1.
    class Curve {
    public:
        void add(double at, double factor);
        double at(double error) const;

    private:
        struct Point {
            double at, log_at, factor, log_factor;
        };
        std::vector<Point> points_;
    };
    Curve of_map_, judged_, typical_;
};

}  // namespace rcs
