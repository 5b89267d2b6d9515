#include "scene/gltf_file.h"

#include <algorithm>
#include <fstream>
#include <system_error>

#include "rcs/scene.h"
#include "rcs/suggestion.h"

namespace rcs {
void GltfNotes::add(const GltfNoteKind& kind, const std::string& name, std::size_t count)
{
    auto entry = std::find_if(entries_.begin(), entries_.end(), [&](const Entry& e) { return e.kind == &kind; });
    if (entry == entries_.end()) entry = entries_.insert(entry, {&kind, 0, {}});
    entry->count += count;
    entry->names.push_back(name);
}

void GltfNotes::write(const std::string& file, const LogFunction& log) const
{
    constexpr std::size_t kMaxNames = 8;  // keeps a line readable
    if (!log) return;
    for (const Entry& entry : entries_) {
        const std::size_t count = entry.names.size();
        std::string line = file + ": " + (entry.count > 0 ? std::to_string(entry.count) + " " : "") + entry.kind->what +
                           " in " + std::to_string(count) + " " + entry.kind->noun +
                           (count == 1                                ? ""
                            : entry.kind->noun == std::string("mesh") ? "es"
                                                                      : "s") +
                           " (";
        for (std::size_t i = 0; i < std::min(count, kMaxNames); ++i) {
            line += (i > 0 ? ", " : "") + entry.names[i];
        }
        if (count > kMaxNames) line += " and " + std::to_string(count - kMaxNames) + " more";
        log(LogLevel::warning, line + "): " + entry.kind->done);
    }
}

std::string on_one_line(const std::string& text)
{
    std::string line;
    for (const char c : text) {
        if (c != '\n' && c != '\r')
            line += c;
        else if (!line.empty() && !line.ends_with("; "))
            line += "; ";
    }
    if (line.ends_with("; ")) line.resize(line.size() - 2);
    return line;
}

namespace {

/// "; did you mean 'room.glb'?": a file of the same folder, or a built-in scene; or "".
std::string meant_path(const std::filesystem::path& path)
{
    std::vector<std::string> names = demo_scene_names();
    for (const std::string& demo : names)
        if (demo == "demo:" + path.string()) return did_you_mean(demo, names);
    names.clear();
    std::error_code problem;
    const std::filesystem::path folder = path.has_parent_path() ? path.parent_path() : ".";
    for (std::filesystem::directory_iterator each(folder, problem), end; !problem && each != end;
         each.increment(problem)) {
        const std::string extension = each->path().extension().string();
        if (extension == ".glb" || extension == ".gltf") names.push_back(each->path().filename().string());
    }
    std::sort(names.begin(), names.end());
    return did_you_mean(path.filename().string(), names);
}

}  // namespace

std::vector<unsigned char> read_file(const std::filesystem::path& path, const std::string& what)
{
    std::error_code status;
    if (!std::filesystem::exists(path, status)) {
        throw Error(ErrorCode::not_found, what + " '" + path.string() + "' does not exist" + meant_path(path));
    }
    if (!std::filesystem::is_regular_file(path, status)) {
        throw Error(ErrorCode::bad_file, what + " '" + path.string() + "' is a folder or a device, expected a file");
    }
    std::ifstream stream(path, std::ios::binary | std::ios::ate);
    const std::streamoff size = stream ? static_cast<std::streamoff>(stream.tellg()) : -1;
    if (size < 0) throw Error(ErrorCode::io, what + " '" + path.string() + "' cannot be read");
    std::vector<unsigned char> bytes(static_cast<std::size_t>(size));
    stream.seekg(0);
    if (!stream.read(reinterpret_cast<char*>(bytes.data()), size)) {
        throw Error(ErrorCode::io, what + " '" + path.string() + "' cannot be read to its end");
    }
    return bytes;
}

}  // namespace rcs
