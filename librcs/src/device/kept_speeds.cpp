#include "device/kept_speeds.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
#include <sstream>
#include <system_error>
#include <utility>

#include "rcs/error.h"
#include "rcs/fingerprint.h"
#include "rcs/version.h"
#include "util/file_writer.h"

namespace rcs {
namespace {

/// Empty where the user has no such folder.
std::string kept_file(const std::string& name)
{
    namespace fs = std::filesystem;
    const char* cache = std::getenv("XDG_CACHE_HOME");
    const char* home = std::getenv("HOME");
    if (cache && *cache) return (fs::path(cache) / "rcsplat" / name).string();
    return home && *home ? (fs::path(home) / ".cache" / "rcsplat" / name).string() : std::string();
}

std::string key_of(const GlContext& gl, const ThreadPool& pool)
{
    Fingerprint print;
    print.add(gl.renderer());
    print.add(gl.version());
    print.add(std::string_view(kVersion));
    print.add(pool.size());
    return print.text();
}

std::string line_of(const std::string& key, const std::vector<double>& speeds)
{
    std::string line = key;
    for (const double speed : speeds) {
        char number[32];
        std::snprintf(number, sizeof number, " %.3f", speed);
        line += number;
    }
    return line;
}

/// Lines of a key and the speeds.
std::vector<std::string> kept_lines(const std::string& path)
{
    std::vector<std::string> lines;
    std::ifstream file(path);
    for (std::string line; std::getline(file, line);) lines.push_back(line);
    return lines;
}

std::optional<std::vector<double>> find_kept(const std::string& path, const std::string& key, std::size_t count)
{
    for (const std::string& line : kept_lines(path)) {
        std::istringstream words(line);
        std::string its_key;
        std::vector<double> speeds;
        words >> its_key;
        for (double speed = 0.0; words >> speed;) speeds.push_back(speed);
        if (its_key == key && speeds.size() == count &&
            std::all_of(speeds.begin(), speeds.end(), [](double speed) { return speed > 0.0; }))
            return speeds;
    }
    return std::nullopt;
}

/// A folder that cannot be written to only costs the next measurement.
void keep(const std::string& path, const std::string& key, const std::vector<double>& speeds)
{
    constexpr std::size_t kMostLines = 64;
    std::vector<std::string> lines = kept_lines(path);
    std::erase_if(lines, [&](const std::string& line) { return line.rfind(key + " ", 0) == 0; });
    lines.push_back(line_of(key, speeds));
    if (lines.size() > kMostLines) lines.erase(lines.begin(), lines.end() - kMostLines);
    std::error_code failed;
    std::filesystem::create_directories(std::filesystem::path(path).parent_path(), failed);
    try {
        FileWriter file(path);
        for (const std::string& line : lines) std::fprintf(file.file(), "%s\n", line.c_str());
        file.commit();
    } catch (const Error&) {
        return;
    }
}

}  // namespace

MeasuredSpeeds speeds_of(const std::string& name, const GlContext& gl, const ThreadPool& pool, std::size_t count,
                         const std::function<std::vector<double>()>& measure)
{
    const std::string path = kept_file(name), key = key_of(gl, pool);
    if (!path.empty())
        if (auto kept = find_kept(path, key, count)) return {std::move(*kept), true};
    MeasuredSpeeds measured{measure(), false};
    if (!path.empty()) keep(path, key, measured.speeds);
    return measured;
}

}  // namespace rcs
