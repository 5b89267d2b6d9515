#pragma once

#include <map>
#include <string>
#include <string_view>

#include "rcs/image.h"

namespace rcs::service {

std::string base64(std::string_view bytes);  ///< RFC 4648, with padding
std::string html_escape(std::string_view text);
std::string csv_field(std::string_view text);  ///< RFC 4180: quoted where it has to be

/// {{name}} in the template becomes the text of that name.
std::string fill_page(const std::string& page, const std::map<std::string, std::string>& texts);
/// JSON that may stand in a <script>: "</script>" in a name would end the element, so that no "<" is left in it.
std::string script_text(std::string json);

/// The picture as a JPEG file in memory.
std::string jpeg_bytes(const Image& display);

/// 0.064 as "6.4 %", with two digits that count.
std::string percent_text(double fraction);
/// [s] as "40 ms", "1.2 s", "20 min", "1.5 h", "4 days"; two digits that count.
std::string duration_text(double seconds);

}  // namespace rcs::service
