#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "rcs/api.h"
#include "rcs/denoise_stats.h"
#include "rcs/direct_light.h"
#include "rcs/effect_plan.h"
#include "rcs/error_estimate.h"
#include "rcs/glossy_stats.h"
#include "rcs/image.h"
#include "rcs/light_cache.h"
#include "rcs/log.h"
#include "rcs/records.h"
#include "rcs/reference.h"
#include "rcs/render_options.h"
#include "rcs/session.h"
#include "rcs/splat.h"

namespace rcs {

/// What render() takes in all for a mean relative error of indirect light, said before the main work.
struct Forecast {
    /// What an error costs.
    struct Point {
        double error;    ///< as TargetError::error
        double seconds;  ///< wall time of render()
    };
    std::vector<Point> points;   ///< from large errors to small ones
    double settled_error = 0.0;  ///< what takes hardly more than any other: that of the records that are there
    double goal_error = 0.0;     ///< what is aimed at
    double goal_seconds = 0.0;   ///< what that takes [s]
    int passes = 1;              ///< samples a pixel
};
/// Told of the forecast before the main work.
using ForecastFunction = std::function<void(const Forecast&)>;

/// Told after every pass but the last one. `picture` makes the picture so far, with its error layers, and is valid only
/// during the call.
using PassFunction = std::function<void(int done, int passes, const std::function<LayeredImage()>& picture)>;

/// What a picture shows before it is done.
struct PictureSoFar {
    LayeredImage image;     ///< as that of RenderResult, with its error layers
    ErrorEstimates errors;  ///< of it
};
/// Told whenever records that a target or a budget asks for have come nearer to it, in the first pass. `make` makes the
/// picture with the records so far, and is valid only during the call. Pictures of surfaces that others show through
/// are not told of: they would lack what is behind.
using StepFunction = std::function<void(const std::function<PictureSoFar()>& make)>;

/// What each purpose took: 0 for what the plan leaves out.
struct EffectCounts {
    std::uint64_t camera_rays = 0;     ///< that settle edges and masks, and look behind surfaces
    std::uint64_t punctual_rays = 0;   ///< shadow rays of pixels to lamps without size
    std::uint64_t area_rays = 0;       ///< ... to emissive triangles
    std::uint64_t peak_rays = 0;       ///< ... to peaks of the sky
    std::uint64_t highlight_rays = 0;  ///< of pixels, along lobes towards lamps
    std::uint64_t hit_lamp_rays = 0;   ///< shadow rays of gather hits, lobes and cells to lamps
    std::uint64_t hit_sky_rays = 0;    ///< ... to the sky's peaks
    std::uint64_t alpha_tests = 0;     ///< surfaces that rays asked if they may go on
    std::uint64_t hit_textures = 0;    ///< fetches where rays hit
    std::uint64_t normal_maps = 0;     ///< fetches
    std::uint64_t gbuffers = 0;        ///< that were drawn
    std::uint64_t peeled_layers = 0;   ///< of those, of what shows through other surfaces
    std::uint64_t direct_passes = 0;   ///< over all pixels
    std::uint64_t splats = 0;          ///< of all records, without radiance
    std::uint64_t glossy_splats = 0;   ///< ... and with it
    std::uint64_t lobe_passes = 0;     ///< of rays along narrow lobes, over all pixels
    std::uint64_t error_passes = 0;    ///< estimates of a splat's error
    std::uint64_t shared_samples = 0;  ///< that took the light of their pixel's first one
    std::uint64_t gl_bytes = 0;        ///< of textures and buffers made, one after the other
    std::uint64_t shading_bytes = 0;   ///< of BSDFs and coverage, the most at a time
    std::uint64_t record_bytes = 0;    ///< of records at the end
    std::uint64_t radiance_bytes = 0;  ///< part of them that is radiance
    std::uint64_t layer_bytes = 0;     ///< of the picture
    std::vector<std::string> shaders;  ///< variants used
};

/// What a picture took.
struct RenderStats {
    EffectPlan plan;                                            ///< what was simulated, and why
    EffectCounts counts;                                        ///< what each purpose took
    Forecast forecast;                                          ///< empty without a target or budget
    std::vector<std::pair<std::string, double>> stage_seconds;  ///< in order of execution; wall time
    RecordStats records;                                        ///< what gathering them took
    SplatStats splats;                                          ///< what their splats took
    LightCacheStats light_cache;                                ///< of the bounces beyond the first
    std::uint64_t direct_shadow_rays = 0;                       ///< of pixels, to lamps
    std::uint64_t contacts = 0;                                 ///< pixels where surfaces meet that gathered themselves
    std::uint64_t contact_rays = 0;                             ///< that these took, shadow rays too
    std::uint64_t lamp_checks = 0;             ///< pixels that asked gathered lamps themselves, since records disagreed
    GlossyStats traced;                        ///< narrow lobes, ray traced per pixel
    ErrorEstimates errors;                     ///< of the picture and of its indirect light
    DenoiseStats denoised;                     ///< if that was asked for
    std::uint64_t probe_rays = 0;              ///< of gathers that judged the estimate
    std::uint64_t unserved_pixels = 0;         ///< visible pixels that no record reaches: 0 unless something is wrong
    std::string splat_method;                  ///< "quads", "tiles" or "gpu-tiles"
    std::string gather_method;                 ///< "cpu" or "gpu": what traced the rays of records to their end
    std::string gl_renderer;                   ///< GL_RENDERER
    std::string gl_version;                    ///< GL_VERSION
    std::string gl_platform;                   ///< GlContext::platform()
    int threads = 0;                           ///< of the session
    std::array<Validity, kSessionParts> kept;  ///< what of the session's parts this view found as it needs them

