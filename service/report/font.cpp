#include "report/font.h"

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <sstream>
#include <string_view>

#include <ft2build.h>
#include FT_FREETYPE_H

#include "rcs/error.h"

namespace rcs::service {
namespace {

namespace fs = std::filesystem;

constexpr const char* kFile = "DejaVuSans.ttf";

/// The folders of fonts by the XDG base directory specification.
std::vector<fs::path> font_folders()
{
    const auto value = [](const char* name) {
        const char* const text = std::getenv(name);
        return std::string(text ? text : "");
    };
    std::vector<fs::path> folders;
    const std::string own = value("XDG_DATA_HOME"), home = value("HOME"), shared = value("XDG_DATA_DIRS");
    if (!own.empty())
        folders.push_back(fs::path(own) / "fonts");
    else if (!home.empty())
        folders.push_back(fs::path(home) / ".local/share/fonts");
    std::istringstream all(shared.empty() ? "/usr/local/share:/usr/share" : shared);
    for (std::string folder; std::getline(all, folder, ':');)
        if (!folder.empty()) folders.push_back(fs::path(folder) / "fonts");
    return folders;
}

fs::path font_file()
{
    for (const fs::path& folder : font_folders()) {
        std::error_code ignored;
        const auto options = fs::directory_options::skip_permission_denied;
        for (fs::recursive_directory_iterator i(folder, options, ignored), end; i != end; i.increment(ignored))
            if (i->path().filename() == kFile) return i->path();
    }
    throw Error(ErrorCode::not_found,
                "the plot needs the font DejaVu Sans, which is not installed; Debian's package is fonts-dejavu-core");
}

/// Takes the next code point off a text in UTF-8; what is none becomes U+FFFD.
char32_t take_code_point(std::string_view& text)
{
    const auto lead = static_cast<unsigned char>(text.front());
    const std::size_t more = lead < 0x80 ? 0 : lead < 0xe0 ? 1 : lead < 0xf0 ? 2 : 3;
    if ((lead >= 0x80 && lead < 0xc2) || lead > 0xf4 || text.size() <= more) {
        text.remove_prefix(1);
        return 0xfffd;
    }
    char32_t code = more == 0 ? lead : lead & (0x3fu >> more);
    for (std::size_t i = 1; i <= more; ++i) code = code << 6 | (static_cast<unsigned char>(text[i]) & 0x3fu);
    text.remove_prefix(1 + more);
    return code;
}

}  // namespace

struct Font::Face {
    FT_Library library = nullptr;
    FT_Face face = nullptr;

    Face() = default;
    Face(const Face&) = delete;
    ~Face()
    {
        FT_Done_Face(face);
        FT_Done_FreeType(library);
    }
};

double Glyph::cover(int x, int y) const
{
    if (x < 0 || y < 0 || x >= width || y >= height) return 0.0;
    return covers[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)] / 255.0;
}

Font::Font(double size) : face_(std::make_shared<Face>())
{
    const fs::path file = font_file();
    if (FT_Init_FreeType(&face_->library) != 0 || FT_New_Face(face_->library, file.c_str(), 0, &face_->face) != 0 ||
        FT_Set_Pixel_Sizes(face_->face, 0, static_cast<FT_UInt>(std::lround(size))) != 0)
        throw Error(ErrorCode::bad_file, "cannot read the font " + file.string());
}

std::vector<Glyph> Font::glyphs(const std::string& text) const
{
    std::vector<Glyph> glyphs;
    for (std::string_view rest = text; !rest.empty();) {
        if (FT_Load_Char(face_->face, take_code_point(rest), FT_LOAD_RENDER) != 0) continue;
        const FT_GlyphSlot slot = face_->face->glyph;
        const FT_Bitmap& bitmap = slot->bitmap;
        Glyph glyph{slot->bitmap_left,
                    slot->bitmap_top,
                    static_cast<int>(bitmap.width),
                    static_cast<int>(bitmap.rows),
                    static_cast<double>(slot->advance.x) / 64.0,
                    {}};
        for (unsigned y = 0; y < bitmap.rows; ++y) {
            const unsigned char* const row = bitmap.buffer + static_cast<std::ptrdiff_t>(y) * bitmap.pitch;
            glyph.covers.insert(glyph.covers.end(), row, row + bitmap.width);
        }
        glyphs.push_back(std::move(glyph));
    }
    return glyphs;
}

}  // namespace rcs::service
