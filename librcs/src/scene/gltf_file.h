#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "rcs/error.h"
#include "rcs/log.h"
#include "rcs/scene.h"

namespace rcs {

/// A kind of thing that a file asks for and the render leaves out or mends; makes one line of the log.
struct GltfNoteKind {
    const char* what;  ///< "normal textures"
    const char* noun;  ///< what is named in the list, singular: "material"
    const char* done;  ///< "ignored"
};

/// Notes of one file, by kind, in the order of their first appearance.
class GltfNotes {
public:
    /// @param kind  a constant: its address tells kinds apart   @param count  of things in `name`; 0 prints none
    void add(const GltfNoteKind& kind, const std::string& name, std::size_t count = 0);
    /// "sibenik.glb: normal textures in 2 materials (floor, columns): ignored"
    void write(const std::string& file, const LogFunction& log) const;

private:
    struct Entry {
        const GltfNoteKind* kind;
        std::size_t count;
        std::vector<std::string> names;
    };
    std::vector<Entry> entries_;
};

/// The scene file that is being loaded, as messages and relative paths need it.
struct GltfFile {
    std::string path;              ///< as given
    std::filesystem::path folder;  ///< where its buffers and images lie
    GltfNotes* notes = nullptr;
    std::filesystem::path root = {};  ///< beneath which they may lie, "" for the folder itself
    const Scene* like = nullptr;      ///< as LoadOptions::like
};

[[noreturn]] inline void fail(const GltfFile& file, ErrorCode code, const std::string& what)
{
    throw Error(code, file.path + ": " + what);
}
[[noreturn]] inline void bad_file(const GltfFile& file, const std::string& what)
{
    fail(file, ErrorCode::bad_file, what);
}

/// What other libraries write over several lines, as one: line ends become "; ".
std::string on_one_line(const std::string& text);

/// "mesh 3 'floor'", or "mesh 3" if it has no name.
inline std::string element_name(const char* kind, std::size_t index, const std::string& name)
{
    return std::string(kind) + " " + std::to_string(index) + (name.empty() ? "" : " '" + name + "'");
}
/// The same for lists in notes: the name, or its number.
inline std::string short_name(std::size_t index, const std::string& name)
{
    return name.empty() ? "number " + std::to_string(index) : name;
}

/// @throws Error not_found, bad_file (a folder), io
std::vector<unsigned char> read_file(const std::filesystem::path& path, const std::string& what);

}  // namespace rcs
