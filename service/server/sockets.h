#pragma once

#include <string>
#include <vector>

#include "server/config.h"
#include "wire/files.h"

namespace rcs::service {

/// A Unix socket that only this user, and a group, can reach. Its file is made under a umask in a private folder; one
/// that a dead server left is removed, under a lock, once nobody answers on it.
class UnixListener {
public:
    /// @param group  "" for none @throws rcs::Error io: another server listens; the folder is open to others
    UnixListener(const std::string& path, const std::string& group);
    ~UnixListener();
    UnixListener(const UnixListener&) = delete;
    UnixListener& operator=(const UnixListener&) = delete;

    int fd() const { return fd_.get(); }

private:
    std::string path_;
    Fd lock_, fd_;
};

/// @throws rcs::Error io, bad_argument
Fd listen_tcp(const HostPort& address);
int port_of(const Fd& socket);

/// Who connected to a Unix socket, as the kernel says.
struct Peer {
    unsigned uid = 0;
    std::vector<unsigned> groups;
};
Peer peer_of(int fd);
/// @param group  "" for none
bool may_connect(const Peer& peer, const std::string& group);

/// A scene by path, if it is a file beneath one of `roots` and no part of its way there is a symbolic link; opened that
/// way once, to see. @return its true path @throws ServiceError forbidden, not_found
std::string confined_file(const std::string& path, const std::vector<std::string>& roots);

}  // namespace rcs::service
