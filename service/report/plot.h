#pragma once

#include <string>
#include <vector>

namespace rcs::service {

/// A point of the plot of error against time.
struct PlotPoint {
    double seconds = 0.0;  ///< > 0
    double error = 0.0;    ///< relative, > 0
    std::string mark;      ///< short text beside it
    std::string title;     ///< said in full where there is room
};

/// What the plot shows; both axes are logarithmic.
struct PlotData {
    std::vector<PlotPoint> renders, paths;
    std::vector<std::size_t> front;  ///< indices of renders on the Pareto front, by rising time
    double noise_floor = 0.0;        ///< what the reference's own noise looks like as an error; 0: not drawn
};

/// What a shape is for; how it looks is the drawing's business.
enum class Role {
    frame,
    grid,
    tick,
    title,
    front,
    front_point,
    other_point,
    paths,
    paths_point,
    floor,
    mark,
    floor_mark
};

/// One thing to draw. Positions are pairs x, y [px] from the top left of kPlotWidth x kPlotHeight.
struct Shape {
    enum class Kind { line, disc, square, text };
    Kind kind = Kind::line;
    Role role = Role::frame;
    std::vector<double> at;  ///< a line has two pairs or more, all others have one
    std::string text;        ///< of a text
    double anchor = 0.0;     ///< which part of a text lies at its position: 0 its beginning, 0.5 its middle, 1 its end
    int render = -1;         ///< number of the point that a disc or square stands for, renders first; -1: none
    std::string title;       ///< of that point
};

inline constexpr int kPlotWidth = 820;       ///< [px]
inline constexpr int kPlotHeight = 480;      ///< [px]
inline constexpr double kPointRadius = 5.0;  ///< [px]
inline constexpr double kFontSize = 13.0;    ///< [px]

/// The one layout that the page and the picture file share.
std::vector<Shape> lay_out(const PlotData& data);

/// An <svg> element whose shapes have their role as class; colours come from the page's style sheet.
std::string to_svg(const std::vector<Shape>& shapes, const std::string& description);

}  // namespace rcs::service
