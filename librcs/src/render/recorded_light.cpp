#include "records/lamps_to_gather.h"
#include "render/frame.h"
#include "splat/corrections.h"
#include "splat/splat_choice.h"

namespace rcs {
namespace {

SplatSettings splat_settings(const Frame& f)
{
    SplatSettings settings = f.settings.splat;
    settings.error_tolerance = f.course.records.error_tolerance;
    return settings;
}

SplatBuffer splat(Frame& f, const std::vector<Record>& records, const SplatSettings& settings, SplatStats& stats,
                  const Shading* glossy)
{
    if (f.splat_method != SplatMethod::tiles) try {
            SplatStats on_device = stats;
            SplatBuffer sums = (f.splat_method == SplatMethod::quads ? splat_quads : splat_gpu_tiles)(
                f.session.gl(), records, f.gbuffer, f.view(), settings, f.session.pool(), on_device, glossy);
            stats = on_device;
            return sums;
        } catch (const Error& why) {
            f.splat_method = f.session.state().graphics.give_up_splats(f.session.gl(), why, f.hooks.log);
            f.stats().splat_method = name_of(f.splat_method);
        }
    return splat_tiles(records, f.gbuffer, f.view(), settings, f.session.pool(), stats, glossy);
}

}  // namespace

void correct_records(Frame& f)
{
    // What a few new ones among them change is less than what there is: .02 % of demo:atrium's light at four passes.
    constexpr std::size_t kFew = 16;
    std::size_t all = f.records.size();
    for (const TakenOut& elsewhere : f.elsewhere) all += elsewhere.records.size();
    const bool few_are_new = all >= f.corrected && all - f.corrected <= all / kFew;
    if (f.corrected > 0 && few_are_new) return;
    bring_back(f);
    timed(f, "splat", [&] { set_corrections(f.records, splat_settings(f), f.session.pool()); });
    f.corrected = f.records.size();
}

RecordedLight splat_light(Frame& f, const std::vector<Record>& records)
{
    SplatSettings settings = splat_settings(f);
    const Shading* const glossy = f.settings.records.radiance ? &f.shading : nullptr;
    RecordedLight light;
    light.all = timed(f, "splat", [&] { return splat(f, records, settings, light.stats, glossy); });
    if (f.gathered.any()) {
        settings.error_sums = true;
        SplatStats again;
        light.of_lamps = timed(f, "splat", [&] {
            std::vector<Record> lamps = of_gathered_lamps(records);
            set_corrections(lamps, settings, f.session.pool());
            return splat(f, lamps, settings, again, glossy);
        });
    }
    RenderStats& stats = f.stats();
    ++(glossy ? stats.counts.glossy_splats : stats.counts.splats);
    stats.splats.splats += light.stats.splats;
    stats.splats.samples += light.stats.samples;
    return light;
}

}  // namespace rcs
