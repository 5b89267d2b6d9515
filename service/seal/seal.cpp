#include "seal/seal.h"

#include <cerrno>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <filesystem>

#include <dirent.h>
#include <fcntl.h>
#include <link.h>
#include <linux/capability.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "seal/call_filter.h"
#include "wire/errors.h"
#include "wire/files.h"

namespace rcs::service {
namespace {

namespace fs = std::filesystem;

// Landlock as Documentation/userspace-api/landlock.rst has it; Debian 12's header knows its first two versions.
constexpr long kCreateRuleset = 444, kAddRule = 445, kRestrictSelf = 446;  // system calls, on all processors
constexpr unsigned kAskForVersion = 1, kPathBeneath = 1;

namespace right {
constexpr std::uint64_t execute = 1 << 0, write_file = 1 << 1, read_file = 1 << 2, read_folder = 1 << 3,
                        remove_folder = 1 << 4, remove_file = 1 << 5, make_folder = 1 << 7, make_file = 1 << 8,
                        refer = 1 << 13, truncate = 1 << 14, device_control = 1 << 15;
constexpr std::uint64_t of_files = execute | write_file | read_file | truncate | device_control;
}  // namespace right

struct Ruleset {
    std::uint64_t files = 0, network = 0, scopes = 0;  // what is refused where no rule allows it
};
struct __attribute__((packed)) PathRule {
    std::uint64_t allowed;
    std::int32_t parent;
};

/// All that a version can refuse.
Ruleset ruleset_of(int version)
{
    constexpr int kBits[] = {0, 13, 14, 15, 15, 16};  // of files, by version
    constexpr int kKnown = static_cast<int>(std::size(kBits)) - 1;
    Ruleset ruleset;
    ruleset.files = (std::uint64_t{1} << kBits[std::min(version, kKnown)]) - 1;
    if (version >= 4) ruleset.network = 3;  // binding and connecting TCP
    if (version >= 6) ruleset.scopes = 3;   // abstract Unix sockets and signals to processes outside
    return ruleset;
}

int landlock_version()
{
    const long version = ::syscall(kCreateRuleset, nullptr, 0, kAskForVersion);
    return version > 0 ? static_cast<int>(version) : 0;
}

[[noreturn]] void fail(const std::string& what)
{
    throw ServiceError(v1::ERROR_CODE_INTERNAL, "cannot seal the process: " + what + ": " + std::strerror(errno));
}

void allow(const Fd& ruleset, const std::string& path, std::uint64_t rights)
{
    const Fd place(::open(path.c_str(), O_PATH | O_CLOEXEC));
    if (!place) return;
    struct stat status{};
    if (::fstat(place.get(), &status) != 0) fail(path);
    if (!S_ISDIR(status.st_mode)) rights &= right::of_files;
    const PathRule rule{rights, place.get()};
    if (::syscall(kAddRule, ruleset.get(), kPathBeneath, &rule, 0) != 0) fail(path);
}

void close_files(int version, const Reach& reach)
{
    constexpr std::uint64_t kRead = right::read_file | right::read_folder;
    constexpr std::uint64_t kWrite = kRead | right::write_file | right::remove_folder | right::remove_file |
                                     right::make_folder | right::make_file | right::refer | right::truncate;
    const Ruleset refused = ruleset_of(version);
    const Fd ruleset(static_cast<int>(::syscall(kCreateRuleset, &refused, sizeof refused, 0)));
    if (!ruleset) fail("Landlock");
    for (const std::string& path : reach.read) allow(ruleset, path, kRead);
    for (const std::string& path : reach.devices)
        allow(ruleset, path, (kRead | right::write_file | right::device_control) & refused.files);
    for (const std::string& path : reach.write) allow(ruleset, path, kWrite & refused.files);
    if (::syscall(kRestrictSelf, ruleset.get(), 0) != 0) fail("Landlock");
}

/// What root may do beyond its own files.
void drop_capabilities()
{
    __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
    __user_cap_data_struct none[2]{};
    if (::syscall(SYS_capset, &header, none) != 0) fail("capabilities");
}

void limit_resources()
{
    const rlimit descriptors{1024, 1024}, file{32ull << 30, 32ull << 30}, none{0, 0};
    ::signal(SIGXFSZ, SIG_IGN);  // a larger file is an error in the frame's words
    if (::setrlimit(RLIMIT_NOFILE, &descriptors) != 0 || ::setrlimit(RLIMIT_FSIZE, &file) != 0 ||
        ::setrlimit(RLIMIT_CORE, &none) != 0)
        fail("resource limits");
}

}  // namespace

std::string describe(const Seal& seal)
{
    std::string text = seal.landlock > 0 ? "files (Landlock " + std::to_string(seal.landlock) + ")"
                                         : std::string("not files, as this kernel has no Landlock");
    return text + (seal.calls ? ", network, programs and processes"
                              : "; not network, programs and processes, as this kernel has no seccomp filters");
}

Seal available_seal() { return {landlock_version(), has_call_filter()}; }

Seal seal_process(const Reach& reach)
{
    const Seal seal = available_seal();
    limit_resources();
    if (::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0) fail("no_new_privs");
    if (seal.landlock > 0) close_files(seal.landlock, reach);
    drop_capabilities();
    if (seal.calls && !filter_calls()) fail("seccomp");
    return seal;
}

Reach machine_places()
{
    Reach reach;
    reach.read = {"/usr", "/lib", "/lib64", "/lib32", "/sys",
                  // of /etc what the loader, GL drivers and time zones ask for
                  "/etc/ld.so.cache", "/etc/ld.so.preload", "/etc/glvnd", "/etc/egl", "/etc/drirc", "/etc/nvidia",
                  "/etc/localtime", "/etc/fonts", "/proc/self", "/proc/cpuinfo", "/proc/meminfo", "/proc/stat",
                  "/proc/version", "/proc/filesystems", "/proc/modules", "/proc/devices", "/proc/driver",
                  "/proc/sys/vm", "/proc/sys/kernel"};
    reach.devices = {"/dev/null", "/dev/zero", "/dev/full", "/dev/random", "/dev/urandom", "/dev/dri"};
    std::error_code ignored;
    for (const auto& entry : fs::directory_iterator("/dev", ignored)) {
        if (entry.path().filename().string().starts_with("nvidia")) reach.devices.push_back(entry.path().string());
    }
    // Wherever libraries lie: what they open beside themselves as well.
    ::dl_iterate_phdr(
        [](dl_phdr_info* library, std::size_t, void* places) {
            const std::string folder = fs::path(library->dlpi_name).parent_path().string();
            if (!folder.empty()) static_cast<std::vector<std::string>*>(places)->push_back(folder);
            return 0;
        },
        &reach.read);
    // Whoever started the server may have told it of other drivers.
    for (const char* name : {"LD_LIBRARY_PATH", "LIBGL_DRIVERS_PATH", "GBM_BACKENDS_PATH", "__EGL_VENDOR_LIBRARY_DIRS",
                             "__EGL_VENDOR_LIBRARY_FILENAMES", "__EGL_EXTERNAL_PLATFORM_CONFIG_DIRS", "RCSPLAT_OIDN"}) {
        const char* value = std::getenv(name);
        for (std::string list = value != nullptr ? value : ""; !list.empty();) {
            const std::size_t end = std::min(list.find(':'), list.size());
            if (end > 0) reach.read.push_back(list.substr(0, end));
            list.erase(0, end + 1);
        }
    }
    return reach;
}

}  // namespace rcs::service
