#include "service/drills/crashed_state.h"

#include <filesystem>
#include <functional>

#include "support/temporary_folder.h"

namespace rcs::test {

namespace fs = std::filesystem;
using Kind = FileChange::Kind;

void CrashedState::change_content(Content& content, const FileChange& change)
{
    if (change.kind == Kind::cut) {
        content.resize(change.offset);
        return;
    }
    if (content.size() < change.offset + change.data.size()) content.resize(change.offset + change.data.size());
    content.replace(change.offset, change.data.size(), change.data);
}

void CrashedState::change_names(Names& names, const FileChange& change)
{
    switch (change.kind) {
        case Kind::make_file:
        case Kind::make_folder:
            names[change.folder][change.name] = change.file;
            break;
        case Kind::link:
            names[change.to_folder][change.to_name] = change.file;
            break;
        case Kind::rename:
            names[change.folder].erase(change.name);
            names[change.to_folder][change.to_name] = change.file;
            break;
        default:
            names[change.folder].erase(change.name);
    }
}

void CrashedState::apply(const FileChange& change)
{
    switch (change.kind) {
        case Kind::write:
        case Kind::cut:
            files_[change.file].unsafe.push_back(change);
            break;
        case Kind::sync:
            sync(change.file);
            break;
        default:
            if (change.kind == Kind::make_file) files_[change.file];
            unsafe_.push_back(change);
    }
}

void CrashedState::sync(std::uint64_t file)
{
    if (const auto found = files_.find(file); found != files_.end()) {
        for (const FileChange& change : found->second.unsafe) change_content(found->second.safe, change);
        found->second.unsafe.clear();
        return;
    }
    std::erase_if(unsafe_, [&](const FileChange& change) {
        if (change.folder != file && change.to_folder != file) return false;
        change_names(safe_, change);
        return true;
    });
}

void CrashedState::write(const std::string& folder, Survives survives, std::mt19937& random) const
{
    const auto is_kept = [&] { return survives == Survives::all || (survives == Survives::some && random() % 2 == 0); };
    Names names = safe_;
    for (const FileChange& change : unsafe_) {
        if (is_kept()) change_names(names, change);
    }
    std::map<std::uint64_t, std::string> written;
    const std::function<void(std::uint64_t, const std::string&)> write_folder = [&](std::uint64_t inode,
                                                                                    const std::string& path) {
        fs::create_directory(path);
        fs::permissions(path, fs::perms::owner_all);
        for (const auto& [name, file] : names[inode]) {
            const std::string to = path + "/" + name;
            const auto found = files_.find(file);
            if (found == files_.end()) {
                write_folder(file, to);
            } else if (const auto [first, is_new] = written.try_emplace(file, to); is_new) {
                Content content = found->second.safe;
                for (const FileChange& change : found->second.unsafe) {
                    if (is_kept()) change_content(content, change);
                }
                write_bytes(to, content);
            } else {
                fs::create_hard_link(first->second, to);
            }
        }
    };
    write_folder(WriteTrace::kRoot, folder);
}

}  // namespace rcs::test
