#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace rcs::service {

/// What a frame's pictures follow from: names, and what each was, as texts.
using Dependencies = std::vector<std::pair<std::string, std::string>>;

/// What a frame cost, and how good it is.
struct FrameFigures {
    double seconds = 0.0, cpu_seconds = 0.0;  ///< from its scene to its files; all threads
    double error = 0.0;                       ///< mean relative error of the picture, estimated
    double indirect_error = 0.0;              ///< of its indirect light
    std::uint64_t records_made = 0, records_reused = 0;
    std::uint64_t rays = 0;
    std::optional<double> flicker;  ///< to the frame before; none: nothing says what moved
    double exposure = 0.0;          ///< of display values [EV]
    int tries = 1;
    std::vector<std::string> warnings;
    std::string thumbnail;  ///< a small JPEG file in base64
};

/// A file of a frame that is done.
struct FrameFile {
    std::string name;  ///< within the folder of the frame's first file
    std::uint64_t bytes = 0;
    std::string kept;       ///< what of the picture, and how it is stored
    std::string hash = {};  ///< of its bytes; empty: not known
    bool operator==(const FrameFile&) const = default;
};

/// What is known of a frame that is done: kept in `.rcsplat/NAME.json` beside the frame's first file, so that the
/// next run of a batch can tell whether it still holds.
struct FrameRecord {
    int number = 0;
    std::string source;  ///< hash of what scene and camera are made from: files, time, choices
    Dependencies depends;
    std::vector<FrameFile> files;
    FrameFigures figures;
};

/// @param first_file  of the frame
std::string record_path(const std::string& first_file);
/// None: there is none that can be read, so that the frame has to be made.
std::optional<FrameRecord> read_frame_record(const std::string& path);
/// Appears under its name only when complete. @throws rcs::Error io
void write_frame_record(const std::string& path, const FrameRecord& record);

/// Of a file's bytes, as text. @throws rcs::Error io
std::string file_hash(const std::string& path);

/// What differs, in words: "rays was 128, is 64"; "" if nothing does.
std::string difference(const Dependencies& was, const Dependencies& is);
/// What is wrong with the files of a frame that is done: "beauty.0007.exr is missing"; "" if they are those that it
/// left. @param wanted  their names and what of the picture each keeps
std::string missing_file(const FrameRecord& record, const std::vector<FrameFile>& wanted, const std::string& folder);

nlohmann::ordered_json to_json(const FrameFigures& figures);

}  // namespace rcs::service
