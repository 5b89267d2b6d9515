#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "rcs/api.h"
#include "rcs/effects.h"
#include "rcs/motion.h"

namespace rcs {

// Units, ranges and what each is on the command line: rcs/option_table.h, as text in docs/options.md.

/// How close records lie and what they may be off by, in so many words.
struct QualitySettings {
    float error_tolerance = 0.2f;  ///< Ward's a; smaller is finer
    int rays = 128;                ///< hemisphere rays per record at first; rounded to M x N strata
    float noise_target = 0.02f;    ///< standard error wanted at a pixel relative to its irradiance, where records lie
                                   ///< as far apart as they may; ones f times as close may have f^(2/3) times as much.
                                   ///< Where there is more, a record gets more rays
    int refinement = 16;           ///< so many times `rays` at the most
};

/// Records are placed and rays chosen by the estimated errors until those are small enough: that of the picture and,
/// since lamps may hide it from the picture's mean, that of its indirect light.
struct TargetError {
    double error = 0.05;  ///< mean relative error of either (ErrorEstimate)
};

/// The same for the indirect light alone, however noisy the direct light is.
struct TargetIndirectError {
    double error = 0.05;  ///< mean relative error (ErrorEstimate)
};

/// The same for as long as there is time, with fewer passes where the time asks for it. What is rendered then depends
/// on the machine.
struct Budget {
    double seconds = 20.0;  ///< wall time of render()
};

/// What is asked for: settings, an error to reach, or a time to spend.
using Quality = std::variant<QualitySettings, TargetError, Budget, TargetIndirectError>;

/// How records reach the image.
enum class SplatMethod {
    automatic,  ///< on a software GL tiles, on a hardware one the fastest, as was measured once
    quads,      ///< the paper's: one bounding quad per record, blended by OpenGL
    tiles,      ///< records binned to tiles of the image, summed by the CPU
    gpu_tiles,  ///< the same, summed by compute shaders of OpenGL
};

/// What traces the rays of records.
enum class GatherMethod {
    automatic,  ///< a hardware GL if it is faster, as was measured once; else the processor
    processor,
    device,  ///< compute shaders of OpenGL; the processor where those fail
};

/// What takes noise out of the finished picture.
enum class Denoiser {
    none,
    oidn,  ///< Open Image Denoise 2, found at run time: filters what pixels sample by themselves, as far as that helps
};

/// A window of the picture [px], (x, y) its upper left corner.
struct Crop {
    int x = 0;       ///< of the upper left corner, >= 0
    int y = 0;       ///< likewise
    int width = 0;   ///< >= 1; it ends within the picture
    int height = 0;  ///< likewise

    /// Whether they are the same window.
    bool operator==(const Crop&) const = default;
};

/// What a user may ask of a picture, and nothing that follows from it.
struct RenderOptions {
    int width = 1000;                     ///< of the picture [px]
    int height = 1000;                    ///< of the picture [px]
    std::optional<Crop> crop;             ///< what is rendered of it; none: all
    std::optional<double> f_stop;         ///< focal length over opening of the lens; none: a pinhole
    std::optional<double> focus;          ///< of that lens: distance of what is sharp, along the camera's axis [m]
    int aa = 4;                           ///< jittered passes that share the records; 1 samples pixel centres
    int bounces = 1;                      ///< of indirect light; 8 is full interreflection but for very light rooms
    Quality quality = QualitySettings{};  ///< how good it is to be, in one way or another
    float min_reach = 15.0f;              ///< least R_k, at most max_reach: a times it is the closest spacing
    float max_reach = 60.0f;              ///< largest R_k: a times it is the widest spacing
    float gradient_limit = 3.0f;          ///< R_k is at most so many times E/|grad E|
    int area_samples = 16;                ///< shadow rays a pixel towards lamps with area; each pass shoots its part
    int penumbra_samples = 64;            ///< the same where visibility is mixed; fewer count as area_samples
    int lamp_picks = 0;                   ///< so many emissive triangles, picked by what they would send, stand for all
                                          ///< (DirectSettings); 0: none is left out
    int lobe_rays = 16;    ///< rays a pixel along lobes too narrow for records, shared between neighbours; up to six
                           ///< times as many where noise would show by noise_target and no goal is set
    float overlap = 3.5f;  ///< influence radius of the last splat, in spacing radii
    SplatMethod splat = SplatMethod::automatic;     ///< how records reach the image
    GatherMethod gather = GatherMethod::automatic;  ///< what traces the rays of records
    int device = -1;                                ///< graphics device by its number; -1: hardware before software
    Denoiser denoise = Denoiser::none;              ///< of direct light and of rays along lobes
    EffectChoice effects;  ///< what is simulated though the plan would not, and what is not though it would; alpha,
                           ///< transmission, normal maps and instancing are chosen in build_ray_scene()
    std::optional<std::vector<std::string>> layers;  ///< to make beside beauty (rcs/layers.h); none: the default ones
    std::optional<MotionFrom> motion;                ///< what the layer `motion` is told by
    std::uint64_t seed = 1;                          ///< of every random stream
};

/// The settings asked for, to be changed; a goal gives way to the default settings.
RCS_API QualitySettings& settings_of(RenderOptions& options);

/// The same to be read; those of a goal are the default ones.
RCS_API QualitySettings settings_or_default(const RenderOptions& options);

/// Whether the quality is a target or a budget: then the estimated error steers what is done.
inline bool has_goal(const RenderOptions& options) { return !std::holds_alternative<QualitySettings>(options.quality); }
/// What the picture, or its indirect light, is aimed at; 0: none.
RCS_API double target_error(const RenderOptions& options);
/// Whether that is the picture's error as well.
inline bool aims_at_picture(const RenderOptions& options)
{
    return std::holds_alternative<TargetError>(options.quality);
}
/// The wall time to spend [s]; 0: none is given.
RCS_API double budget_seconds(const RenderOptions& options);

/// @throws Error bad_argument: the field, its value and its range
RCS_API void validate(const RenderOptions& options);

}  // namespace rcs
