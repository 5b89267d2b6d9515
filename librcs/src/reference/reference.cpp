#include "rcs/reference.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "rcs/error.h"
#include "reference/block_means.h"
#include "reference/path_tracer.h"
#include "util/random.h"

namespace rcs {
namespace {

void check_range(const char* field, int value, int low, int high)
{
    if (value >= low && value <= high) return;
    throw Error(ErrorCode::bad_argument, std::string("reference.") + field + " is " + std::to_string(value) +
                                             ", expected a value in [" + std::to_string(low) + ", " +
                                             std::to_string(high) + "]");
}

void validate(const View& view, const ReferenceOptions& options)
{
    check_range("width", view.width, 1, 16384);
    check_range("height", view.height, 1, 16384);
    check_range("samples", options.samples, 16, 1 << 20);
    check_range("first_sample", options.first_sample, 0, (1 << 20) - options.samples);
    check_range("bounces", options.bounces, 0, 64);
    check_range("aa", options.aa, 1, 256);
    if (options.lens && (options.aa == 1 || view.camera.projection != Projection::perspective))
        throw Error(ErrorCode::bad_argument, "reference.lens is given, expected so with aa > 1 and perspective alone");
    // Below twice the smaller side, pixel stride/2 lies within the image.
    check_range("stride", options.stride, 1, 2 * std::min(view.width, view.height) - 1);
}

/// How many of stride/2 + i stride lie within an image axis.
int traced_count(int size, int stride) { return (size - stride / 2 + stride - 1) / stride; }

/// Sums over the paths of one pixel.
struct PixelSums {
    glm::dvec3 emission{0.0}, direct{0.0}, albedo{0.0}, normal{0.0};
    double distance = 0.0;
    int covered = 0;
    BlockMeans beauty, indirect;

