#pragma once

#include <algorithm>
#include <string>

namespace rcs {

/// A library's message as part of one of ours: several lines become one sentence.
inline std::string one_line(std::string text)
{
    text.erase(text.find_last_not_of(" \n\r\t") + 1);
    std::replace(text.begin(), text.end(), '\n', ' ');
    return text.empty() ? "no reason given" : text;
}

}  // namespace rcs
