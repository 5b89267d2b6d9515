#include "batch/frames.h"

#include <algorithm>
#include <cstdlib>
#include <regex>
#include <set>

#include "rcs/error.h"

namespace rcs::service {
namespace {

constexpr std::size_t kMostFrames = 10'000;  // of a job

/// Where a frame's number stands in a path, and how many digits it has at least.
struct NumberPlace {
    std::size_t begin = 0, end = 0;  ///< the same: there is none
    std::size_t digits = 0;
};

NumberPlace find_place(const std::string& path)
{
    static const std::regex place(R"(#+|%(?:0(\d))?d)");
    NumberPlace found;
    for (std::sregex_iterator i(path.begin(), path.end(), place), none; i != none; ++i) {
        found.begin = static_cast<std::size_t>(i->position());
        found.end = found.begin + static_cast<std::size_t>(i->length());
        const bool printf = path[found.begin] == '%';
        found.digits = printf ? ((*i)[1].matched ? std::stoul((*i)[1]) : 1) : found.end - found.begin;
    }
    return found;
}

}  // namespace

std::vector<int> parse_frames(const std::string& text)
{
    static const std::regex part(R"(^(-?\d{1,7})(?:(?:-|\.\.)(-?\d{1,7})(?:[x:](\d{1,7}))?)?$)");
    const auto refuse = [&](const std::string& why) {
        throw Error(ErrorCode::bad_argument, "--frames " + text + " " + why);
    };
    std::set<int> frames;
    for (std::size_t begin = 0; begin <= text.size();) {
        const std::size_t end = std::min(text.find(',', begin), text.size());
        std::smatch found;
        const std::string one = text.substr(begin, end - begin);
        if (!std::regex_match(one, found, part)) refuse("is no list of frames such as 1-100x2,150");
        const int first = std::stoi(found[1]);
        const int last = found[2].matched ? std::stoi(found[2]) : first;
        const int step = found[3].matched ? std::stoi(found[3]) : 1;
        if (last < first || step < 1) refuse("has a range that runs backwards, or a step of 0");
        for (int i = first; i <= last; i += step) {
            if (!frames.insert(i).second) refuse("has frame " + std::to_string(i) + " twice");
            if (frames.size() > kMostFrames) refuse("has more than 10000 frames");
        }
        begin = end + 1;
    }
    return {frames.begin(), frames.end()};
}

bool has_frame_pattern(const std::string& path)
{
    const NumberPlace place = find_place(path);
    return place.begin != place.end;
}

std::string path_of_frame(const std::string& pattern, int number)
{
    const NumberPlace place = find_place(pattern);
    if (place.begin == place.end) return pattern;
    std::string digits = std::to_string(std::abs(number));
    digits.insert(0, place.digits > digits.size() ? place.digits - digits.size() : 0, '0');
    return pattern.substr(0, place.begin) + (number < 0 ? "-" : "") + digits + pattern.substr(place.end);
}

}  // namespace rcs::service
