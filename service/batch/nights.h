#pragma once

#include <cstdint>
#include <string>
#include <vector>

/// Outputs that each night of a batch has for itself: "{night}" in a path becomes its date.
namespace rcs::service {

/// The date of a night, which lasts from noon to noon: "2026-11-24" also at six in the morning after, where we are.
/// @param wall_ms  Unix time [ms]
std::string night_of(std::int64_t wall_ms);

bool has_night(const std::string& text);
std::string at_night(std::string text, const std::string& night);

/// Nights that an output has folders or files of, by ascending date.
std::vector<std::string> nights_of(const std::string& output);

/// Where a batch puts its files: paths with "{night}", as they were given.
struct NightlyFiles {
    std::vector<std::string> outputs;  ///< with places for frames' numbers
    std::string report_folder;
};

/// What became of a night whose time was over.
struct OldNight {
    std::string night;
    std::size_t files = 0;          ///< that were removed
    std::uint64_t bytes = 0;        ///< of those
    std::vector<std::string> left;  ///< files of it that are not as the batch left them
};
/// "the night 2026-11-10: 48 files of 12.3 MB removed; ...". @param really  as remove_night() was told
std::string to_text(const OldNight& old, bool really);

/// Removes what the batch wrote that night: regular files, at places that these outputs have that night, whose size and
/// content are what is known of a frame or report. All else stays, and so do folders that are not empty then.
/// @param really  else only says so
OldNight remove_night(const NightlyFiles& batch, const std::string& night, bool really);

}  // namespace rcs::service
