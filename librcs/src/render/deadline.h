#pragma once

#include <chrono>

#include "rcs/render_options.h"

namespace rcs {

/// When a render began, and how much of its budget is left.
class Deadline {
public:
    explicit Deadline(const Quality& quality);

    bool is_set() const { return budget_ > 0.0; }
    double elapsed() const;  ///< [s]
    double left() const;     ///< [s]; only with a budget

private:
    double budget_;
    std::chrono::steady_clock::time_point start_;
};

}  // namespace rcs
