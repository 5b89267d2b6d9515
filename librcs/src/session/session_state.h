#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "rcs/camera.h"
#include "rcs/light_cache.h"
#include "rcs/render_options.h"
#include "rcs/session.h"

namespace rcs {

/// What a light cache was built for. Cells are sized for the view, and found from its visible points.
struct LightCacheUse {
    View view;
    LightCacheSettings settings;
    bool operator==(const LightCacheUse&) const = default;
};

struct Session::State {
    SessionOptions options;
    std::shared_ptr<ThreadPool> pool;
    std::shared_ptr<GlContext> gl;  // null until it is needed
    std::unique_ptr<Scene> scene;   // stays where it is: the acceleration structure refers to it
    std::optional<RayScene> rays;
    EffectChoice rays_choice;  // of what rays ask surfaces for
    std::optional<LightCache> light_cache;
    LightCacheUse light_cache_use;
    std::vector<Record> records;
    std::string record_settings;  // that they were gathered with; empty: none are kept, or they come from outside
    std::array<Validity, kSessionParts> validity;

    Validity& of(SessionPart part) { return validity[static_cast<std::size_t>(part)]; }
    /// Notes what becomes of a part, and tells the log where something has to go that was there.
    void note(SessionPart part, bool kept, std::string why);
    bool holds(SessionPart part) const;
    void drop_light(const std::string& why);

    /// The records that a view with these options begins with; keeps none of them.
    std::vector<Record> take_records(const RenderOptions& options);
    /// Keeps the records of a view, if that is wanted, and as many as there may be. @return those that are not kept
    std::vector<Record> keep_records(std::vector<Record> records, const RenderOptions& options, const View& view);
    /// The light cache if it serves this use; null if it has to be built.
    const LightCache* find_light_cache(const LightCacheUse& use);
    const LightCache* keep_light_cache(LightCache cache, LightCacheUse use);
    /// @return what the view found valid
    std::array<Validity, kSessionParts> end_view();
};

}  // namespace rcs
