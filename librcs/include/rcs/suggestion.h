#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "rcs/api.h"

namespace rcs {

/// The one of `names` that a mistyped word is likely to mean: a few letters are wrong, missing or swapped, or it is a
/// part of the name. Upper and lower case are one. "": none is near. The first of those that are equally near.
RCS_API std::string closest_name(std::string_view word, const std::vector<std::string>& names);

/// "; did you mean 'walk'?", or "" where no name is near.
RCS_API std::string did_you_mean(std::string_view word, const std::vector<std::string>& names);

}  // namespace rcs
