#include "report/raster.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>

#include <glm/glm.hpp>

#include "rcs/error.h"
#include "report/font.h"

namespace rcs::service {
namespace {

constexpr double kScale = 2.0;  ///< pixels for each of the layout's

/// How a role looks on white.
struct Style {
    glm::vec3 color;
    double width;  ///< of lines [px of the layout]
    bool dashed = false;
    bool hollow = false;  ///< of discs and squares
};

Style style_of(Role role)
{
    const glm::vec3 ink(0.12f, 0.14f, 0.18f), faint(0.88f), blue(0.04f, 0.36f, 0.75f), orange(0.76f, 0.34f, 0.03f);
    const glm::vec3 grey(0.40f, 0.43f, 0.48f);
    switch (role) {
        case Role::grid:
            return {faint, 1.0};
        case Role::front:
        case Role::front_point:
            return {blue, 2.0};
        case Role::other_point:
            return {blue, 2.0, false, true};
        case Role::paths:
        case Role::paths_point:
            return {orange, 2.0};
        case Role::floor:
            return {grey, 1.5, true};
        case Role::floor_mark:
        case Role::tick:
            return {grey, 0.0};
        case Role::frame:
        case Role::title:
        case Role::mark:
            return {ink, 1.0};
    }
    return {ink, 1.0};
}

/// Blends `color` over the pixels of a box by their cover, which is a function of the pixel's centre [px of the image].
void paint(Image& image, glm::dvec2 least, glm::dvec2 most, glm::vec3 color,
           const std::function<double(glm::dvec2)>& cover)
{
    const int x_end = std::min(image.width, static_cast<int>(std::ceil(most.x)) + 1);
    const int y_end = std::min(image.height, static_cast<int>(std::ceil(most.y)) + 1);
    for (int y = std::max(0, static_cast<int>(least.y) - 1); y < y_end; ++y) {
        for (int x = std::max(0, static_cast<int>(least.x) - 1); x < x_end; ++x) {
            const auto part = static_cast<float>(std::clamp(cover({x + 0.5, y + 0.5}), 0.0, 1.0));
            for (int c = 0; c < 3; ++c) image.at(x, y)[c] += part * (color[c] - image.at(x, y)[c]);
        }
    }
}

void draw_line(Image& image, glm::dvec2 a, glm::dvec2 b, const Style& style)
{
    const double half = 0.5 * style.width * kScale;
    const double length = glm::length(b - a);
    if (length == 0.0) return;
    const glm::dvec2 along = (b - a) / length;
    paint(image, glm::min(a, b) - half, glm::max(a, b) + half, style.color, [&](glm::dvec2 p) {
        const double t = glm::dot(p - a, along);
        if (style.dashed && std::fmod(std::max(t, 0.0), 12.0 * kScale) > 7.0 * kScale) return 0.0;
        return half + 0.5 - glm::length(p - a - std::clamp(t, 0.0, length) * along);
    });
}

/// A disc or square by its distance function, which is negative inside.
void draw_point(Image& image, glm::dvec2 center, const Style& style, bool disc)
{
    const double radius = kPointRadius * kScale;
    const auto distance = [&](glm::dvec2 p) {
        const glm::dvec2 d = glm::abs(p - center);
        return (disc ? glm::length(d) : std::max(d.x, d.y)) - radius;
    };
    paint(image, center - radius, center + radius, style.color, [&](glm::dvec2 p) { return 0.5 - distance(p); });
    if (!style.hollow) return;
    const double rim = style.width * kScale;
    paint(image, center - radius, center + radius, glm::vec3(1.0f),
          [&](glm::dvec2 p) { return 0.5 - distance(p) - rim; });
}

/// What a raster needs beside the picture.
Font plot_font() { return Font(kFontSize * kScale); }

/// @param shape  its text begins, is centred or ends at its place, by its anchor
void draw_text(Image& image, const Font& font, const Shape& shape, const Style& style)
{
    const std::vector<Glyph> glyphs = font.glyphs(shape.text);
    double width = 0.0;
    for (const Glyph& glyph : glyphs) width += glyph.advance;
    double pen = std::round(shape.at[0] * kScale - shape.anchor * width);
    const double baseline = std::round(shape.at[1] * kScale);
    for (const Glyph& glyph : glyphs) {
        const glm::dvec2 corner(pen + glyph.left, baseline - glyph.top);
        paint(image, corner, corner + glm::dvec2(glyph.width, glyph.height), style.color, [&](glm::dvec2 p) {
            return glyph.cover(static_cast<int>(std::floor(p.x - corner.x)),
                               static_cast<int>(std::floor(p.y - corner.y)));
        });
        pen += glyph.advance;
    }
}

void draw(Image& image, const Font& font, const Shape& shape)
{
    const Style style = style_of(shape.role);
    const glm::dvec2 first = kScale * glm::dvec2(shape.at[0], shape.at[1]);
    switch (shape.kind) {
        case Shape::Kind::line:
            for (std::size_t i = 2; i + 1 < shape.at.size(); i += 2) {
                draw_line(image, kScale * glm::dvec2(shape.at[i - 2], shape.at[i - 1]),
                          kScale * glm::dvec2(shape.at[i], shape.at[i + 1]), style);
            }
            break;
        case Shape::Kind::disc:
        case Shape::Kind::square:
            draw_point(image, first, style, shape.kind == Shape::Kind::disc);
            break;
        case Shape::Kind::text:
            draw_text(image, font, shape, style);
            break;
    }
}

}  // namespace

void check_plot_font() { plot_font(); }

Image raster(const std::vector<Shape>& shapes)
{
    Image image(static_cast<int>(kPlotWidth * kScale), static_cast<int>(kPlotHeight * kScale), 3);
    std::fill(image.pixels.begin(), image.pixels.end(), 1.0f);
    const Font font = plot_font();
    for (const Shape& shape : shapes) draw(image, font, shape);
    return image;
}

}  // namespace rcs::service
