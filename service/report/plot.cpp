#include "report/plot.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "report/encoding.h"

namespace rcs::service {
namespace {

constexpr double kLeft = 64.0, kRight = kPlotWidth - 22.0, kTop = 40.0, kBottom = kPlotHeight - 52.0;

/// A logarithmic axis and where it lies in the plot [px].
struct Axis {
    double least, most;  ///< values at the ends
    double begin, end;   ///< their positions [px]

    double place(double value) const
    {
        return begin + (end - begin) * std::log(value / least) / std::log(most / least);
    }
    bool holds(double value) const { return value >= least * (1.0 - 1e-9) && value <= most * (1.0 + 1e-9); }
};

/// With room on both sides, and at least a factor of 4 from end to end.
Axis axis_over(const std::vector<double>& values, double begin, double end)
{
    auto [low, high] = std::minmax_element(values.begin(), values.end());
    double least = values.empty() ? 0.1 : *low / 1.35;
    double most = values.empty() ? 1.0 : *high * 1.35;
    const double missing = std::max(1.0, 4.0 / (most / least));
    return {least / std::sqrt(missing), most * std::sqrt(missing), begin, end};
}

/// Times that a person counts in, [s]: 1, 2 and 5 times the powers of ten below a minute, then minutes and hours.
std::vector<double> time_ticks(const Axis& axis)
{
    std::vector<double> ticks;
    const auto add = [&](double seconds) {
        if (axis.holds(seconds)) ticks.push_back(seconds);
    };
    for (int power = -4; power < 2; ++power) {
        for (const double digit : {1.0, 2.0, 5.0}) {
            if (power < 1 || digit < 5.0) add(digit * std::pow(10.0, power));
        }
    }
    for (const double minutes : {1.0, 2.0, 5.0, 10.0, 20.0, 60.0, 120.0, 300.0, 600.0, 1440.0, 4320.0})
        add(60.0 * minutes);
    return ticks;
}

/// 1, 2 and 5 times the powers of ten that the axis holds; only the powers where those are many.
std::vector<double> error_ticks(const Axis& axis)
{
    const bool wide = axis.most / axis.least > 2e4;
    std::vector<double> ticks;
    for (int power = static_cast<int>(std::floor(std::log10(axis.least))); std::pow(10.0, power) <= axis.most;
         ++power) {
        for (const double digit : {1.0, 2.0, 5.0}) {
            const double value = digit * std::pow(10.0, power);
            if (axis.holds(value) && (digit == 1.0 || !wide)) ticks.push_back(value);
        }
    }
    return ticks;
}

Shape line(Role role, std::vector<double> at) { return {Shape::Kind::line, role, std::move(at), {}, 0.0, -1, {}}; }

Shape text(Role role, double x, double y, std::string words, double anchor)
{
    return {Shape::Kind::text, role, {x, y}, std::move(words), anchor, -1, {}};
}

void add_axes(std::vector<Shape>& shapes, const Axis& x, const Axis& y)
{
    for (const double seconds : time_ticks(x)) {
        const double at = x.place(seconds);
        shapes.push_back(line(Role::grid, {at, kTop, at, kBottom}));
        shapes.push_back(text(Role::tick, at, kBottom + 18.0, duration_text(seconds), 0.5));
    }
    for (const double error : error_ticks(y)) {
        const double at = y.place(error);
        shapes.push_back(line(Role::grid, {kLeft, at, kRight, at}));
        shapes.push_back(text(Role::tick, kLeft - 8.0, at + 4.5, percent_text(error), 1.0));
    }
    shapes.push_back(line(Role::frame, {kLeft, kTop, kLeft, kBottom, kRight, kBottom}));
    shapes.push_back(text(Role::title, 0.5 * (kLeft + kRight), kPlotHeight - 10.0, "time of the image", 0.5));
}

void add_legend(std::vector<Shape>& shapes)
{
    const double y = 16.0;
    shapes.push_back(text(Role::title, 8.0, y + 4.5, "mean relative error of the indirect light", 0.0));
    double x = 330.0;
    const auto entry = [&](Shape::Kind kind, Role role, const char* words, double width) {
        shapes.push_back({kind, role, {x, y}, {}, 0.0, -1, {}});
        shapes.push_back(text(Role::tick, x + 11.0, y + 4.5, words, 0.0));
        x += width;
    };
    entry(Shape::Kind::disc, Role::front_point, "splatting, best for its time", 200.0);
    entry(Shape::Kind::disc, Role::other_point, "splatting, beaten", 140.0);
    entry(Shape::Kind::square, Role::paths_point, "path tracer", 100.0);
}

/// The mark stands above the point to its right, or near the right end below it to its left.
void add_point(std::vector<Shape>& shapes, const PlotPoint& point, const Axis& x, const Axis& y, Shape shape)
{
    shape.at = {x.place(point.seconds), y.place(point.error)};
    shape.title = point.title;
    const bool at_end = shape.at[0] > kRight - 60.0;
    shapes.push_back(text(Role::mark, shape.at[0] + (at_end ? 4.0 : 7.0), shape.at[1] + (at_end ? 20.0 : -7.0),
                          point.mark, at_end ? 1.0 : 0.0));
    shapes.push_back(std::move(shape));
}

std::vector<double> path_of(const std::vector<PlotPoint>& points, const Axis& x, const Axis& y)
{
    std::vector<double> at;
    for (const PlotPoint& point : points) {
        at.push_back(x.place(point.seconds));
        at.push_back(y.place(point.error));
    }
    return at;
}

void add_points(std::vector<Shape>& shapes, const PlotData& data, const Axis& x, const Axis& y)
{
    std::vector<PlotPoint> best;
    for (const std::size_t i : data.front) best.push_back(data.renders[i]);
    if (best.size() > 1) shapes.push_back(line(Role::front, path_of(best, x, y)));
    if (data.paths.size() > 1) shapes.push_back(line(Role::paths, path_of(data.paths, x, y)));
    int number = 0;
    for (std::size_t i = 0; i < data.renders.size(); ++i) {
        const bool on_front = std::find(data.front.begin(), data.front.end(), i) != data.front.end();
        const Role role = on_front ? Role::front_point : Role::other_point;
        add_point(shapes, data.renders[i], x, y, {Shape::Kind::disc, role, {}, {}, 0.0, number++, {}});
    }
    for (const PlotPoint& point : data.paths)
        add_point(shapes, point, x, y, {Shape::Kind::square, Role::paths_point, {}, {}, 0.0, number++, {}});
}

const char* class_of(Role role)
{
    switch (role) {
        case Role::frame:
            return "frame";
        case Role::grid:
            return "grid";
        case Role::tick:
            return "tick";
        case Role::title:
            return "title";
        case Role::front:
            return "front";
        case Role::front_point:
            return "front-point";
        case Role::other_point:
            return "other-point";
        case Role::paths:
            return "paths";
        case Role::paths_point:
            return "paths-point";
        case Role::floor:
            return "floor";
        case Role::mark:
            return "mark";
        case Role::floor_mark:
            return "floor-mark";
    }
    return "";
}

std::string number(double value)
{
    char digits[32];
    std::snprintf(digits, sizeof digits, "%.1f", value);
    return digits;
}

std::string attribute(const char* name, const std::string& value)
{
    return std::string(" ") + name + "=\"" + value + "\"";
}

std::string element_of(const Shape& shape)
{
    const std::string look = attribute("class", class_of(shape.role));
    const double x = shape.at[0], y = shape.at[1], r = kPointRadius;
    switch (shape.kind) {
        case Shape::Kind::line: {
            std::string points;
            for (std::size_t i = 0; i < shape.at.size(); ++i)
                points.append(i == 0 ? "" : i % 2 == 0 ? " " : ",").append(number(shape.at[i]));
            return "<polyline" + look + attribute("points", points) + "/>";
        }
        case Shape::Kind::disc:
            return "<circle" + look + attribute("cx", number(x)) + attribute("cy", number(y)) +
                   attribute("r", number(r)) + "/>";
        case Shape::Kind::square:
            return "<rect" + look + attribute("x", number(x - r)) + attribute("y", number(y - r)) +
                   attribute("width", number(2 * r)) + attribute("height", number(2 * r)) + "/>";
        case Shape::Kind::text:
            break;
    }
    const char* anchor = shape.anchor == 0.0 ? "start" : shape.anchor == 1.0 ? "end" : "middle";
    return "<text" + look + attribute("x", number(x)) + attribute("y", number(y)) + attribute("text-anchor", anchor) +
           ">" + html_escape(shape.text) + "</text>";
}

}  // namespace

std::vector<Shape> lay_out(const PlotData& data)
{
    std::vector<double> seconds, errors;
    for (const std::vector<PlotPoint>* points : {&data.renders, &data.paths}) {
        for (const PlotPoint& point : *points) {
            seconds.push_back(point.seconds);
            errors.push_back(point.error);
        }
    }
    if (data.noise_floor > 0.0) errors.push_back(data.noise_floor);
    const Axis x = axis_over(seconds, kLeft, kRight);
    const Axis y = axis_over(errors, kBottom, kTop);
    std::vector<Shape> shapes;
    add_axes(shapes, x, y);
    add_legend(shapes);
    if (data.noise_floor > 0.0) {
        const double at = y.place(data.noise_floor);
        shapes.push_back(line(Role::floor, {kLeft, at, kRight, at}));
        shapes.push_back(text(Role::floor_mark, kLeft + 8.0, at - 6.0,
                              "noise of the reference, " + percent_text(data.noise_floor), 0.0));
    }
    add_points(shapes, data, x, y);
    return shapes;
}

std::string to_svg(const std::vector<Shape>& shapes, const std::string& description)
{
    std::string svg = "<svg id=\"plot\" viewBox=\"0 0 " + std::to_string(kPlotWidth) + " " +
                      std::to_string(kPlotHeight) + "\" role=\"group\" aria-label=\"" + html_escape(description) +
                      "\">\n";
    for (const Shape& shape : shapes) {
        const std::string element = element_of(shape);
        if (shape.render < 0) {
            svg += element + "\n";
            continue;
        }
        svg += "<a href=\"#point\"" + attribute("data-point", std::to_string(shape.render)) +
               attribute("aria-label", html_escape(shape.title)) + "><title>" + html_escape(shape.title) + "</title>" +
               element + "</a>\n";
    }
    return svg + "</svg>\n";
}

}  // namespace rcs::service
