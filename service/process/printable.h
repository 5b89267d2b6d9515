#pragma once

#include <string>
#include <string_view>

namespace rcs::service {

/// Length of what begins at `i` and steers a terminal or the direction of writing instead of being shown: control
/// characters of ASCII and Unicode, UTF-8. 0: none does. [bytes]
std::size_t control_length(std::string_view text, std::size_t i);

/// Text from elsewhere as a terminal may show it: '?' in place of each such character.
std::string printable(std::string_view text);

}  // namespace rcs::service
