#include "rcs/record_file.h"

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string_view>
#include <system_error>

#include "rcs/error.h"
#include "rcs/fingerprint.h"
#include "records/record_bytes.h"
#include "util/file_writer.h"

namespace rcs {
namespace {

constexpr std::size_t kChecksum = 16;  // digits of a fingerprint

std::string checksum(std::string_view bytes)
{
    Fingerprint print;
    print.add(bytes);
    return print.text();
}

/// As few digits as tell a value from all others.
template <typename Number>
std::string text(Number value)
{
    char digits[32];
    return {digits, std::to_chars(digits, digits + sizeof digits, value).ptr};
}

std::string names_of(const EffectSet& effects)
{
    std::string names;
    for (std::size_t i = 0; i < kEffects; ++i)
        if (effects.has(static_cast<Effect>(i)))
            names.append(names.empty() ? " " : ",").append(name_of(static_cast<Effect>(i)));
    return names;
}

std::string read_file(const std::string& path)
{
    std::error_code ignored;
    if (!std::filesystem::exists(path, ignored))
        throw Error(ErrorCode::not_found, "record file " + path + " does not exist");
    if (!std::filesystem::is_regular_file(path, ignored))
        throw Error(ErrorCode::io, "cannot read record file " + path + ": it is not a regular file");
    std::ifstream file(path, std::ios::binary);
    std::string bytes{std::istreambuf_iterator<char>(file), {}};
    if (!file.good() && !file.eof()) throw Error(ErrorCode::io, "cannot read record file " + path);
    return bytes;
}

}  // namespace

RecordKey record_key(const Scene& scene, const RenderOptions& options)
{
    Fingerprint print;
    add(print, scene);
    const QualitySettings r = settings_or_default(options);
    const std::string aim =
        target_error(options) > 0.0
            ? "target error " + text(target_error(options)) + ", overlap " + text(options.overlap)
            : "accuracy " + text(r.error_tolerance) + ", rays " + text(r.rays) + ", noise " + text(r.noise_target);
    RecordKey key{print.text(), "bounces " + text(options.bounces) + ", " + aim + ", reach " + text(options.min_reach) +
                                    " to " + text(options.max_reach) + " px, gradient limit " +
                                    text(options.gradient_limit)};
    if (const std::string with = names_of(options.effects.with); !with.empty()) key.settings += ", with" + with;
    if (const std::string without = names_of(options.effects.without); !without.empty())
        key.settings += ", without" + without;
    return key;
}

void check_record_path(const std::string& path)
{
    const FileWriter probe(path);  // the surest test of a folder is to make a file in it
}

void write_records(const std::string& path, const RecordKey& key, const std::vector<Record>& records)
{
    std::vector<Record> sound;  // light beyond what floats hold leaves others
    std::copy_if(records.begin(), records.end(), std::back_inserter(sound),
                 [](const Record& r) { return defect_of(r).empty(); });
    std::string bytes = to_bytes(key, sound);
    bytes += checksum(bytes);
    FileWriter writer(path);
    std::fwrite(bytes.data(), 1, bytes.size(), writer.file());  // commit() knows whether all of it was
    writer.commit();
}

std::vector<Record> read_records(const std::string& path, const RecordKey& key)
{
    const std::string bytes = read_file(path);
    const std::string_view all = bytes;
    const std::string_view body = all.substr(0, all.size() - std::min(all.size(), kChecksum));
    KeyedRecords file = parse_records(body, path);
    if (all.substr(body.size()) != checksum(body))
        throw Error(ErrorCode::bad_file, "record file " + path + " is damaged: its checksum is wrong");
    if (file.key.scene != key.scene)
        throw Error(ErrorCode::bad_file,
                    "record file " + path + " belongs to another scene, pose or sky; name another file, or remove it");
    if (file.key.settings != key.settings)
        throw Error(ErrorCode::bad_file, "record file " + path + " was made with " + file.key.settings + ", not with " +
                                             key.settings + "; name another file, or remove it");
    return std::move(file.records);
}

}  // namespace rcs
