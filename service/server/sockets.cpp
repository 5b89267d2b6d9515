#include "server/sockets.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>

#include <fcntl.h>
#include <grp.h>
#include <linux/openat2.h>
#include <netdb.h>
#include <netinet/in.h>
#include <pwd.h>
#include <sys/file.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/un.h>
#include <unistd.h>

#include "rcs/error.h"
#include "wire/errors.h"

namespace rcs::service {
namespace {

[[noreturn]] void fail(const std::string& what) { throw Error(ErrorCode::io, what + ": " + std::strerror(errno)); }

gid_t group_id(const std::string& name)
{
    const group* found = ::getgrnam(name.c_str());
    if (found == nullptr) throw Error(ErrorCode::not_found, "there is no group " + name);
    return found->gr_gid;
}

/// Makes the socket's folder, or checks that nobody else can put anything into it.
void secure_folder(const std::string& folder, const std::string& group)
{
    std::error_code ignored;
    const std::filesystem::path parent = std::filesystem::path(folder).parent_path();
    if (!parent.empty()) std::filesystem::create_directories(parent, ignored);
    if (::mkdir(folder.c_str(), 0700) != 0 && errno != EEXIST) fail("cannot make the socket's folder " + folder);
    struct stat status{};
    if (::lstat(folder.c_str(), &status) != 0) fail("cannot look at " + folder);
    if (!S_ISDIR(status.st_mode) || status.st_uid != ::getuid() || (status.st_mode & 0022) != 0) {
        throw Error(ErrorCode::io,
                    "the socket's folder " + folder + " has to be this user's own, and writable by nobody else");
    }
    if (!group.empty() &&
        (::chown(folder.c_str(), static_cast<uid_t>(-1), group_id(group)) != 0 || ::chmod(folder.c_str(), 0710) != 0)) {
        fail("cannot open " + folder + " to the group " + group);
    }
}

sockaddr_un address_of(const std::string& path)
{
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path.copy(address.sun_path, sizeof address.sun_path - 1);
    return address;
}

Fd open_beneath(int folder, const std::string& path)
{
    open_how how{};
    how.flags = O_RDONLY | O_CLOEXEC | O_NONBLOCK;
    how.resolve = RESOLVE_BENEATH | RESOLVE_NO_SYMLINKS | RESOLVE_NO_MAGICLINKS;
    return Fd(static_cast<int>(::syscall(SYS_openat2, folder, path.c_str(), &how, sizeof how)));
}

}  // namespace

UnixListener::UnixListener(const std::string& path, const std::string& group) : path_(path)
{
    std::string folder = std::filesystem::path(path).parent_path().string();
    if (folder.empty()) folder.assign(1, '.');  // assigning the literal makes gcc 12 warn of an overlap that cannot be
    secure_folder(folder, group);
    lock_ = Fd(::open((path + ".lock").c_str(), O_CREAT | O_RDWR | O_CLOEXEC | O_NOFOLLOW, 0600));
    if (!lock_) fail("cannot open " + path + ".lock");
    if (::flock(lock_.get(), LOCK_EX | LOCK_NB) != 0) throw Error(ErrorCode::io, "another server listens on " + path);
    const sockaddr_un address = address_of(path);
    const auto* generic = reinterpret_cast<const sockaddr*>(&address);
    {
        const Fd probe(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
        if (::connect(probe.get(), generic, sizeof address) == 0)
            throw Error(ErrorCode::io, "something else listens on " + path);
        struct stat status{};
        if (errno == ECONNREFUSED && ::lstat(path.c_str(), &status) == 0 && S_ISSOCK(status.st_mode))
            ::unlink(path.c_str());
    }
    fd_ = Fd(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
    const mode_t before = ::umask(group.empty() ? 0177 : 0117);
    const int bound = ::bind(fd_.get(), generic, sizeof address);
    ::umask(before);
    if (bound != 0) fail("cannot listen on " + path);
    if (!group.empty() && ::chown(path.c_str(), static_cast<uid_t>(-1), group_id(group)) != 0)
        fail("cannot give " + path + " to " + group);
    if (::listen(fd_.get(), SOMAXCONN) != 0) fail("cannot listen on " + path);
}

UnixListener::~UnixListener()
{
    if (fd_) ::unlink(path_.c_str());
}

Fd listen_tcp(const HostPort& address)
{
    addrinfo hints{};
    hints.ai_flags = AI_PASSIVE;
    hints.ai_socktype = SOCK_STREAM;
    addrinfo* list = nullptr;
    const int code = ::getaddrinfo(address.host.c_str(), address.port.c_str(), &hints, &list);
    if (code != 0)
        throw Error(ErrorCode::bad_argument, "cannot listen on " + address.host + ": " + ::gai_strerror(code));
    const std::unique_ptr<addrinfo, void (*)(addrinfo*)> owner(list, ::freeaddrinfo);
    Fd fd(::socket(list->ai_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
    const int on = 1;
    if (!fd || ::setsockopt(fd.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on) != 0 ||
        ::bind(fd.get(), list->ai_addr, list->ai_addrlen) != 0 || ::listen(fd.get(), SOMAXCONN) != 0) {
        fail("cannot listen on " + address.host + ":" + address.port);
    }
    return fd;
}

int port_of(const Fd& socket)
{
    sockaddr_storage address{};
    socklen_t size = sizeof address;
    if (::getsockname(socket.get(), reinterpret_cast<sockaddr*>(&address), &size) != 0) return 0;
    return ntohs(address.ss_family == AF_INET6 ? reinterpret_cast<const sockaddr_in6&>(address).sin6_port
                                               : reinterpret_cast<const sockaddr_in&>(address).sin_port);
}

Peer peer_of(int fd)
{
    ucred credentials{};
    socklen_t size = sizeof credentials;
    if (::getsockopt(fd, SOL_SOCKET, SO_PEERCRED, &credentials, &size) != 0) fail("cannot tell who connected");
    Peer peer{credentials.uid, {credentials.gid}};
    std::vector<gid_t> groups(1024);
    size = static_cast<socklen_t>(groups.size() * sizeof(gid_t));
    if (::getsockopt(fd, SOL_SOCKET, SO_PEERGROUPS, groups.data(), &size) == 0) {
        peer.groups.insert(peer.groups.end(), groups.begin(), groups.begin() + size / sizeof(gid_t));
    }
    return peer;
}

bool may_connect(const Peer& peer, const std::string& group)
{
    if (peer.uid == ::getuid()) return true;
    return !group.empty() && std::find(peer.groups.begin(), peer.groups.end(), group_id(group)) != peer.groups.end();
}

std::string confined_file(const std::string& path, const std::vector<std::string>& roots)
{
    const auto forbidden = [&](const char* why) {
        return ServiceError(v1::ERROR_CODE_FORBIDDEN, "scene path " + path.substr(0, 200) + " " + why);
    };
    if (path.empty() || path.front() != '/' || path.find('\0') != path.npos) throw forbidden("is no absolute path");
    for (const std::string& root : roots) {
        const std::string prefix = root.ends_with('/') ? root : root + "/";
        if (!path.starts_with(prefix)) continue;
        const Fd folder(::open(root.c_str(), O_PATH | O_DIRECTORY | O_CLOEXEC));
        const Fd file = open_beneath(folder.get(), path.substr(prefix.size()));
        if (!file && errno == ENOENT) throw ServiceError(v1::ERROR_CODE_NOT_FOUND, "scene " + path + " does not exist");
        if (!file && errno == ENOSYS) throw forbidden("cannot be confined: this kernel has no openat2");
        if (!file) throw forbidden("leads out of its root, is a symbolic link or cannot be read");
        struct stat status{};
        if (::fstat(file.get(), &status) != 0 || !S_ISREG(status.st_mode)) throw forbidden("is no regular file");
        return prefix + path.substr(prefix.size());
    }
    throw forbidden("is beneath none of the server's roots");
}

}  // namespace rcs::service
