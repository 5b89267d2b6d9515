#include "rcs/option_table.h"

#include <algorithm>
#include <iterator>

#include "rcs/error.h"

namespace rcs {
namespace {

constexpr std::string_view kSplatMethods[] = {"auto", "quads", "tiles", "gpu-tiles"};
static_assert(static_cast<int>(SplatMethod::automatic) == 0 && static_cast<int>(SplatMethod::gpu_tiles) == 3);
constexpr std::string_view kGatherMethods[] = {"auto", "cpu", "gpu"};
static_assert(static_cast<int>(GatherMethod::automatic) == 0 && static_cast<int>(GatherMethod::device) == 2);
constexpr std::string_view kDenoisers[] = {"off", "oidn"};
static_assert(static_cast<int>(Denoiser::none) == 0 && static_cast<int>(Denoiser::oidn) == 1);
constexpr UnitSuffix kPercent[] = {{"%", 0.01}};
constexpr UnitSuffix kTimes[] = {{"s", 1.0}, {"m", 60.0}};

constexpr double kNoLimit = 1e9;  ///< more than any picture has pixels
constexpr double kTwoTo64 = 18446744073709551616.0;

constexpr OptionInfo kTable[] = {
    {.key = "width",
     .name = "--size",
     .field = &RenderOptions::width,
     .range = {1, 16384},
     .unit = "px",
     .group = OptionGroup::picture,
     .help = "Width of the picture"},
    {.key = "height",
     .name = "--size",
     .field = &RenderOptions::height,
     .range = {1, 16384},
     .unit = "px",
     .group = OptionGroup::picture,
     .help = "Height of the picture"},
    {.key = "crop",
     .name = "--crop",
     .field = &RenderOptions::crop,
     .unit = "px",
     .group = OptionGroup::picture,
     .help = "Render this window of the picture alone, X,Y its upper left corner"},
    {.key = "f_stop",
     .name = "--f-stop",
     .field = &RenderOptions::f_stop,
     .range = {0, 1e6, true},
     .group = OptionGroup::picture,
     .help = "Depth of field by a lens of that f-number before 24 mm of film"},
    {.key = "focus",
     .name = "--focus",
     .field = &RenderOptions::focus,
     .range = {0, 1e9, true},
     .unit = "m",
     .group = OptionGroup::picture,
     .help = "With --f-stop: depth of what is sharp"},
    {.key = "target_error",
     .name = "--target-error",
     .field = &TargetError::error,
     .range = {0, 1, true},
     .suffixes = kPercent,
     .group = OptionGroup::quality,
     .help =
         "Mean relative error to stop at, such as 5%, of the picture and of its indirect light: records and rays go "
         "where it takes them"},
    {.key = "target_indirect_error",
     .name = "--target-error",
     .field = &TargetIndirectError::error,
     .range = {0, 1, true},
     .prefix = "indirect=",
     .suffixes = kPercent,
     .group = OptionGroup::quality,
     .help = "The same for indirect light alone, such as indirect=5%"},
    {.key = "budget_seconds",
     .name = "--budget",
     .field = &Budget::seconds,
     .range = {0, 1e6, true},
     .unit = "s",
     .suffixes = kTimes,
     .group = OptionGroup::quality,
     .help = "Wall time to spend, such as 20s or 2m: records and rays go where they lower the error most"},
    {.key = "bounces",
     .name = "--bounces",
     .field = &RenderOptions::bounces,
     .range = {0, 64},
     .records = RecordUse::bound,
     .group = OptionGroup::quality,
     .help = "Bounces of indirect light; 8 is about all there is"},
    {.key = "error_tolerance",
     .name = "--accuracy",
     .field = &QualitySettings::error_tolerance,
     .range = {0, 1, true},
     .records = RecordUse::bound,
     .group = OptionGroup::quality,
     .help = "Ward's a, the error that records may be off by; smaller is finer"},
    {.key = "rays",
     .name = "--rays",
     .field = &QualitySettings::rays,
     .range = {16, 65536},
     .records = RecordUse::bound,
     .group = OptionGroup::quality,
     .help = "Hemisphere rays for each record at first"},
    {.key = "noise_target",
     .name = "--noise",
     .field = &QualitySettings::noise_target,
     .range = {0, 1, true},
     .records = RecordUse::bound,
     .group = OptionGroup::quality,
     .help = "Standard error wanted at a pixel, relative to its light, on wide plain surfaces; where records lie "
             "closer it may be more. Noisy places take more rays"},
    {.key = "refinement",
     .name = "--refinement",
     .field = &QualitySettings::refinement,
     .range = {1, 512},
     .records = RecordUse::bound,
     .group = OptionGroup::records,
     .help = "So many times --rays a record takes at the most where --noise asks for more; 1 takes no more anywhere"},
    {.key = "min_reach",
     .name = "--min-reach",
     .field = &RenderOptions::min_reach,
     .range = {0, kNoLimit, true},
     .unit = "px",
     .records = RecordUse::bound,
     .help = "Least harmonic mean distance of a record, at most --max-reach: --accuracy times it is the closest that "
             "records lie, a third of that where light is steep"},
    {.key = "max_reach",
     .name = "--max-reach",
     .field = &RenderOptions::max_reach,
     .range = {0, kNoLimit, true},
     .unit = "px",
     .records = RecordUse::bound,
     .help = "Largest harmonic mean distance of a record: --accuracy times it is the widest that records lie apart"},
    {.key = "gradient_limit",
     .name = "--gradient-limit",
     .field = &RenderOptions::gradient_limit,
     .range = {0, kNoLimit, true},
     .records = RecordUse::bound,
     .help = "Harmonic mean distance of a record at the most, in times the way on which its light doubles"},
    {.key = "overlap",
     .name = "--overlap",
     .field = &RenderOptions::overlap,
     .range = {1, 16},
     .records = RecordUse::by_goal,
     .help = "Reach of a record, in times the distance to the next one; more is smoother"},
    {.key = "splat",
     .name = "--splat",
     .field = &RenderOptions::splat,
     .choices = kSplatMethods,
     .help = "How records reach the image; auto takes tiles on a software OpenGL, on a graphics card what a short "
             "measurement, kept in the user's cache folder, found fastest"},
    {.key = "gather",
     .name = "--gather",
     .field = &RenderOptions::gather,
     .choices = kGatherMethods,
     .help = "What traces the rays of records; auto takes the graphics card where a short measurement, kept in the "
             "user's cache folder, found it faster, else the processor"},
    {.key = "device",
     .name = "--device",
     .field = &RenderOptions::device,
     .range = {-1, 63},
     .help = "Graphics device by its number, as rcsplat doctor lists them; -1 takes hardware before software"},
    {.key = "aa",
     .name = "--aa",
     .field = &RenderOptions::aa,
     .range = {1, 256},
     .group = OptionGroup::quality,
     .help = "Samples a pixel; 1 samples its centre"},
    {.key = "area_samples",
     .name = "--area-samples",
     .field = &RenderOptions::area_samples,
     .range = {1, 1024},
     .group = OptionGroup::direct,
     .help = "Shadow rays a pixel towards lamps with area; penumbras take more"},
    {.key = "penumbra_samples",
     .name = "--penumbra-samples",
     .field = &RenderOptions::penumbra_samples,
     .range = {1, 65536},
     .group = OptionGroup::direct,
     .help = "The same in penumbras, where fewer than --area-samples count as those"},
    {.key = "lamp_picks",
     .name = "--lamp-picks",
     .field = &RenderOptions::lamp_picks,
     .range = {0, 1024},
     .group = OptionGroup::direct,
     .help = "So many triangles of lamps, picked by what they would send, stand for all: quick and noisy; 0 leaves "
             "none out"},
    {.key = "lobe_rays",
     .name = "--lobe-rays",
     .field = &RenderOptions::lobe_rays,
     .range = {1, 1024},
     .group = OptionGroup::direct,
     .help = "Rays a pixel along reflections too sharp for records; up to six times as many where noise would show"},
    {.key = "denoise",
     .name = "--denoise",
     .field = &RenderOptions::denoise,
     .choices = kDenoisers,
     .given_alone = "oidn",
     .group = OptionGroup::direct,
     .help = "Filter direct light and sharp reflections by Open Image Denoise 2, which has to be installed (PyPI: "
             "pyoidn), where independent samples say that it helps"},
    {.key = "with_effects",
     .name = "--with",
     .field = &EffectChoice::with,
     .records = RecordUse::bound,
     .group = OptionGroup::effects,
     .help = "Simulate these effects in any case; may be given several times"},
    {.key = "without_effects",
     .name = "--without",
     .field = &EffectChoice::without,
     .records = RecordUse::bound,
     .group = OptionGroup::effects,
     .help = "Leave these effects out in any case"},
    {.key = "seed",
     .name = "--seed",
     .field = &RenderOptions::seed,
     .range = {0, kTwoTo64},
     .help = "Seed of all random numbers"},
};

}  // namespace

std::span<const OptionInfo> option_table() { return kTable; }

const OptionInfo& find_option(std::string_view key)
{
    const auto found =
        std::find_if(std::begin(kTable), std::end(kTable), [&](const OptionInfo& o) { return o.key == key; });
    if (found == std::end(kTable)) throw Error(ErrorCode::internal, "there is no option " + std::string(key));
    return *found;
}

const OptionInfo& option_for(const OptionInfo& option, std::string_view text)
{
    const auto found = std::find_if(std::begin(kTable), std::end(kTable), [&](const OptionInfo& o) {
        return o.name == option.name && !o.prefix.empty() && text.starts_with(o.prefix);
    });
    return found == std::end(kTable) ? option : *found;
}

}  // namespace rcs
