#pragma once

#include <cstdint>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "service/drills/write_trace.h"

namespace rcs::test {

/// What of the changes that were not synced a power cut leaves.
enum class Survives { nothing, all, some };

/// A folder as a power cut would leave it: content of a file is safe once the file was synced, a name once its folder
/// was. Names of new files are not safe by syncing the file: file systems differ in that.
class CrashedState {
public:
    void apply(const FileChange& change);
    /// Makes the folder.
    void write(const std::string& folder, Survives survives, std::mt19937& random) const;

private:
    using Content = std::string;
    using Names = std::map<std::uint64_t, std::map<std::string, std::uint64_t>>;  // of folders
    struct File {
        Content safe;
        std::vector<FileChange> unsafe;
    };
    static void change_content(Content& content, const FileChange& change);
    static void change_names(Names& names, const FileChange& change);
    void sync(std::uint64_t file);

    std::map<std::uint64_t, File> files_;
    Names safe_;
    std::vector<FileChange> unsafe_;  ///< changes of names
};

}  // namespace rcs::test