    /// Adds to a stage's seconds [s].
    RCS_API void add(const std::string& stage, double seconds);
};

/// What render() makes.
struct RenderResult {
    LayeredImage image;           ///< scene-linear
    std::vector<Record> records;  ///< those that the picture was made from; empty if the session keeps them
    RenderStats stats;            ///< what it took
};

/// Whom to tell of what while a picture is made; each may be empty.
struct RenderHooks {
    LogFunction log = {};            ///< of warnings and what was decided
    ProgressFunction progress = {};  ///< of stages
    ForecastFunction forecast = {};  ///< told once, with a target or budget
    PassFunction after_pass = {};    ///< of the picture so far
    StepFunction after_step = {};    ///< of the picture so far, within the first pass
};

/// What a picture shows at a moment.
struct Moment {
    std::optional<Scene> scene;  ///< none: all stands where it stood the moment before
    Camera camera;               ///< it is seen through
};
/// What is to be seen when so much of the time has passed that the shutter is open, in (0, 1).
using MomentFunction = std::function<Moment(double part)>;

/// Renders one view of the session's scene: emission, direct light, and indirect light by radiance cache
/// splatting (Gautron et al. 2005).
/// @throws Error bad_argument: options, naming field, value and range; not_found: the session shows nothing; cancelled;
/// those of
///     Session::gl() and Session::rays(). What is shown stays; so do records that are kept, with those gathered until
///     then, but for a picture of several moments
RCS_API RenderResult render(Session& session, const Camera& camera, const RenderOptions& options,
                            const RenderHooks& hooks = {});

/// What a glance may take.
struct Haste {
    double gather_seconds = 0.02;  ///< for records where none reaches at all [s], >= 0
    int area_samples = 4;          ///< as RenderOptions::area_samples and penumbra_samples, those at the most
    int lamp_picks = 4;            ///< as RenderOptions::lamp_picks, those at the most
};

/// Shows what a camera in motion sees by the records that are there: the stages of render() in one pass, but that
/// records are gathered only where none reaches, and only for so long; where none came, light is filled in from around
/// (RenderStats::unserved_pixels counts those). With bounces beyond the first, whose light is found for one view, none
/// are gathered but in that view. New ones are kept for views to come, and render() places others between them. Takes
/// as long as its pixels ask for, much less than render().
/// @param options  those that pictures at rest are rendered with: records hold for the same ones alone; aa and samples
///        count as 1, or as few as `haste` says
/// @return as render(), without records   @throws as render()
RCS_API RenderResult glance(Session& session, const Camera& camera, const RenderOptions& options,
                            const Haste& haste = {}, const ProgressFunction& progress = {});

/// The same with motion blur: each of options.aa passes shows a moment of its own, in their order, evenly spread over
/// the time that the shutter is open. The passes share records as views of a session that watches do
/// (SessionOptions::watch_records). What is simulated is planned for the first moment. The session is left with the
/// scene of the last one.
/// @throws Error bad_argument also where there is but one pass, or motion vectors are wanted, which are of one moment;
/// what `moments` throws
RCS_API RenderResult render(Session& session, const MomentFunction& moments, const RenderOptions& options,
                            const RenderHooks& hooks = {});

/// The same in a session of its own.
RCS_API RenderResult render(Scene scene, const Camera& camera, const RenderOptions& options,
                            const RenderHooks& hooks = {});

/// Path traces what render() shows of moments: their mean, of 64 evenly spread over the time that the shutter is open,
/// or of one for each 16 paths where there are fewer. The session is left with the scene of the last one.
/// @param view  sets all but the camera   @param lens  of each moment's camera; empty: that of the options, at all
/// times
/// @throws as render_reference() of one; what `moments` throws
RCS_API LayeredImage render_reference(Session& session, const MomentFunction& moments, View view,
                                      const ReferenceOptions& options,
                                      const std::function<Lens(const Camera&)>& lens = {},
                                      const ProgressFunction& progress = {});

/// Lets a session that watches know what its records see, as those of a file do not: they were handed to it by
/// Session::begin_with(), in the scene that it shows. Without this they go when it shows another one.
/// @param camera, options  of a view that they were gathered for
/// @throws as render()
RCS_API void begin_watching(Session& session, const Camera& camera, const RenderOptions& options,
                            const RenderHooks& hooks = {});

/// What walk_ahead() made.
struct AheadStats {
    int views = 0;              ///< that it looked at
    std::uint64_t records = 0;  ///< that are new
    double error = 0.0;         ///< mean relative, of indirect light: with a goal what the worst of them was left with
};

/// The camera of a view to come, by number from 0; none: it is not looked at.
using CameraFunction = std::function<std::optional<Camera>(std::size_t)>;

/// Places the records of views to come, so that each of these has from the first on what the others need: as a camera
/// moves, light stays what it is, and costs no more than record by record as they come into view. Looks at the first
/// and the last one, and in between where views need what there is not yet, leaving to the views themselves what lies
/// closer. Where the options aim at an error their records are brought down to it; a budget is that of each such look.
/// Does nothing where the session keeps no records; where the camera stands still (the first, the middle and the last
/// one are the same) only with such a goal.
/// @param views  how many   @param camera_of  asked once for those that are looked at, and the middle one: of the
/// scene as it is, or as it will be where the session watches its records   @param options  that they are rendered with
/// @throws as render(); what `camera_of` throws
RCS_API AheadStats walk_ahead(Session& session, std::size_t views, const CameraFunction& camera_of,
                              const RenderOptions& options, const RenderHooks& hooks = {});

/// What which error would cost: stops before the main work. Its `forecast` is empty where there is no indirect light.
/// @param options  with a target or a budget
RCS_API RenderStats forecast(Session& session, const Camera& camera, const RenderOptions& options,
                             const RenderHooks& hooks = {});

}  // namespace rcs