    void add_geometry(const Seen& seen)
    {
        if (seen.count == 0) return;
        const VisiblePoint& point = seen.layers.front().point;
        albedo += glm::dvec3(point.albedo);
        normal += glm::dvec3(point.surface.shading_normal);
        distance += point.distance;
        ++covered;
    }
};

/// What a thread keeps between pixels, so that paths allocate nothing.
struct Scratch {
    Seen seen;
    LampsAtPoint lamps;
};

/// A ray through the middle of the lens becomes the one through another point that meets it in focus.
/// @param random  in the unit square
void bend(const Camera& camera, const Lens& lens, glm::vec2 random, CameraRay& ray)
{
    const double radius = 0.5 * lens.diameter * std::sqrt(static_cast<double>(random.x));
    const double angle = 2.0 * std::numbers::pi * static_cast<double>(random.y);
    const glm::dvec3 right(camera.world_from_view[0]), up(camera.world_from_view[1]);
    const glm::dvec3 beside = radius * (std::cos(angle) * right + std::sin(angle) * up);
    ray.origin += beside;
    ray.direction -= beside / lens.focus;  // of depth 1
}

PixelSums trace_pixel(const PathTracer& tracer, const View& view, const ReferenceOptions& options, int samples, int x,
                      int y, Scratch& scratch)
{
    PixelSums sums;
    const std::size_t pixel =
        static_cast<std::size_t>(y) * static_cast<std::size_t>(view.width) + static_cast<std::size_t>(x);
    PathPoints points{.index = 0, .key = stream_key(options.seed, Stream::reference, pixel_number(view, pixel))};
    const bool one_point = options.aa == 1;
    if (one_point)
        tracer.look(camera_ray(view, x + view.pixel_offset.x, y + view.pixel_offset.y), Lamps::with_area, scratch.seen);

    const int block_size = BlockMeans::block_size(samples);
    for (int begin = 0; begin < samples; begin += block_size) {
        const int end = std::min(begin + block_size, samples);
        glm::dvec3 indirect(0.0), others(0.0);
        for (int i = begin; i < end; ++i) {
            points.index = static_cast<std::uint32_t>(options.first_sample + i);
            if (!one_point) {
                const glm::dvec2 offset(points.pair(kPixelPair));
                CameraRay ray = camera_ray(view, x + offset.x, y + offset.y);
                if (options.lens) bend(view.camera, *options.lens, points.pair(kLensPair), ray);
                tracer.look(ray, Lamps::all, scratch.seen);
            }
            const PathResult path = tracer.trace(scratch.seen, points, scratch.lamps);
            sums.add_geometry(scratch.seen);
            sums.emission += glm::dvec3(path.emission);
            sums.direct += glm::dvec3(path.direct);
            others += glm::dvec3(path.emission) + glm::dvec3(path.direct);
            indirect += glm::dvec3(path.indirect);
        }
        sums.indirect.add(indirect, end - begin);
        sums.beauty.add(indirect + others, end - begin);
    }
    return sums;
}

void store(Image& layer, int x, int y, glm::dvec3 value)
{
    float* const p = layer.at(x, y);
    for (int c = 0; c < 3; ++c) p[c] = static_cast<float>(value[c]);
}

void store(LayeredImage& image, int x, int y, const PixelSums& sums, int samples)
{
    const double n = samples;
    auto& layers = image.layers;
    store(layers.at("beauty"), x, y, sums.beauty.mean());
    layers.at("beauty").at(x, y)[3] = static_cast<float>(sums.covered / n);
    store(layers.at("emission"), x, y, sums.emission / n);
    store(layers.at("direct"), x, y, sums.direct / n);
    store(layers.at("indirect"), x, y, sums.indirect.mean());
    store(layers.at("albedo"), x, y, sums.albedo / n);
    const double normal_length = glm::length(sums.normal);
    store(layers.at("normal"), x, y, normal_length > 0.0 ? sums.normal / normal_length : glm::dvec3(0.0));
    *layers.at("depth").at(x, y) =
        sums.covered > 0 ? static_cast<float>(sums.distance / sums.covered) : std::numeric_limits<float>::infinity();
    store(layers.at("standard_error"), x, y, sums.beauty.standard_error());
    store(layers.at("indirect_standard_error"), x, y, sums.indirect.standard_error());
}

LayeredImage make_layers(int width, int height, const ReferenceOptions& options, int samples)
{
    LayeredImage image;
    image.layers.emplace("beauty", Image(width, height, 4));
    image.layers.emplace("depth", Image(width, height, 1));
    for (const char* name :
         {"emission", "direct", "indirect", "albedo", "normal", "standard_error", "indirect_standard_error"})
        image.layers.emplace(name, Image(width, height, 3));
    image.metadata = {{"rcs:stride", std::to_string(options.stride)},
                      {"rcs:samples", std::to_string(samples)},
                      {"rcs:first-sample", std::to_string(options.first_sample)},
                      {"rcs:bounces", std::to_string(options.bounces)},
                      {"rcs:aa", std::to_string(options.aa)},
                      {"rcs:seed", std::to_string(options.seed)}};
    return image;
}

}  // namespace

LayeredImage render_reference(const RayScene& rays, const View& view, const ReferenceOptions& options, ThreadPool& pool,
                              const ProgressFunction& progress)
{
    validate(view, options);
    const int samples = (options.samples + 15) / 16 * 16;
    const int width = traced_count(view.width, options.stride);
    const int height = traced_count(view.height, options.stride);
    LayeredImage image = make_layers(width, height, options, samples);
    if (view.whole != glm::ivec2(0) && options.stride == 1)
        image.window = ImageWindow{view.corner.x, view.corner.y, view.whole.x, view.whole.y};

    const PathTracer tracer(rays, view, options);
    std::vector<Scratch> scratch(static_cast<std::size_t>(pool.size()));
    const auto trace = [&](std::size_t index, Scratch& own) {
        const int column = static_cast<int>(index % static_cast<std::size_t>(width));
        const int row = static_cast<int>(index / static_cast<std::size_t>(width));
        const int x = options.stride / 2 + column * options.stride;
        const int y = options.stride / 2 + row * options.stride;
        store(image, column, row, trace_pixel(tracer, view, options, samples, x, y, own), samples);
    };

    // In a hundred portions, so that the caller hears of progress about once per cent. Pixels are dealt
    // out one by one: each is at least 16 paths of work.
    const std::size_t count = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    const std::size_t portion = std::max<std::size_t>(64, (count + 99) / 100);
    for (std::size_t done = 0; done < count; done += portion) {
        if (progress && !progress("reference", static_cast<float>(done) / static_cast<float>(count)))
            throw Error(ErrorCode::cancelled, "the reference was cancelled by its progress callback");
        const auto trace_range = [&](std::size_t begin, std::size_t end, int thread) {
            for (std::size_t i = begin; i < end; ++i) trace(done + i, scratch[static_cast<std::size_t>(thread)]);
        };
        pool.parallel_for(std::min(portion, count - done), 1, trace_range);
    }
    if (progress) progress("reference", 1.0f);
    return image;
}

}  // namespace rcs
