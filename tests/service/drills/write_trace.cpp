#include "service/drills/write_trace.h"

#include <csignal>
#include <cstddef>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <stdexcept>

#include <fcntl.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sys/prctl.h>
#include <sys/ptrace.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <sys/wait.h>
#include <unistd.h>

#include "support/temporary_folder.h"

namespace rcs::test {
namespace {

namespace fs = std::filesystem;
using Kind = FileChange::Kind;

constexpr unsigned kTraced[] = {
    SYS_openat,  SYS_openat2,  SYS_write,     SYS_pwrite64, SYS_writev, SYS_ftruncate, SYS_renameat2, SYS_linkat,
    SYS_mkdirat, SYS_unlinkat, SYS_fdatasync, SYS_fsync,
#ifdef SYS_open
    SYS_open,    SYS_creat,    SYS_rename,    SYS_renameat, SYS_link,   SYS_mkdir,     SYS_unlink,    SYS_rmdir,
#endif
};

/// Before exec: the calls above stop for the tracer.
void stop_at_traced_calls()
{
    std::vector<sock_filter> program{BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, nr))};
    for (const unsigned number : kTraced) {
        program.push_back(BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, number, 0, 1));
        program.push_back(BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_TRACE));
    }
    program.push_back(BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW));
    const sock_fprog filter{static_cast<unsigned short>(program.size()), program.data()};
    ::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0);
    ::prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &filter);
}

std::string of_process(pid_t process, const std::string& name) { return "/proc/" + std::to_string(process) + name; }

std::string bytes_in(pid_t process, std::uint64_t address, std::size_t size)
{
    std::string bytes(size, '\0');
    const iovec here{bytes.data(), size}, there{reinterpret_cast<void*>(address), size};
    if (::process_vm_readv(process, &here, 1, &there, 1, 0) != static_cast<ssize_t>(size))
        throw std::runtime_error("cannot read what is written");
    return bytes;
}

std::string text_in(pid_t process, std::uint64_t address)
{
    std::string text;
    for (constexpr std::size_t kPage = 4096; text.find('\0') == text.npos;) {
        const std::size_t size = kPage - (address + text.size()) % kPage;
        text += bytes_in(process, address + text.size(), size);
    }
    return text.substr(0, text.find('\0'));
}

std::string linked(const std::string& link)
{
    std::error_code problem;
    return fs::read_symlink(link, problem).string();
}

std::string path_at(pid_t process, std::uint64_t folder, const std::string& path)
{
    if (path.starts_with('/')) return path;
    const int fd = static_cast<int>(folder);
    return linked(of_process(process, fd == AT_FDCWD ? "/cwd" : "/fd/" + std::to_string(fd))) + "/" + path;
}

std::uint64_t inode(const std::string& path)
{
    struct stat status{};
    return ::lstat(path.c_str(), &status) == 0 ? status.st_ino : 0;
}

std::uint64_t inode(pid_t process, int fd)
{
    struct stat status{};
    return ::stat(of_process(process, "/fd/" + std::to_string(fd)).c_str(), &status) == 0 ? status.st_ino : 0;
}

std::uint64_t position(pid_t process, int fd)
{
    const std::string info = bytes_of(of_process(process, "/fdinfo/" + std::to_string(fd)));
    return std::stoull(info.substr(info.find("pos:") + 4));
}

/// What a call names, as its *at form has it: folder, path, folder, path. One path: twice the same.
struct Names {
    std::string from, to;
};
Names names_of(pid_t process, std::uint64_t number, const std::uint64_t (&a)[6])
{
    const auto at = [&](std::uint64_t folder, std::uint64_t path) {
        return path_at(process, folder, text_in(process, path));
    };
    const auto here = static_cast<std::uint64_t>(AT_FDCWD);
    switch (number) {
        case SYS_renameat2:
        case SYS_linkat:
#ifdef SYS_open
        case SYS_renameat:
#endif
            return {at(a[0], a[1]), at(a[2], a[3])};
#ifdef SYS_open
        case SYS_rename:
        case SYS_link:
            return {at(here, a[0]), at(here, a[1])};
        case SYS_mkdir:
        case SYS_unlink:
        case SYS_rmdir:
            return {at(here, a[0]), at(here, a[0])};
#endif
        default:
            return {at(a[0], a[1]), at(a[0], a[1])};
    }
}

