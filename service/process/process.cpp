#include "process/process.h"

#include <algorithm>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string>

#include <unistd.h>

namespace rcs::service {

void limit_gl_threads(int threads) { ::setenv("LP_NUM_THREADS", std::to_string(threads).c_str(), 0); }

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

}  // namespace rcs::service
