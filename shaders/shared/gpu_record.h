// One record as the splat passes read it (std430, rows of 16 bytes): read by C++ and GLSL.
#ifdef __cplusplus
#pragma once
#include <glm/glm.hpp>
namespace rcs {
namespace gpu {
using glm::ivec4;
using glm::vec4;
#endif

struct GpuRecord {
    vec4 position;                 // xyz: p_k relative to the camera [m]   w: 1 / influence radius [1/m]
    vec4 normal;                   // xyz: n_k, unit                        w: 1 / tolerance of sqrt(1-n.n_k)
    vec4 irradiance;               // rgb: E_k [W m^-2]                     w: see below
    vec4 rotation_gradient[3];     // r, g, b; xyz: [W m^-2 rad^-1]         w: of r, see below
    vec4 translation_gradient[3];  // r, g, b; xyz: [W m^-3]                w: unused
    // irradiance.w: what luminance is multiplied with before it is squared [m^2/W], the same for all records
    // rotation_gradient[0].w: variance of the irradiance's luminance, in the same unit
    ivec4 pixels;  // x0, y0, x1, y1: PixelBounds of the influence sphere
};  // ------------------------------ 160 bytes

// The same record's incoming radiance, only where glossy surfaces are lit by records.
struct GpuRadiance {
    vec4 coefficients[36];  // 36 of red, of green, of blue, over the record's irradiance in that colour; and those
                            // of uniform radiance with irradiance 1
};

#ifdef __cplusplus
static_assert(sizeof(GpuRadiance) == 576);
static_assert(sizeof(GpuRecord) == 160);
}  // namespace gpu
}  // namespace rcs
#endif