Kind kind_of(std::uint64_t number)
{
    switch (number) {
        case SYS_linkat:
#ifdef SYS_open
        case SYS_link:
#endif
            return Kind::link;
        case SYS_mkdirat:
#ifdef SYS_open
        case SYS_mkdir:
#endif
            return Kind::make_folder;
        case SYS_unlinkat:
#ifdef SYS_open
        case SYS_unlink:
        case SYS_rmdir:
#endif
            return Kind::remove;
        default:
            return Kind::rename;
    }
}

}  // namespace

WriteTrace::WriteTrace(const std::string& folder) : folder_(folder) { known_[inode(folder)] = kRoot; }

void WriteTrace::start(std::vector<std::string> words, const std::string& log)
{
    pid_ = 0;
    thread_ = std::thread([this, words = std::move(words), log] { run(words, log); });
    while (pid_ == 0) std::this_thread::yield();
}

void WriteTrace::end(int signal)
{
    ::kill(pid_, signal);
    thread_.join();
}

/// By a thread of its own: whoever starts a process by ptrace has to follow it.
void WriteTrace::run(const std::vector<std::string>& words, const std::string& log)
{
    std::vector<char*> argv;
    for (const std::string& word : words) argv.push_back(const_cast<char*>(word.c_str()));
    argv.push_back(nullptr);
    const pid_t pid = ::fork();
    if (pid == 0) {
        ::dup2(::open(log.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0600), 2);
        ::ptrace(PTRACE_TRACEME, 0, nullptr, nullptr);
        ::raise(SIGSTOP);
        stop_at_traced_calls();
        ::execv(argv[0], argv.data());
        ::_exit(127);
    }
    ::waitpid(pid, nullptr, __WALL);
    ::ptrace(PTRACE_SETOPTIONS, pid, nullptr,
             PTRACE_O_TRACEFORK | PTRACE_O_TRACEVFORK | PTRACE_O_TRACECLONE | PTRACE_O_TRACEEXEC |
                 PTRACE_O_TRACESECCOMP | PTRACE_O_TRACESYSGOOD | PTRACE_O_EXITKILL);
    ::ptrace(PTRACE_CONT, pid, nullptr, nullptr);
    calls_.clear();
    pid_ = pid;
    follow();
}

void WriteTrace::follow()
{
    int status = 0;
    for (pid_t process; (process = ::waitpid(-1, &status, __WALL)) > 0;) {
        if (!WIFSTOPPED(status)) continue;
        const int signal = WSTOPSIG(status), event = status >> 16;
        if (event == PTRACE_EVENT_SECCOMP) {
            before(process);
            ::ptrace(PTRACE_SYSCALL, process, nullptr, nullptr);
            continue;
        }
        if (signal == (SIGTRAP | 0x80)) after(process);
        // A new process begins with a stop; all else that is no event is a signal that is meant for it.
        const bool passes = event == 0 && signal != SIGSTOP && signal != SIGTRAP && signal != (SIGTRAP | 0x80);
        ::ptrace(PTRACE_CONT, process, nullptr, static_cast<std::uintptr_t>(passes ? signal : 0));
    }
}

void WriteTrace::before(pid_t process)
{
    __ptrace_syscall_info info{};
    ::ptrace(PTRACE_GET_SYSCALL_INFO, process, sizeof info, &info);
    Call& call = calls_[process];
    call.number = info.seccomp.nr;
    std::copy(std::begin(info.seccomp.args), std::end(info.seccomp.args), call.arguments);
    const Kind kind = kind_of(call.number);
    const bool names = kind != Kind::rename || call.number == SYS_renameat2
#ifdef SYS_open
                       || call.number == SYS_rename || call.number == SYS_renameat
#endif
        ;
    if (!names) return;
    const Names named = names_of(process, call.number, call.arguments);
    call.file = inode(named.from);
    struct stat status{};
    const bool removes = kind == Kind::remove || kind == Kind::rename;
    const bool is_last = removes && ::lstat(named.to.c_str(), &status) == 0 &&
                         (status.st_nlink == 1 || S_ISDIR(status.st_mode)) &&
                         (kind == Kind::remove || status.st_ino != call.file);
    call.gone = is_last ? status.st_ino : 0;
}

