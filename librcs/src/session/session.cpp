#include "rcs/session.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "lamps/relight.h"
#include "rcs/error.h"
#include "rcs/record_file.h"
#include "scene/scene_parts.h"
#include "session/session_state.h"

namespace rcs {
namespace {

/// The choices that change what rays ask surfaces for.
EffectChoice choice_of_rays(const EffectChoice& choice)
{
    EffectChoice result;
    using enum Effect;
    for (const Effect effect : {transmission, alpha_mask, alpha_blend, normal_maps, instancing}) {
        result.with.set(effect, choice.with.has(effect));
        result.without.set(effect, choice.without.has(effect));
    }
    return result;
}

/// Takes over all that is no surface.
void take_lamps(Scene& from, Scene& to)
{
    to.name = std::move(from.name);
    to.lights = std::move(from.lights);
    to.cameras = std::move(from.cameras);
    to.sky_radiance = from.sky_radiance;
    to.environment = std::move(from.environment);
}

bool is_lamp(const Scene& scene, const Instance& instance)
{
    const Mesh& mesh = scene.meshes[static_cast<std::size_t>(instance.mesh)];
    return scene.materials[static_cast<std::size_t>(mesh.material)].emission != glm::vec3(0.0f);
}

/// @param changed  instances
SceneChange change_between(const Scene& a, const Scene& b, const std::vector<bool>& changed)
{
    // Of so many things one or the other is in the way of any record.
    constexpr std::ptrdiff_t kMostApart = 256;
    SceneChange change{.everywhere =
                           !same_lamps(a, b) || std::count(changed.begin(), changed.end(), true) > kMostApart};
    for (std::size_t i = 0; i < changed.size(); ++i) {
        if (!changed[i]) continue;
        change.instances.push_back(static_cast<std::uint32_t>(i));
        if (change.everywhere) continue;
        change.everywhere = is_lamp(a, a.instances[i]) || is_lamp(b, b.instances[i]);
        change.where.push_back(bounds_of(a, i));
        change.where.push_back(bounds_of(b, i));
    }
    return change;
}

/// Whether a record lies where the view looks, be it hidden or not.
bool shows(const View& view, const Record& record)
{
    const auto at = image_position(view, glm::dvec3(record.position) - camera_position(view.camera));
    return at && at->x >= 0.0 && at->y >= 0.0 && at->x < view.width && at->y < view.height;
}

}  // namespace

const char* name_of(SessionPart part)
{
    switch (part) {
        case SessionPart::ray_scene:
            return "acceleration structure";
        case SessionPart::light_cache:
            return "light cache";
        case SessionPart::records:
            return "records";
        case SessionPart::count:
            break;
    }
    return "";
}

bool Session::State::holds(SessionPart part) const
{
    switch (part) {
        case SessionPart::ray_scene:
            return rays.has_value();
        case SessionPart::light_cache:
            return light_cache.has_value();
        case SessionPart::records:
            return !records.empty();
        case SessionPart::count:
            break;
    }
    return false;
}

void Session::State::note(SessionPart part, bool kept, std::string why)
{
    if (!kept && holds(part) && options.log)
        options.log(LogLevel::debug, std::string(name_of(part)) + " not kept: " + why);
    of(part) = {kept, std::move(why)};
}

Session::Session(SessionOptions options) : state_(std::make_unique<State>())
{
    state_->options = std::move(options);
    state_->pool = std::make_shared<ThreadPool>(state_->options.threads);
    state_->validity.fill({false, "nothing is shown yet"});
}

Session::Session(GlContext& gl, ThreadPool& pool, SessionOptions options) : state_(std::make_unique<State>())
{
    state_->options = std::move(options);
    state_->pool = std::shared_ptr<ThreadPool>(std::shared_ptr<void>(), &pool);  // owns nothing
    state_->gl = std::shared_ptr<GlContext>(std::shared_ptr<void>(), &gl);
    state_->graphics.owns_gl = false;
    state_->validity.fill({false, "nothing is shown yet"});
}

Session::~Session() = default;
Session::Session(Session&&) noexcept = default;
Session& Session::operator=(Session&&) noexcept = default;

void Session::show(Scene scene)
{
    State& s = *state_;
    validate(scene);
    if (s.scene && same_surfaces(*s.scene, scene)) {
        const bool same_light = same_lamps(*s.scene, scene);
        take_lamps(scene, *s.scene);
        if (same_light) return;
        if (s.rays) {
            relight(*s.rays);
            s.note(SessionPart::ray_scene, true, "only lamps or the sky have changed");
        }
        return s.change_light("lamps or the sky have changed", {.everywhere = true});
    }
    const std::string why = s.scene ? "surfaces have moved or changed" : "the scene is new";
    const auto changed = s.scene && s.watches() ? changed_instances(*s.scene, scene) : std::nullopt;
    s.note(SessionPart::ray_scene, false, why);
    if (changed)
        s.change_light(why, change_between(*s.scene, scene, *changed));
    else
        s.drop_light(why);
    if (s.watches() && !changed) s.box = bounds_of(scene);
    s.changed_in.resize(scene.instances.size(), s.scene_number);
    s.graphics.caster.reset();
    s.rays.reset();  // before what it refers to
    if (!s.scene) s.scene = std::make_unique<Scene>();
    *s.scene = std::move(scene);  // views in the making refer to it
}

void Session::clear()
{
    forget_light();
    state_->note(SessionPart::ray_scene, false, "the scene was dropped");
    state_->graphics.caster.reset();
    state_->rays.reset();
    state_->scene.reset();
}

void Session::forget_light() { state_->drop_light("it was to be forgotten"); }

bool Session::has_scene() const noexcept { return state_->scene != nullptr; }

const Scene& Session::scene() const
{
    if (!state_->scene) throw Error(ErrorCode::not_found, "the session shows no scene");
    return *state_->scene;
}

ThreadPool& Session::pool() noexcept { return *state_->pool; }

GlContext& Session::gl()
{
    if (!state_->gl) state_->gl = std::make_shared<GlContext>(state_->graphics.device, state_->options.log);
    return *state_->gl;
}

const RayScene& Session::rays(const EffectChoice& choice)
{
    State& s = *state_;
    const EffectChoice asked = choice_of_rays(choice);
    if (s.rays && s.rays_choice.with == asked.with && s.rays_choice.without == asked.without) return *s.rays;
    if (s.rays) {
        const std::string why = "alpha, transmission, normal maps or instancing are chosen otherwise";
        s.note(SessionPart::ray_scene, false, why);
        s.note(SessionPart::light_cache, false, why);
        s.light_cache.reset();
        s.graphics.caster.reset();
        s.rays.reset();
    }
    s.rays.emplace(build_ray_scene(scene(), *s.pool, asked));
    s.rays_choice = asked;
    return *s.rays;
}

void Session::State::use_device(int asked)
{
    if (!gl || graphics.owns_gl) {
        if (asked != graphics.device) graphics = {}, gl.reset();
        graphics.device = asked;
        return;
    }
    if (asked >= 0 && asked != gl->device())
        throw Error(ErrorCode::bad_argument, "device is " + std::to_string(asked) + ", but the GL at hand is on " +
                                                 (gl->device() < 0 ? "none" : std::to_string(gl->device())));
}

void Session::State::prepare_caster(GlContext& with, GatherMethod asked, const LogFunction& log)
{
    bool on_device = asked == GatherMethod::device;
    if (asked == GatherMethod::automatic) {
        if (!graphics.choice) graphics.choice = choose_gather(with, *pool);
        on_device = graphics.choice->on_device;
        if (log) log(LogLevel::debug, "auto gathers by the " + graphics.choice->words());
    }
    if (!on_device) return graphics.caster.reset();
    if (graphics.caster) return;
    try {
        graphics.caster = std::make_unique<RayCaster>(with, *rays, kAllOfIt, log);
    } catch (const Error& why) {
        if (log)
            log(LogLevel::warning, std::string("the processor gathers, as the graphics device cannot: ") + why.what());
    }
}

const std::vector<Record>& Session::records() const noexcept { return state_->records; }

void Session::begin_with(std::vector<Record> records)
{
    state_->records = std::move(records);
    for (Record& record : state_->records) record.watch.state = state_->scene_number;
    state_->record_settings.clear();
    state_->record_pixel = 0.0;
    state_->contacts.clear();
    state_->error_scale.reset();
    state_->noise = {};
    state_->note(SessionPart::records, true, "they were handed over");
}

const Validity& Session::validity(SessionPart part) const { return state_->of(part); }

void Session::State::drop_light(const std::string& why)
{
    note(SessionPart::light_cache, false, why);
    note(SessionPart::records, false, why);
    light_cache.reset();
    records.clear();
    contacts.clear();
    guide.reset();
    error_scale.reset();
    samples.clear();
    changed_in.clear();
    changes.clear();
    noise = {};
    ++scene_number;
}

void Session::State::change_light(const std::string& why, SceneChange change)
{
    // A record that knows an earlier one is looked at whatever has changed.
    constexpr std::size_t kMostChanges = 64;
    if (!watches()) return drop_light(why);
    note(SessionPart::light_cache, false, why);
    light_cache.reset();
    noise.slack.reset();
    // Nobody knows what those would be that are not watched.
    std::erase_if(contacts, [](const Record& r) { return r.watch.seen.empty(); });
    ++scene_number;
    changed_in.resize(scene->instances.size(), scene_number);
    for (const std::uint32_t instance : change.instances) changed_in[instance] = scene_number;
    change.state = scene_number;
    follow_change(samples, change);
    if (changes.size() == kMostChanges) changes.erase(changes.begin());
    changes.push_back(std::move(change));
}

std::vector<Record> Session::State::take_records(const RenderOptions& asked)
{
    if (records.empty() || !options.keep_records) contacts.clear();
    if (records.empty()) {
        if (!options.keep_records) note(SessionPart::records, false, "views of this session do not share them");
        return {};
    }
    const std::string settings = record_settings_words(asked);
    if (!record_settings.empty() && record_settings != settings) {
        note(SessionPart::records, false, "they were made with " + record_settings + ", not with " + settings);
        records.clear();
        contacts.clear();
        guide.reset();
        error_scale.reset();
        noise = {};
    } else if (!record_settings.empty()) {
        const bool watched =
            std::any_of(records.begin(), records.end(), [&](const Record& r) { return r.watch.state != scene_number; });
        note(SessionPart::records, true,
             watched ? "they are watched: those that the change has reached are gathered again"
                     : "scene, lamps and options are those they were made with");
    }
    return std::exchange(records, {});
}

std::vector<Record> Session::State::keep_records(std::vector<Record> made, std::vector<Record> aside,
                                                 const RenderOptions& asked, const View& view)
{
    // A walk does not fill the memory with what lies behind: ten seconds of film. Contacts lie as close as pixels.
    constexpr std::uint32_t kMostViewsAside = 240, kMostViewsOfContacts = 12;
    ++view_number;
    for (Record& r : made) r.watch.view = view_number;
    if (options.keep_records)
        std::erase_if(aside, [&](const Record& r) { return view_number - r.watch.view > kMostViewsAside; });
    made.insert(made.end(), std::make_move_iterator(aside.begin()), std::make_move_iterator(aside.end()));
    if (!options.keep_records) {
        contacts = {};
        return made;
    }
    std::erase_if(contacts, [&](const Record& r) { return view_number - r.watch.view > kMostViewsOfContacts; });
    put_back(std::move(made), asked, view);
    return {};
}

void Session::State::put_back(std::vector<Record> kept, const RenderOptions& asked, const View& view)
{
    if (!options.keep_records) return;
    for (std::vector<Record>* part : {&kept, &contacts}) {
        // Nobody knows what those that are not watched would be in another scene than theirs.
        if (watches())
            std::erase_if(*part,
                          [&](const Record& r) { return r.watch.seen.empty() && r.watch.state != scene_number; });
        if (part->size() > options.most_records) std::erase_if(*part, [&](const Record& r) { return !shows(view, r); });
        if (part->size() > options.most_records) *part = {};
    }
    records = std::move(kept);
    record_pixel = image_plane(view).pixel;
    record_settings = record_settings_words(asked);
}

std::optional<KeptGuide> Session::State::take_guide()
{
    std::optional<KeptGuide> kept = std::exchange(guide, std::nullopt);
    if (kept && !kept->serves(scene_number, changes)) kept.reset();
    return kept;
}

void Session::State::keep_guide(KeptGuide kept, std::size_t made, std::size_t reused)
{
    if (!options.keep_records) return;
    const bool is_first = kept.end_view();
    if (!is_first) kept.made += static_cast<double>(made) / static_cast<double>(std::max<std::size_t>(1, reused));
    if (is_first || made < reused) guide = std::move(kept);
}

std::optional<ErrorScale> Session::State::find_error_scale(double changed)
{
    // Then what is there is much as it was.
    constexpr double kMostChanged = 0.25;
    if (!error_scale || (error_scale->others += changed) > kMostChanged) return std::nullopt;
    return error_scale->scale;
}

void Session::State::keep_error_scale(const ErrorScale& scale)
{
    if (options.keep_records) error_scale = {scale, 0.0};
}

const LightCache* Session::State::find_light_cache(const LightCacheUse& use)
{
    if (!light_cache) return nullptr;
    const bool kept = light_cache_use == use;
    if (kept) {
        note(SessionPart::light_cache, true, "scene, view and options are those it was built for");
        return &*light_cache;
    }
    const bool same_view = light_cache_use.view == use.view;
    note(SessionPart::light_cache, false, same_view ? "bounces, seed or effects are others" : "the view is another");
    light_cache.reset();
    return nullptr;
}

const LightCache* Session::State::keep_light_cache(LightCache cache, LightCacheUse use)
{
    light_cache.emplace(std::move(cache));
    light_cache_use = std::move(use);
    return &*light_cache;
}

std::array<Validity, kSessionParts> Session::State::end_view()
{
    const std::array<Validity, kSessionParts> found = validity;
    note(SessionPart::ray_scene, true, "nothing it depends on has changed");
    return found;
}

}  // namespace rcs
