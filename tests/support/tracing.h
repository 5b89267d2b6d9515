#pragma once

#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "rcs/ray_scene.h"
#include "rcs/reference.h"
#include "rcs/thread_pool.h"
#include "support/scenes.h"

namespace rcs::test {

/// Path traces the scene's first camera.
inline LayeredImage trace(const Scene& scene, int size, const ReferenceOptions& options, int threads = 2)
{
    ThreadPool pool(threads);
    const RayScene rays = build_ray_scene(scene, pool);
    return render_reference(rays, view_of(scene.cameras[0], size, size), options, pool);
}

/// Mean of one channel over the pixels that see something.
inline double mean(const LayeredImage& image, const std::string& layer, int channel = 0)
{
    const Image& values = image.layers.at(layer);
    const Image& beauty = image.layers.at("beauty");
    double sum = 0, count = 0;
    for (int y = 0; y < values.height; ++y) {
        for (int x = 0; x < values.width; ++x) {
            if (beauty.at(x, y)[3] < 1.0f) continue;
            sum += static_cast<double>(values.at(x, y)[channel]);
            ++count;
        }
    }
    return sum / count;
}

inline void expect_sane(const LayeredImage& image)
{
    for (const auto& [name, layer] : image.layers) {
        if (name == "normal" || name == "depth") continue;
        for (const float value : layer.pixels) ASSERT_TRUE(std::isfinite(value) && value >= 0.0f) << name;
    }
}

}  // namespace rcs::test
