#pragma once

#include <string>
#include <vector>

#include "rcs/api.h"
#include "rcs/records.h"
#include "rcs/render_options.h"
#include "rcs/scene.h"

namespace rcs {

/// What the records of a file were gathered for. They serve no other scene, no other light and no other accuracy, but
/// any view and any seed.
struct RecordKey {
    std::string scene;     ///< fingerprint of the scene with its sky
    std::string settings;  ///< what else records depend on, in words: bounces, accuracy or target, effects
    /// Whether records of one serve the other.
    bool operator==(const RecordKey&) const = default;
};
/// The settings alone. @return "bounces 1, accuracy 0.2, rays 128, ..."
RCS_API std::string record_settings_words(const RenderOptions& options);
/// That of records which render() gathers in this scene with these options.
RCS_API RecordKey record_key(const Scene& scene, const RenderOptions& options);

/// Saves records for render() to start from. The same view again needs none, or a few where it has more than one sample
/// a pixel or surfaces one sees through; another view only those for what it sees beyond. The same records are the same
/// bytes on every machine; the file appears under its name only when complete. Records that floats cannot hold, as
/// under light of 1e36, are left out.
/// @throws Error io, naming the file
RCS_API void write_records(const std::string& path, const RecordKey& key, const std::vector<Record>& records);

/// Whether write_records() could write there. @throws Error io that names the file
RCS_API void check_record_path(const std::string& path);

/// What write_records() saved, bit for bit. Of what a record watches it is where it was born; begin_watching() tells a
/// session the rest.
/// @throws Error that names the file. not_found; io; unsupported: written by another version; bad_file: no record file,
/// a
///     damaged one, or one of another key
RCS_API std::vector<Record> read_records(const std::string& path, const RecordKey& key);

}  // namespace rcs
