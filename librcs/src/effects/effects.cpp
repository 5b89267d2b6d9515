#include "rcs/effects.h"

#include <algorithm>
#include <array>
#include <string>

#include "rcs/error.h"

namespace rcs {
namespace {

constexpr std::array<std::string_view, kEffects> kNames = {
    "emission",     "punctual-light",   "area-light",   "environment",    "environment-peaks",
    "highlights",   "indirect-diffuse", "more-bounces", "glossy-records", "traced-lobes",
    "transmission", "alpha-mask",       "alpha-blend",  "peeling",        "normal-maps",
    "hit-textures", "anti-aliasing",    "instancing",   "error-estimate"};

}  // namespace

std::string_view name_of(Effect effect) { return kNames[static_cast<std::size_t>(effect)]; }

Effect find_effect(std::string_view name)
{
    std::string names;
    for (std::size_t i = 0; i < kEffects; ++i) {
        if (kNames[i] == name) return static_cast<Effect>(i);
        names.append(names.empty() ? "" : ", ").append(kNames[i]);
    }
    throw Error(ErrorCode::not_found, std::string(name) + " is not an effect; there are " + names);
}

EffectSet EffectSet::all()
{
    EffectSet set;
    for (std::size_t i = 0; i < kEffects; ++i) set.set(static_cast<Effect>(i));
    return set;
}

EffectChoice parse_effects(std::string_view text)
{
    EffectChoice choice;
    if (text == "auto") return choice;
    if (text == "all") {
        choice.with = EffectSet::all();
        return choice;
    }
    for (std::size_t begin = 0; begin <= text.size();) {
        const std::size_t end = std::min(text.find(',', begin), text.size());
        choice.with.set(find_effect(text.substr(begin, end - begin)));
        begin = end + 1;
    }
    for (std::size_t i = 0; i < kEffects; ++i)
        choice.without.set(static_cast<Effect>(i), !choice.with.has(static_cast<Effect>(i)));
    return choice;
}

}  // namespace rcs
