#pragma once

#include <algorithm>
#include <cmath>

#include <glm/glm.hpp>

namespace rcs {

// Where one technique hands over to the next: widths of lobes (GGX alpha, roughness squared). The surface is the same
// for all of them, so that they meet without a step.

/// A mirror is a lobe of this width: narrower than any pixel, wide enough for float arithmetic.
inline constexpr float kLeastAlpha = 1e-3f;

/// Transmission by a lobe up to this width shows what is straight behind it (half a degree).
inline constexpr float kStraightAlpha = 0.01f;

/// At visible points lobes at least this wide are lit by radiance records. Six bands hold a GGX lobe of this width to
/// some 2 % of its reflection under light with hard edges (5 % when seen at 70 degrees; measured over random half-space
/// lights), and wider ones better; narrower lobes are ray traced per pixel. 0.3 is a roughness of 0.55.
inline constexpr float kLeastRecordAlpha = 0.3f;

/// At hits the peaks of lobes of perfect reflectance are at least so wide: what narrower ones do with small lamps, a
/// hundred rays would see as single bright dots (path space regularisation: Kaplanyan and Dachsbacher 2013).
inline constexpr float kLeastHitAlpha = 0.75f;
/// The same where so many rays look together. The dots' noise is as 1 over the width and the root of the number; with
/// the fourth root of the number, down to half the width, both that noise and the light that is thrown elsewhere fall.
inline float least_hit_alpha(int rays)
{
    constexpr float kFewRays = 128.0f;
    return kLeastHitAlpha * std::clamp(std::sqrt(std::sqrt(kFewRays / static_cast<float>(rays))), 0.5f, 1.0f);
}
/// On a flat face, so much of that: there a lamp's image is as wide as the lamp, and many rays find it. A curved one
/// shrinks it to a dot. (Four rooms with metal, MRE of indirect light at twice that part: 1 to 4 % worse. Balls at a
/// quarter of the width: 1 to 31 % worse; at 0.45, 0.6 and 0.9 within 5 %.)
inline constexpr float kFlatPart = 0.1f;
/// Of a kind that is widened as a whole so much, to 0.3: half of its light goes to its tails, where it is no dots.
inline constexpr float kWholePart = 0.4f;
/// The same of a lobe with this reflectance at normal incidence: a lobe's peak grows as that over its width squared,
/// and no peak is to be higher. So a dielectric's lobe stays as it is down to a roughness of 0.4 or less.
inline float least_alpha_of(glm::vec3 reflectance, float of_perfect)
{
    return of_perfect * std::sqrt(std::max({reflectance.x, reflectance.y, reflectance.z}));
}

/// At hits a dielectric's lobe at least so wide is lit by all that is not a lamp as if it were diffuse.
inline constexpr float kLikeDiffuseAlpha = 0.4f;

/// Along ray traced lobes: of hits that are seen through lobes together narrower than the first the light of lamps and
/// sky comes by rays that go on, through wider ones than the second all by evaluating the lobe; a mix between them.
inline constexpr float kAllRaysAlpha = 0.15f, kNoRaysAlpha = 0.3f;
/// The same of what surfaces reflect: it comes by rays, or else from the light cache as if the lobe were diffuse.
/// (Room 1 of tests/bench/random_rooms.py --metal 0.8 --bounces 3, two seeds, MRE of indirect light: at the widths
/// above 12.1 %, at these 7.8 in 1.25 times as long, at .5 and .8 7.6 in 1.4.)
inline constexpr float kAllReflectedAlpha = 0.3f, kNoReflectedAlpha = 0.5f;
/// There a curved face's lobe that is evaluated is at least so many times as wide as those it is seen through, up to
/// kNoRaysAlpha, ...
inline constexpr float kHitWidening = 2.0f;
/// ... and any at least so wide: lamps without extent show in it as spots that a picture can hold. (Not less for what
/// reflects little: a lacquered floor's glints in a rough metal wall, 0.01 wide, made a room's error a tenth larger.)
inline constexpr float kLeastEvaluatedAlpha = 0.05f;

/// Lamps with extent: lobes wider than this are left to the lamps' samples where there are many lamps, ...
inline constexpr float kLampsAlpha = 0.4f;
/// ... the rays along a narrower one are worth more than the lamps' samples below this width, ...
inline constexpr float kWorthyAlpha = 0.1f;
/// ... and those of one below this all meet much the same.
inline constexpr float kMirrorAlpha = 0.01f;

/// @param perceptual  glTF's roughness, in [0, 1]
inline float ggx_width(float perceptual) { return std::clamp(perceptual * perceptual, kLeastAlpha, 1.0f); }

}  // namespace rcs
