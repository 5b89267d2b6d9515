#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "rcs/api.h"
#include "rcs/effect_plan.h"
#include "rcs/gl_context.h"
#include "rcs/log.h"
#include "rcs/ray_scene.h"
#include "rcs/records.h"
#include "rcs/scene.h"
#include "rcs/thread_pool.h"

namespace rcs {

/// What a session keeps, and who is told.
struct SessionOptions {
    int threads = 0;             ///< worker threads, >= 0; 0: one per available core
    bool keep_records = false;   ///< a view begins with the records of those before it, as far as they hold: less time,
                                 ///< and another noise than by itself. Without it a view is the same bits whatever was
                                 ///< rendered before
    bool watch_records = false;  ///< with keep_records: those of scenes that differ in what moves, shines or is made
                                 ///< otherwise are kept as well; a few rays say which still hold, the others are
                                 ///< gathered again. Takes a few more rays for each new record, so that it is for
                                 ///< scenes that do change
    std::size_t most_records = 1'000'000;  ///< kept at a time: where there are more, those out of sight go; where
                                           ///< that is not enough, all
    LogFunction log = {};                  ///< told what could not be kept
};

/// Something that a session holds from view to view.
enum class SessionPart {
    ray_scene,    ///< the acceleration structure
    light_cache,  ///< of the bounces beyond the first
    records,
    count
};
/// How many parts there are.
inline constexpr std::size_t kSessionParts = static_cast<std::size_t>(SessionPart::count);
/// "acceleration structure", ...
RCS_API const char* name_of(SessionPart part);

/// Whether the last thing that a session was told of left a part as it was.
struct Validity {
    bool kept = false;  ///< it was left
    std::string why;    ///< it was kept, or had to go
};

/// What lasts from view to view: threads, the GL, a scene with its acceleration structure, light cache and records. It
/// is told of another scene, pose, lamp or sky by show(), of another camera or other options by render(), and says what
/// of it stays valid. Belongs to the thread that made it; several may be at work at a time, and count for themselves
/// what they do.
class RCS_API Session {
public:
    /// @throws Error bad_argument: threads
    explicit Session(SessionOptions options = {});
    /// Works with a GL and threads that others use as well, not at the same time; both must outlive it.
    Session(GlContext& gl, ThreadPool& pool, SessionOptions options = {});
    ~Session();
    /// Takes over what the other holds, which is of no use then.
    Session(Session&&) noexcept;
    /// The same, in place of what this one held.
    Session& operator=(Session&&) noexcept;

    /// Shows this scene from now on. What it has in common with the one before is found out by comparing all of it:
    /// where only lamps without size or the sky differ, the acceleration structure stays; records that are watched stay
    /// where instances, meshes, materials and textures are as many as before.
    /// @throws Error bad_argument: the scene is none, see validate(const Scene&). The one before stays
    void show(Scene scene);
    /// Shows nothing any more: memory first, where another scene is to be loaded that has nothing in common.
    void clear();
    /// The next view is made from nothing but the scene, as if it were the first.
    void forget_light();
    /// Whether something is shown.
    bool has_scene() const noexcept;
    /// @throws Error not_found: nothing is shown yet; so do all that need a scene
    const Scene& scene() const;

    /// Its threads.
    ThreadPool& pool() noexcept;
    /// Made at first use. @throws Error gl_unavailable
    GlContext& gl();
    /// Built at first use, and again where another choice is made for alpha, transmission, normal maps or instancing.
    /// @throws Error as build_ray_scene()
    const RayScene& rays(const EffectChoice& choice = {});

    /// Those kept for the next view: of the last one, and what it began with.
    const std::vector<Record>& records() const noexcept;
    /// The next view begins with these, which were gathered in this scene with its options, as read_records() makes
    /// sure. They are taken without keep_records, too.
    void begin_with(std::vector<Record> records);

    /// What became of a part when the session was last told of something.
    const Validity& validity(SessionPart part) const;

    struct State;
    /// For the library's own use.
    State& state() noexcept { return *state_; }

private:
    std::unique_ptr<State> state_;
};

}  // namespace rcs
