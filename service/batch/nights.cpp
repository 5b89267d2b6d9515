#include "batch/nights.h"

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <map>
#include <set>
#include <string_view>

#include "batch/frame_record.h"
#include "batch/frames.h"
#include "batch/report.h"

namespace rcs::service {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kNight = "{night}";
constexpr std::size_t kDateLength = 10;

bool is_date(std::string_view text)
{
    if (text.size() != kDateLength) return false;
    for (std::size_t i = 0; i < text.size(); ++i) {
        const bool dash = i == 4 || i == 7;
        if (dash ? text[i] != '-' : std::isdigit(static_cast<unsigned char>(text[i])) == 0) return false;
    }
    return true;
}

/// The part of a path that has the night, and what lies before it.
struct NightPart {
    fs::path before;
    std::string name;      // with "{night}"
    bool is_file = false;  // the last part
};

NightPart night_part(const std::string& output)
{
    NightPart part;
    const fs::path path(output);
    for (auto each = path.begin(); each != path.end(); ++each) {
        part.name = each->string();
        part.is_file = std::next(each) == path.end();
        if (has_night(part.name)) break;
        part.before /= *each;
    }
    return part;
}

bool is_real(const fs::path& path, fs::file_type type)
{
    std::error_code ignored;
    return fs::symlink_status(path, ignored).type() == type;
}

class Removal {
public:
    Removal(const NightlyFiles& batch, const std::string& night, bool really)
        : batch_(batch), really_(really), old_{night, 0, 0, {}}
    {
    }
    OldNight run();

private:
    fs::path at(const std::string& path) const { return at_night(path, old_.night); }
    bool may_go(const fs::path& path, const FrameFile& file);
    void remove_of(const fs::path& record_file, const fs::path& folder, const std::set<fs::path>& places);
    void remove_empty(std::string pattern) const;

    const NightlyFiles& batch_;
    const bool really_;
    OldNight old_;
};

bool Removal::may_go(const fs::path& path, const FrameFile& file)
{
    if (!is_real(path, fs::file_type::regular)) return false;
    std::error_code failed;
    if (!file.hash.empty() && fs::file_size(path, failed) == file.bytes && file_hash(path.string()) == file.hash)
        return true;
    old_.left.push_back(path.string());
    return false;
}

/// @param places  where its files may lie
void Removal::remove_of(const fs::path& record_file, const fs::path& folder, const std::set<fs::path>& places)
{
    const auto record = read_frame_record(record_file.string());
    if (!record) return;
    bool all = true;
    std::error_code failed;
    for (const FrameFile& file : record->files) {
        const fs::path path = (folder / file.name).lexically_normal();
        if (!places.contains(path) || !fs::exists(fs::symlink_status(path, failed))) continue;
        const bool goes = may_go(path, file) && (!really_ || fs::remove(path, failed));
        all = all && goes;
        if (!goes) continue;
        ++old_.files;
        old_.bytes += file.bytes;
    }
    if (all && really_) fs::remove(record_file, failed);
}

/// Folders that only this night has, from a file's up.
void Removal::remove_empty(std::string pattern) const
{
    std::error_code failed;
    while (has_night(pattern = fs::path(pattern).parent_path().string())) {
        fs::remove(at(pattern) / ".rcsplat", failed);
        if (!fs::remove(at(pattern), failed)) return;  // others have files there
    }
}

OldNight Removal::run()
{
    const std::string& first = batch_.outputs.front();
    const NightPart part = night_part(first);
    // What a link leads to may be anybody's.
    if (!part.is_file && !is_real(part.before / at_night(part.name, old_.night), fs::file_type::directory)) return old_;
    const fs::path folder = at(first).parent_path();
    std::error_code failed;
    std::vector<fs::path> known;
    if (is_real(folder / ".rcsplat", fs::file_type::directory))
        for (const auto& entry : fs::directory_iterator(folder / ".rcsplat", failed)) known.push_back(entry.path());
    for (const fs::path& file : known) {
        const auto record = read_frame_record(file.string());
        if (!record || record_path(path_of_frame(at(first).string(), record->number)) != file.string()) continue;
        std::set<fs::path> places;
        for (const std::string& output : batch_.outputs)
            if (has_night(output))
                places.insert(fs::path(path_of_frame(at(output).string(), record->number)).lexically_normal());
        remove_of(file, folder, places);
    }
    if (has_night(batch_.report_folder)) {
        const fs::path reports = at(batch_.report_folder);
        std::set<fs::path> places;
        for (const std::string& name : report_files()) places.insert((reports / name).lexically_normal());
        remove_of(report_record_path(reports.string()), reports, places);
    }
    if (!really_) return old_;
    for (const std::string& output : batch_.outputs) remove_empty(output);
    remove_empty((fs::path(batch_.report_folder) / "report.html").string());
    return old_;
}

}  // namespace

std::string night_of(std::int64_t wall_ms)
{
    constexpr std::int64_t kHalfDay = 12 * 3'600'000;
    const auto seconds = static_cast<std::time_t>((wall_ms - kHalfDay) / 1000);
    std::tm date{};
    ::localtime_r(&seconds, &date);
    char text[16];
    std::strftime(text, sizeof text, "%Y-%m-%d", &date);
    return text;
}

bool has_night(const std::string& text) { return text.find(kNight) != text.npos; }

std::string at_night(std::string text, const std::string& night)
{
    for (std::size_t at = 0; (at = text.find(kNight, at)) != text.npos; at += night.size())
        text.replace(at, kNight.size(), night);
    return text;
}

std::vector<std::string> nights_of(const std::string& output)
{
    const NightPart part = night_part(output);
    const std::size_t begin = part.name.find(kNight);
    std::set<std::string> nights;
    std::error_code failed;
    if (begin == part.name.npos) return {};
    for (const auto& entry : fs::directory_iterator(part.before.empty() ? "." : part.before, failed)) {
        const std::string name = entry.path().filename().string();
        if (name.size() < begin + kDateLength || !is_date(std::string_view(name).substr(begin, kDateLength))) continue;
        const std::string night = name.substr(begin, kDateLength), like = at_night(part.name, night);
        const bool fits = part.is_file ? name.compare(0, begin, like, 0, begin) == 0 : name == like;
        if (fits) nights.insert(night);
    }
    return {nights.begin(), nights.end()};
}

OldNight remove_night(const NightlyFiles& batch, const std::string& night, bool really)
{
    return Removal(batch, night, really).run();
}

std::string to_text(const OldNight& old, bool really)
{
    char size[32];
    std::snprintf(size, sizeof size, "%.1f MB", 1e-6 * static_cast<double>(old.bytes));
    std::string text = "the night " + old.night + ": " + std::to_string(old.files) +
                       (old.files == 1 ? " file" : " files") + " of " + size + (really ? " removed" : " to be removed");
    for (const std::string& file : old.left)
        text.append(&file == &old.left.front() ? "; left, since not as the batch wrote them: " : ", ").append(file);
    return text;
}

}  // namespace rcs::service
