// Loaded before a program's libraries (LD_PRELOAD) it sets the wall's clock forward by as many seconds as the file
// $SHIFTED_CLOCK says, or back. No other clock is changed.
#include <cstdlib>
#include <ctime>

#include <fcntl.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace {

long shift_seconds()
{
    const char* path = std::getenv("SHIFTED_CLOCK");
    const int fd = path != nullptr ? ::open(path, O_RDONLY | O_CLOEXEC) : -1;
    char text[32] = {};
    if (fd < 0) return 0;
    const ssize_t count = ::read(fd, text, sizeof text - 1);
    ::close(fd);
    return count > 0 ? std::atol(text) : 0;
}

}  // namespace

extern "C" int clock_gettime(clockid_t clock, timespec* time) noexcept
{
    const long result = ::syscall(SYS_clock_gettime, clock, time);
    if (result == 0 && clock == CLOCK_REALTIME) time->tv_sec += shift_seconds();
    return static_cast<int>(result);
}
