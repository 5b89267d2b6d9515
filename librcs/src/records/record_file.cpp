#include "rcs/record_file.h"

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string_view>
#include <system_error>

#include "rcs/error.h"
#include "rcs/fingerprint.h"
#include "rcs/option_table.h"
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

std::string read_file(const std::string& path)
{
    std::error_code ignored;
    if (!std::filesystem::exists(path, ignored))
        throw Error(ErrorCode::not_found, "record file '" + path + "' does not exist");
    if (!std::filesystem::is_regular_file(path, ignored))
        throw Error(ErrorCode::io, "cannot read record file '" + path + "': it is not a regular file");
    std::ifstream file(path, std::ios::binary);
    std::string bytes{std::istreambuf_iterator<char>(file), {}};
    if (!file.good() && !file.eof()) throw Error(ErrorCode::io, "cannot read record file '" + path + "'");
    return bytes;
}

}  // namespace

std::string record_settings_words(const RenderOptions& options)
{
    std::string words;
    for (const OptionInfo& option : option_table()) {
        const bool counts =
            option.records == RecordUse::bound || (option.records == RecordUse::by_goal && has_goal(options));
        const std::string value = counts ? text_of(option, options) : "";
        if (value.empty()) continue;
        words.append(words.empty() ? "" : ", ").append(option.name.substr(2)).append(" ").append(value);
    }
    return words;
}

RecordKey record_key(const Scene& scene, const RenderOptions& options)
{
    Fingerprint print;
    add(print, scene);
    return {print.text(), record_settings_words(options)};
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
