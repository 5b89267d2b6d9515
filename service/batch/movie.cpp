#include "batch/movie.h"

#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <system_error>
#include <thread>
#include <utility>

#include <sys/wait.h>
#include <unistd.h>

#include "process/interrupt.h"
#include "process/program.h"

namespace rcs::service {
namespace {

namespace fs = std::filesystem;

/// Of the movie in the making, gone in the end.
class WorkFolder {
public:
    explicit WorkFolder(const fs::path& movie)
    {
        std::string name(".");
        name.append(movie.filename().string()).append(".tmp-").append(std::to_string(::getpid()));
        path_ = fs::absolute(movie).parent_path() / name;
        fs::create_directories(path_);
    }
    ~WorkFolder()
    {
        std::error_code ignored;
        fs::remove_all(path_, ignored);
    }
    WorkFolder(const WorkFolder&) = delete;
    WorkFolder& operator=(const WorkFolder&) = delete;

    fs::path operator/(const std::string& name) const { return path_ / name; }

private:
    fs::path path_;
};

/// Runs a program. @param told  file for all that it says   @return whether it ended with 0
bool run(std::vector<std::string> words, const std::string& told)
{
    int error = 0;
    const pid_t pid = start_program({.words = std::move(words), .output = told}, error);
    if (pid == 0) {
        std::ofstream(told) << std::strerror(error);
        return false;
    }
    int status = 0;
    for (bool stopped = false; ::waitpid(pid, &status, WNOHANG) == 0;) {
        if (interrupt_signal() != 0 && !std::exchange(stopped, true)) ::kill(pid, SIGTERM);
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

std::string last_line(const fs::path& file)
{
    std::ifstream lines(file);
    std::string last;
    for (std::string line; std::getline(lines, line);)
        if (!line.empty()) last = line;
    return last;
}

/// A path as it stands in a pattern, where %d is a number.
std::string in_pattern(std::string path)
{
    for (std::size_t at = 0; (at = path.find('%', at)) != path.npos; at += 2) path.insert(at, 1, '%');
    return path;
}

std::string text_of(double fps)
{
    char text[32];
    std::snprintf(text, sizeof text, "%.10g", fps);
    return text;
}

}  // namespace

std::string make_movie(const std::string& maker, const std::vector<std::string>& pictures, double fps,
                       const std::string& file)
{
    try {
        // Links with numbers: files may be called anything, and some frames be missing.
        const WorkFolder folder(file);
        const std::string ending = fs::path(pictures.front()).extension().string();
        for (std::size_t i = 0; i < pictures.size(); ++i)
            fs::create_symlink(fs::absolute(pictures[i]), folder / (std::to_string(i) + ending));
        const std::string made = (folder / "movie.mp4").string(), told = (folder / "told").string();
        // Colours and sides as every player takes them.
        const bool ended_well =
            run({maker, "-nostdin", "-loglevel", "error", "-f", "image2", "-framerate", text_of(fps), "-start_number",
                 "0", "-i", in_pattern((folder / "").string()) + "%d" + ending, "-vf",
                 "pad=ceil(iw/2)*2:ceil(ih/2)*2,format=yuv420p", "-movflags", "+faststart", made},
                told);
        if (!ended_well || !fs::exists(made)) {
            const std::string why = last_line(told);
            return why.empty() ? maker + " failed" : why;
        }
        fs::rename(made, file);
        return {};
    } catch (const fs::filesystem_error& e) {
        return e.code().message();
    }
}

}  // namespace rcs::service
