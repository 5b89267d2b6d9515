#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace rcs::service {

/// A letter as a raster.
struct Glyph {
    int left = 0, top = 0;  ///< of its box: from the pen to the right, from the baseline upwards [px]
    int width = 0, height = 0;
    double advance = 0.0;              ///< of the pen to the next one [px]
    std::vector<std::uint8_t> covers;  ///< row by row, of 255

    /// How much of a pixel it covers, in [0, 1]; 0 outside of its box.
    double cover(int x, int y) const;
};

/// DejaVu Sans, drawn by FreeType.
class Font {
public:
    /// @param size  of an em [px]
    /// @throws rcs::Error not_found that names the package to install
    explicit Font(double size);

    /// The letters of a text in UTF-8, one after the other.
    std::vector<Glyph> glyphs(const std::string& text) const;

private:
    struct Face;
    std::shared_ptr<Face> face_;
};

}  // namespace rcs::service
