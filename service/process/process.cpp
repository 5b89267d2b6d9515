#include "process/process.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <iterator>
#include <optional>
#include <sstream>
#include <string>

#ifdef __GLIBC__
#include <malloc.h>
#endif
#include <sys/resource.h>
#include <unistd.h>

namespace rcs::service {

void limit_gl_threads(int threads) { ::setenv("LP_NUM_THREADS", std::to_string(threads).c_str(), 0); }

void keep_freed_memory()
{
#ifdef __GLIBC__
    constexpr int kMmapThreshold = 32 << 20;  // the most that glibc takes
    constexpr int kTrimThreshold = 512 << 20;
    ::mallopt(M_MMAP_THRESHOLD, kMmapThreshold);
    ::mallopt(M_TRIM_THRESHOLD, kTrimThreshold);
    ::mallopt(M_MMAP_MAX, 0);  // a plane of a 4K picture is larger than that
#endif
}

void give_back_freed_memory()
{
#ifdef __GLIBC__
    ::malloc_trim(0);
#endif
}

double seconds_of_process()
{
    // proc(5): the second field may hold spaces, in parentheses; field 22 is when it started, in ticks since boot.
    std::ifstream file("/proc/self/stat");
    const std::string text{std::istreambuf_iterator<char>(file), {}};
    std::istringstream fields(text.substr(std::min(text.size(), text.rfind(')') + 1)));
    std::string field;
    for (int i = 3; i <= 22; ++i) fields >> field;
    timespec now{};
    if (fields.fail() || clock_gettime(CLOCK_BOOTTIME, &now) != 0) return 0.0;
    const double since_boot = static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
    return std::max(0.0, since_boot - std::strtod(field.c_str(), nullptr) / static_cast<double>(sysconf(_SC_CLK_TCK)));
}

namespace {

/// A number in a file of the kernel's, after a word or at its beginning; none if it is not there, or says "max".
std::optional<double> number_in(const std::string& file, const std::string& key = "")
{
    std::ifstream lines(file);
    std::string line;
    while (std::getline(lines, line)) {
        if (!line.starts_with(key)) continue;
        std::istringstream rest(line.substr(key.size()));
        double number = 0.0;
        if (rest >> number) return number;
    }
    return std::nullopt;
}

/// What a control group's limit leaves (cgroups(7), version 2).
std::optional<double> left_in_group()
{
    std::ifstream file("/proc/self/cgroup");
    std::string line;
    std::optional<double> left;
    while (std::getline(file, line)) {
        if (!line.starts_with("0::")) continue;
        for (std::string group = line.substr(3);; group.resize(group.rfind('/'))) {
            const std::string folder = "/sys/fs/cgroup" + group;
            const auto most = number_in(folder + "/memory.max"), used = number_in(folder + "/memory.current"),
                       cache = number_in(folder + "/memory.stat", "inactive_file ");
            if (most && used) left = std::min(left.value_or(1e30), *most - *used + cache.value_or(0.0));
            if (group.empty() || group.rfind('/') == group.npos) break;
        }
    }
    return left;
}

}  // namespace

double available_memory()
{
    double left = 1024.0 * number_in("/proc/meminfo", "MemAvailable:").value_or(1e27);
    left = std::min(left, left_in_group().value_or(left));
    rlimit limit{};
    if (getrlimit(RLIMIT_AS, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY) {
        const double pages = number_in("/proc/self/statm").value_or(0.0);
        left = std::min(left, static_cast<double>(limit.rlim_cur) - pages * static_cast<double>(sysconf(_SC_PAGESIZE)));
    }
    return std::max(0.0, left);
}

std::uint64_t resident_memory(pid_t pid)
{
    std::FILE* file = std::fopen(std::string("/proc/").append(std::to_string(pid)).append("/statm").c_str(), "re");
    if (file == nullptr) return 0;
    unsigned long long all = 0, resident = 0;
    const bool read = std::fscanf(file, "%llu %llu", &all, &resident) == 2;
    std::fclose(file);
    return read ? resident * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE)) : 0;
}

ProcessorTime processor_time()
{
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    const auto seconds = [](const timeval& t) {
        return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
    };
    ProcessorTime time{seconds(usage.ru_utime) + seconds(usage.ru_stime), 0.0};
    std::ifstream file("/proc/stat");  // proc(5): cpu, then user, nice, system, idle, iowait, irq, softirq, steal
    std::string cpu;
    double ticks[8] = {};
    file >> cpu;
    for (double& tick : ticks) file >> tick;
    const double busy = ticks[0] + ticks[1] + ticks[2] + ticks[5] + ticks[6];
    if (file) time.others = std::max(0.0, busy / static_cast<double>(sysconf(_SC_CLK_TCK)) - time.own);
    return time;
}

}  // namespace rcs::service
