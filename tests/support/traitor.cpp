// Loaded before a program's libraries (LD_PRELOAD) it makes a worker of `rcsplat serve` do what somebody would who had
// taken it over by a scene: at the first file that it completes it tries to get out, and puts down beside that file
// what became of each attempt, as "NAME ERRNO", 0 where it succeeded. It reads where to get to from the environment.
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>

#include <arpa/inet.h>
#include <dlfcn.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <sys/ptrace.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

namespace {

std::string report;

void note(const char* name, bool succeeded)
{
    report += std::string(name) + " " + std::to_string(succeeded ? 0 : errno) + "\n";
}

bool opens(const std::string& path, int flags)
{
    const int fd = ::open(path.c_str(), flags | O_CLOEXEC, 0600);
    if (fd >= 0) ::close(fd);
    return fd >= 0;
}

bool connects_tcp(int port)
{
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    const int fd = ::socket(AF_INET, SOCK_STREAM, 0);
    return fd >= 0 && ::connect(fd, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0;
}

bool connects_unix(const char* path)
{
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strncpy(address.sun_path, path, sizeof address.sun_path - 1);
    const int fd = ::socket(AF_UNIX, SOCK_STREAM, 0);
    return fd >= 0 && ::connect(fd, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0;
}

void try_all(const std::string& folder)
{
    const std::string outside = std::getenv("TRAITOR_OUTSIDE"), state = std::getenv("TRAITOR_STATE");
    note("read-outside", opens(outside + "/sentinel", O_RDONLY));
    note("read-passwd", opens("/etc/passwd", O_RDONLY));
    note("list-root", opens("/", O_RDONLY | O_DIRECTORY));
    note("read-queue", opens(state + "/queue.db", O_RDONLY));
    note("write-queue", opens(state + "/queue.db", O_WRONLY));
    note("write-outside", opens(outside + "/made", O_CREAT | O_WRONLY));
    note("write-results", opens(state + "/results/made", O_CREAT | O_WRONLY));
    note("write-scenes", opens(state + "/scenes/made", O_CREAT | O_WRONLY));
    note("remove-outside", ::unlink((outside + "/sentinel").c_str()) == 0);
    note("truncate-outside", ::truncate((outside + "/sentinel").c_str(), 0) == 0);
    note("chmod-outside", ::chmod((outside + "/sentinel").c_str(), 0) == 0);
    note("link-in", ::link((outside + "/sentinel").c_str(), (folder + "/linked").c_str()) == 0);
    note("connect-tcp", connects_tcp(std::atoi(std::getenv("TRAITOR_PORT"))));
    note("connect-server", connects_unix(std::getenv("TRAITOR_SOCKET")));
    char* const words[] = {const_cast<char*>("true"), nullptr};
    note("exec", ::execv("/bin/true", words) == 0);
    note("fork", ::fork() >= 0);
    note("signal-server", ::kill(::getppid(), 0) == 0);
    note("trace-server", ::ptrace(PTRACE_SEIZE, ::getppid(), nullptr, nullptr) == 0);
    const rlimit none{0, 0};
    note("limit-server", ::prlimit(::getppid(), RLIMIT_NOFILE, &none, nullptr) == 0);
    note("memory-of-server", opens("/proc/" + std::to_string(::getppid()) + "/mem", O_RDWR));
    note("own-folder", opens(folder + "/own", O_CREAT | O_WRONLY));
    const int fd = ::open((folder + "/tried").c_str(), O_CREAT | O_WRONLY | O_CLOEXEC, 0600);
    [[maybe_unused]] const ssize_t count = ::write(fd, report.data(), report.size());
    ::close(fd);
}

}  // namespace

extern "C" int rename(const char* from, const char* to) noexcept
{
    static const auto real = reinterpret_cast<int (*)(const char*, const char*)>(::dlsym(RTLD_NEXT, "rename"));
    const std::string path = to;
    if (report.empty() && path.find("/.worker-") != path.npos && path.ends_with("a.png"))
        try_all(path.substr(0, path.rfind('/')));
    return real(from, to);
}
