#include "render/deadline.h"

namespace rcs {

Deadline::Deadline(const Quality& quality) : budget_(0.0), start_(std::chrono::steady_clock::now())
{
    if (const Budget* budget = std::get_if<Budget>(&quality)) budget_ = budget->seconds;
}

double Deadline::elapsed() const
{
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
}

double Deadline::left() const { return budget_ - elapsed(); }

}  // namespace rcs
