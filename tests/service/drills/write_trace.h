#pragma once

#include <atomic>
#include <cstdint>
#include <map>
#include <string>
#include <thread>
#include <vector>

#include <sys/types.h>

namespace rcs::test {

/// A change of a file system, or a promise about one. Files and folders have numbers that are given once.
struct FileChange {
    enum class Kind { make_file, make_folder, write, cut, link, rename, remove, sync } kind{};
    std::uint64_t file = 0;  ///< whose content or whose names
    std::uint64_t folder = 0, to_folder = 0;
    std::string name{}, to_name{};  ///< in these folders
    std::string data{};             ///< written
    std::uint64_t offset = 0;       ///< of the data; the size after a cut [bytes]
};

/// Runs programs and puts down what they and all their children do to the files of a folder (ptrace; a seccomp filter
/// says which system calls are looked at).
class WriteTrace {
public:
    /// @param folder  exists, is empty
    explicit WriteTrace(const std::string& folder);

    /// Runs a command; stderr goes to `log`. One at a time.
    void start(std::vector<std::string> words, const std::string& log);
    pid_t pid() const { return pid_; }
    /// Sends a signal, and waits until the command and all its children have ended.
    void end(int signal);

    /// How much has happened so far. What another process was told of by now happened before.
    std::size_t size() const { return size_; }
    /// Once it has ended.
    const std::vector<FileChange>& changes() const { return changes_; }
    static constexpr std::uint64_t kRoot = 1;  ///< the folder's number

private:
    struct Call {
        std::uint64_t number = 0, arguments[6] = {};
        std::uint64_t file = 0, gone = 0;  ///< inodes: that a name stood for before, and that goes with the call
    };
    void run(const std::vector<std::string>& words, const std::string& log);
    void follow();
    void before(pid_t process);
    void after(pid_t process);
    void opened(pid_t process, int fd, bool cut);
    void written(pid_t process, const Call& call, std::uint64_t count);
    void named(pid_t process, const Call& call);
    void append(FileChange change);
    std::uint64_t known_file(pid_t process, int fd) const;  ///< 0: none of this folder
    std::uint64_t known(std::uint64_t inode) const;
    std::uint64_t learned(std::uint64_t inode);
    bool place(const std::string& path, std::uint64_t& folder, std::string& name) const;

    std::string folder_;
    std::thread thread_;
    std::atomic<pid_t> pid_ = 0;
    std::atomic<std::size_t> size_ = 0;
    std::map<pid_t, Call> calls_;
    std::map<std::uint64_t, std::uint64_t> known_;  ///< numbers of inodes
    std::uint64_t last_ = kRoot;
    std::vector<FileChange> changes_;
};

}  // namespace rcs::test
