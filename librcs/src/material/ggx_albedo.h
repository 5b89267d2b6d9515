#pragma once

namespace rcs {

/// Directional albedo of the single-scattering GGX lobe under Schlick's Fresnel: f0 * scale + f90 * bias.
/// With Fresnel = 1 it is scale + bias.
struct GgxAlbedo {
    float scale, bias;
};

/// @param cosine  of the viewer to the normal, clamped to [0, 1]   @param alpha  in (0, 1]
/// Interpolated from a table, within 0.005 of the integral; the first call builds it (some 10 ms).
GgxAlbedo ggx_albedo(float cosine, float alpha);

}  // namespace rcs
