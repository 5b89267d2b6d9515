#pragma once

#include <string>

namespace rcs {

/// As std::printf() writes it; at most 255 characters.
__attribute__((format(printf, 1, 2))) std::string text(const char* format, ...);

}  // namespace rcs
