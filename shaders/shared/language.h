// What C++ and GLSL call by different names, for the headers of this folder. In C++ it stands in a namespace of its
// own, where vec3 is three floats.
#ifdef __cplusplus
#pragma once
#define RCS_SHARED_FUNCTION inline
#define RCS_PRECISE
#define RCS_CONSTANT inline constexpr
namespace rcs {
namespace gpu {
struct vec3 {
    float x, y, z;
};
inline float max(float a, float b) { return a > b ? a : b; }
inline float min(float a, float b) { return a < b ? a : b; }
inline float abs(float x) { return __builtin_fabsf(x); }
inline float sqrt(float x) { return __builtin_sqrtf(x); }
}  // namespace gpu
}  // namespace rcs
#else
#define RCS_SHARED_FUNCTION
#define RCS_PRECISE precise
#define RCS_CONSTANT const
#endif
