#include "batch/leftovers.h"

#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <system_error>

#include <signal.h>

namespace rcs::service {
namespace {

namespace fs = std::filesystem;

/// Whether a file was left half written by a process that was killed: FileWriter's ".NAME.tmp-PID" of one of `paths`.
bool is_leftover(const fs::path& file, const std::set<std::string>& paths)
{
    const std::string name = file.filename().string();
    const std::size_t mark = name.rfind(".tmp-");
    if (!name.starts_with('.') || mark == name.npos) return false;
    const int pid = std::atoi(name.c_str() + mark + 5);
    const bool ours = paths.contains((file.parent_path() / name.substr(1, mark - 1)).string());
    return ours && pid > 0 && ::kill(pid, 0) != 0 && errno == ESRCH;
}

}  // namespace

void remove_leftovers(const std::set<std::string>& paths, const std::set<std::string>& scratch)
{
    std::set<std::string> folders;
    for (const std::string& path : paths) folders.insert(fs::path(path).parent_path().string());
    for (const std::string& folder : folders) {
        std::error_code failed;
        for (const auto& entry : fs::directory_iterator(folder.empty() ? "." : folder, failed)) {
            const fs::path file = fs::path(folder) / entry.path().filename();
            if (is_leftover(file, paths) || scratch.contains(file.string())) fs::remove_all(file, failed);
        }
    }
}

}  // namespace rcs::service
