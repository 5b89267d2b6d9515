#pragma once

#include <cstdio>
#include <filesystem>
#include <string>

namespace rcs {

/// A file that appears under its name only when it is complete: it is written beside it as
/// ".NAME.tmp-PID" and renamed by commit(). Without commit() nothing is left behind.
class FileWriter {
public:
    /// @throws Error io: the folder is missing or cannot be written to, or `path` is no regular file
    explicit FileWriter(const std::string& path);
    ~FileWriter();
    FileWriter(const FileWriter&) = delete;
    FileWriter& operator=(const FileWriter&) = delete;

    std::FILE* file() noexcept { return file_; }

    /// Flushes, closes and renames. @throws Error io if any byte did not reach the file
    void commit();

private:
    std::string path_;  ///< as the user wrote it, for messages
    std::filesystem::path target_;
    std::filesystem::path temporary_;
    std::FILE* file_ = nullptr;
};

}  // namespace rcs
