#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

#include <gtest/gtest.h>

#include "gbuffer/shading.h"
#include "radiance/lobes.h"
#include "rcs/splat.h"
#include "rcs/thread_pool.h"
#include "stability/splat_oracle.h"

/// What splats are tried on.
namespace rcs::test {

/// A wavy wall far from the origin, with records all over it. The picture's sides are no multiples of a tile's.
class SplatWall : public ::testing::Test {
protected:
    inline static const glm::dvec3 kEye{100.0, 20.0, -3.0};
    inline static const glm::dvec3 kBrightest{1.0, 1.0, 10.0};  // of the records

    View view{look_at_camera("c", kEye, {100.0, 20.0, -4.0}, 1.0), 203, 117, {0.5, 0.5}};
    GBuffer gbuffer = stability::wavy_wall(view, kEye);
    std::vector<Record> records = stability::random_records(gbuffer, 400, 7);
    SplatSettings options{0.3f, 2.5f};
    ThreadPool pool{2};
    SplatStats stats;
};

/// Gives the records radiance, and the points lobes of all widths: some too narrow a one, some none.
inline Shading make_glossy(const GBuffer& gbuffer, std::vector<Record>& records)
{
    for (std::size_t n = 0; n < records.size(); ++n)
        for (std::size_t k = 0; k < 3 * kHarmonics; ++k)
            records[n].radiance.push_back(std::sin(static_cast<float>(37 * n + 11 * k)) +
                                          (k % kHarmonics == 0 ? 4.0f : 0.0f));
    Shading shading;
    shading.most_lobes = 1;
    shading.clear_lobes(gbuffer.size());
    for (std::size_t i = 0; i < gbuffer.size(); ++i) {
        const glm::vec3 f0(0.04f + 0.01f * static_cast<float>(i % 90));
        const float alpha = 0.2f + 0.8f * static_cast<float>(i % 13) / 12.0f;
        Bsdf bsdf;
        if (i % 7 != 0) bsdf.add(make_lobe<Specular>(f0, 1.0f, alpha));
        shading.set_lobes(i, bsdf);
    }
    return shading;
}

}  // namespace rcs::test