void WriteTrace::after(pid_t process)
{
    __ptrace_syscall_info info{};
    ::ptrace(PTRACE_GET_SYSCALL_INFO, process, sizeof info, &info);
    const auto found = calls_.extract(process);
    if (!found || info.exit.is_error != 0) return;
    const Call& call = found.mapped();
    const auto& a = call.arguments;
    const auto result = static_cast<std::uint64_t>(info.exit.rval);
    switch (call.number) {
#ifdef SYS_open
        case SYS_open:
            return opened(process, static_cast<int>(result), (a[1] & O_TRUNC) != 0);
        case SYS_creat:
            return opened(process, static_cast<int>(result), true);
#endif
        case SYS_openat:
            return opened(process, static_cast<int>(result), (a[2] & O_TRUNC) != 0);
        case SYS_openat2:
            return opened(process, static_cast<int>(result), false);
        case SYS_write:
        case SYS_pwrite64:
        case SYS_writev:
            return written(process, call, result);
        case SYS_ftruncate:
            if (const auto file = known_file(process, static_cast<int>(a[0])))
                append({Kind::cut, file, 0, 0, "", "", "", a[1]});
            return;
        case SYS_fsync:
        case SYS_fdatasync:
            if (const auto file = known_file(process, static_cast<int>(a[0]))) append({Kind::sync, file});
            return;
        default:
            return named(process, call);
    }
}

void WriteTrace::opened(pid_t process, int fd, bool cut)
{
    if (const std::uint64_t file = known_file(process, fd)) {
        if (cut) append({Kind::cut, file});
        return;
    }
    FileChange made{Kind::make_file};
    if (!place(linked(of_process(process, "/fd/" + std::to_string(fd))), made.folder, made.name)) return;
    made.file = learned(inode(process, fd));
    append(std::move(made));
}

void WriteTrace::written(pid_t process, const Call& call, std::uint64_t count)
{
    const auto& a = call.arguments;
    const std::uint64_t file = known_file(process, static_cast<int>(a[0]));
    if (file == 0 || count == 0) return;
    FileChange change{Kind::write, file};
    if (call.number == SYS_writev) {
        const std::string list = bytes_in(process, a[1], a[2] * sizeof(iovec));
        for (std::size_t i = 0; i < a[2]; ++i) {
            iovec part{};
            std::memcpy(&part, list.data() + i * sizeof part, sizeof part);
            change.data += bytes_in(process, reinterpret_cast<std::uintptr_t>(part.iov_base), part.iov_len);
        }
        change.data.resize(count);
    } else {
        change.data = bytes_in(process, a[1], count);
    }
    change.offset = call.number == SYS_pwrite64 ? a[3] : position(process, static_cast<int>(a[0])) - count;
    append(std::move(change));
}

void WriteTrace::named(pid_t process, const Call& call)
{
    const Names names = names_of(process, call.number, call.arguments);
    FileChange change{kind_of(call.number)};
    if (!place(names.from, change.folder, change.name)) return;
    place(names.to, change.to_folder, change.to_name);
    change.file = change.kind == Kind::make_folder ? learned(inode(names.from)) : known(call.file);
    known_.erase(call.gone);  // its number may be another file's now
    append(std::move(change));
}

void WriteTrace::append(FileChange change)
{
    changes_.push_back(std::move(change));
    size_ = changes_.size();
}

std::uint64_t WriteTrace::known_file(pid_t process, int fd) const { return known(inode(process, fd)); }

std::uint64_t WriteTrace::known(std::uint64_t inode) const
{
    const auto found = known_.find(inode);
    return found != known_.end() ? found->second : 0;
}

std::uint64_t WriteTrace::learned(std::uint64_t inode) { return known_[inode] = ++last_; }

bool WriteTrace::place(const std::string& path, std::uint64_t& folder, std::string& name) const
{
    if (!path.starts_with(folder_ + "/")) return false;
    const fs::path whole(path);
    folder = known(inode(whole.parent_path().string()));
    name = whole.filename().string();
    return folder != 0;
}

}  // namespace rcs::test
