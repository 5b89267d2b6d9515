// The two halves of radiance cache splatting by themselves: build records where you want them, then splat
// them, by both methods. Writes the indirect irradiance, sum(w E) / sum(w), as an EXR.
// Usage: records_and_splats [FILE.exr]

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <vector>

#include "rcs/rcs.h"

namespace {

/// Every `step`-th visible pixel of every `step`-th row: a plain choice; place_records() makes a better one.
std::vector<std::uint32_t> pixels_on_a_grid(const rcs::GBuffer& gbuffer, int step)
{
    std::vector<std::uint32_t> pixels;
    for (int y = step / 2; y < gbuffer.height; y += step) {
        for (int x = step / 2; x < gbuffer.width; x += step) {
            const auto pixel = static_cast<std::uint32_t>(y * gbuffer.width + x);
            if (gbuffer.covered(pixel)) {
                pixels.push_back(pixel);
            }
        }
    }
    return pixels;
}

/// Divides the weighted sums; black where no record reaches.
rcs::Image irradiance_of(const rcs::SplatBuffer& splats)
{
    rcs::Image image(splats.width, splats.height, 3);
    for (std::size_t i = 0; i < splats.weight.size(); ++i) {
        const float scale = splats.weight[i] > 0.0f ? 1.0f / splats.weight[i] : 0.0f;
        image.pixels[3 * i] = splats.weighted_r[i] * scale;
        image.pixels[3 * i + 1] = splats.weighted_g[i] * scale;
        image.pixels[3 * i + 2] = splats.weighted_b[i] * scale;
    }
    return image;
}

double largest_difference(const rcs::Image& a, const rcs::Image& b)
{
    double largest = 0.0;
    for (std::size_t i = 0; i < a.pixels.size(); ++i) {
        largest = std::fmax(largest, std::fabs(static_cast<double>(a.pixels[i]) - static_cast<double>(b.pixels[i])));
    }
    return largest;
}

void run(const char* file)
{
    rcs::Session session;
    session.show(rcs::load_scene("demo:cornell"));
    rcs::ThreadPool& pool = session.pool();
    const rcs::RayScene& rays = session.rays();
    const rcs::View view{rcs::find_camera(session.scene(), ""), 160, 160};
    const rcs::GBuffer gbuffer = rcs::render_gbuffer(session.gl(), rays, view, 1.0f, pool);

    rcs::RecordSettings options;
    options.rays = 1024;
    rcs::RecordStats record_stats;
    std::vector<rcs::Record> records =
        rcs::gather_records(rays, gbuffer, pixels_on_a_grid(gbuffer, 8), options, pool, record_stats);
    rcs::limit_spacing(records, options, pool);

    // A wide overlap closes the gaps that a plain grid leaves.
    const rcs::SplatSettings reach{options.error_tolerance, 6.0f};
    rcs::SplatStats tile_stats;
    rcs::SplatStats quad_stats;
    const rcs::Image by_tiles = irradiance_of(rcs::splat_tiles(records, gbuffer, view, reach, pool, tile_stats));
    const rcs::Image by_quads =
        irradiance_of(rcs::splat_quads(session.gl(), records, gbuffer, view, reach, pool, quad_stats));

    rcs::LayeredImage image;
    image.layers["beauty"] = by_quads;
    rcs::write_exr(file, image);
    std::printf("%s: %zu records from %llu rays; quads and tiles differ by at most %.2g W/m^2\n", file, records.size(),
                static_cast<unsigned long long>(record_stats.hemisphere_rays), largest_difference(by_tiles, by_quads));
}

}  // namespace

int main(int argc, char** argv)
{
    try {
        run(argc > 1 ? argv[1] : "records_and_splats.exr");
        return 0;
    } catch (const std::exception& e) {
        std::fprintf(stderr, "records_and_splats: %s\n", e.what());
        return 1;
    }
}
