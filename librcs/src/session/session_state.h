#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "accuracy/error_scale.h"
#include "device/ray_caster.h"
#include "rcs/camera.h"
#include "rcs/error.h"
#include "rcs/light_cache.h"
#include "rcs/render_options.h"
#include "rcs/session.h"
#include "records/gather_choice.h"
#include "records/watch.h"
#include "session/kept_guide.h"
#include "session/kept_samples.h"
#include "splat/splat_choice.h"

namespace rcs {

/// What a light cache was built for. Cells are sized for the view, and found from its visible points.
struct LightCacheUse {
    View view;
    LightCacheSettings settings;
    bool operator==(const LightCacheUse&) const = default;
};

/// What probes found of a view's error: it holds for the next ones as long as their records are the same.
struct KeptScale {
    ErrorScale scale;
    double others = 0.0;  ///< part of the records that has changed since
};

/// How noisy new records may be.
struct NoiseOfRecords {
    std::optional<float> slack;    ///< over what is wanted: in this scene
    std::optional<float> reached;  ///< by those of the view before, where a goal steered them
    double seconds_per_ray = 0.0;  ///< then
};

/// What a session does on graphics devices.
struct GraphicsUse {
    std::unique_ptr<RayCaster> caster;   ///< of the session's rays; null: the processor traces them
    std::optional<GatherChoice> choice;  ///< of the machine, once it is asked for
    std::optional<SplatChoice> splat;    ///< the same
    bool splats = true;                  ///< no device has failed to
    bool owns_gl = true;
    int device = -1;  ///< that the GL is made on, or is to be

    /// How to splat: as asked for, while the device does it.
    SplatMethod choose_splat(GlContext& gl, ThreadPool& pool, SplatMethod asked, const LogFunction& log);
    /// Leaves splats to the processor from here on, and says so. @return how
    SplatMethod give_up_splats(const GlContext& gl, const Error& why, const LogFunction& log);
};

struct [[gnu::visibility("hidden")]] Session::State {
    SessionOptions options;
    std::shared_ptr<ThreadPool> pool;
    std::shared_ptr<GlContext> gl;  // null until it is needed
    std::unique_ptr<Scene> scene;   // stays where it is: the acceleration structure refers to it
    std::optional<RayScene> rays;
    GraphicsUse graphics;      // of that GL, and those rays
    EffectChoice rays_choice;  // of what rays ask surfaces for
    std::optional<LightCache> light_cache;
    LightCacheUse light_cache_use;
    std::vector<Record> records, contacts;  ///< of contacts: gathers of pixels where surfaces meet; in no file
    bool moves = false;                     ///< a view is in the making that shows several moments
    std::uint32_t view_number = 0, scene_number = 0;  ///< of the scene: another one for each change
    std::vector<std::uint32_t> changed_in;  ///< per instance: since which scene it has been where and what it is
    std::vector<SceneChange> changes;       ///< of the last scenes
    Bounds box;                             ///< of the first of them
    NoiseOfRecords noise;
    std::optional<KeptGuide> guide;
    std::optional<KeptScale> error_scale;
    std::vector<KeptSamples> samples;  ///< of the view before, by pass; of passes whose pixels sampled nothing none
    std::uint64_t sampled = 0;         ///< passes so far that went on from samples: each draws others
    double record_pixel = 0.0;         ///< of the view that they were kept from, as ImagePlane has it; 0: unknown
    std::string record_settings;       // that they were gathered with; empty: none are kept, or they come from outside
    std::array<Validity, kSessionParts> validity;

    Validity& of(SessionPart part) { return validity[static_cast<std::size_t>(part)]; }
    /// Notes what becomes of a part, and tells the log where something has to go that was there.
    void note(SessionPart part, bool kept, std::string why);
    bool holds(SessionPart part) const;
    void drop_light(const std::string& why);
    /// Whether records outlive a change of the scene.
    bool watches() const { return moves || (options.keep_records && options.watch_records); }
    /// All light goes but records that are watched.
    void change_light(const std::string& why, SceneChange change);
    SceneStates states() const { return {scene_number, changed_in, changes, box}; }
    /// Makes the next GL on that device. @throws Error bad_argument: the GL was handed over, and is on another one
    void use_device(int device);
    /// Has the caster that is asked for, of the rays there are; says what it cannot have.
    void prepare_caster(GlContext& gl, GatherMethod asked, const LogFunction& log);

    /// The records that a view with these options begins with; keeps none of them.
    std::vector<Record> take_records(const RenderOptions& options);
    /// Keeps a view's records, if that is wanted, and those laid aside not long ago. @return those that are not kept
    std::vector<Record> keep_records(std::vector<Record> records, std::vector<Record> aside,
                                     const RenderOptions& options, const View& view);
    /// Keeps those of a view that did not come about, or was only glanced at, none of them older than it was.
    void put_back(std::vector<Record> records, const RenderOptions& options, const View& view);
    /// The guide if it serves another view, and records are kept; none if it is to be found out anew.
    std::optional<KeptGuide> take_guide();
    /// @param made, reused  records of this view: where most are new it has little in common with those before
    void keep_guide(KeptGuide kept, std::size_t made, std::size_t reused);
    /// The scale of an earlier view, if records are kept and it serves one of whose that part is new or renewed.
    std::optional<ErrorScale> find_error_scale(double changed);
    void keep_error_scale(const ErrorScale& scale);
    /// The light cache if it serves this use; null if it has to be built.
    const LightCache* find_light_cache(const LightCacheUse& use);
    const LightCache* keep_light_cache(LightCache cache, LightCacheUse use);
    /// @return what the view found valid
    std::array<Validity, kSessionParts> end_view();
};

}  // namespace rcs
