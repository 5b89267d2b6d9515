#pragma once

#include <string>
#include <vector>

/// Frames of an animation: lists of their numbers, and names of files that hold a frame each.
namespace rcs::service {

/// Numbers by ascending order. A list is parts with commas between; a part is a number, or FIRST-LAST with xSTEP after
/// it if not every one is meant: "1-10x2,20", "-5--1". For "-" also "..", for "x" also ":". LAST need not be met by the
/// steps. No number twice. @throws rcs::Error bad_argument
std::vector<int> parse_frames(const std::string& text);

/// Whether a path holds a place for a frame's number: hashes, as many as it has digits, or %d and %04d as printf takes
/// them.
bool has_frame_pattern(const std::string& path);

/// "beauty.####.exr" or "beauty.%04d.exr" as "beauty.0012.exr"; the last such place counts. A number of more digits
/// takes them all, a minus is none of the digits.
std::string path_of_frame(const std::string& pattern, int number);

}  // namespace rcs::service
