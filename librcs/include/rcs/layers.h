#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "rcs/api.h"
#include "rcs/effects.h"

namespace rcs {

/// What a picture can hold, a row of the one table of layers (layers.cpp); docs/layers.md shows it.
struct LayerKind {
    std::string_view name;       ///< in files and on the command line
    std::string_view channels;   ///< a letter each, as EXR files name them: "RGB" is layer.R, layer.G, layer.B
    std::string_view unit = {};  ///< empty: a plain number
    std::string_view what;       ///< in a few words
    EffectSet made_by = {};      ///< any of them fills it, without them it is 0; empty: every picture does
    bool in_sum = false;         ///< made where one of `made_by` is simulated even if nobody keeps it: beauty and the
                                 ///< error estimate take it in
    bool needs_float = false;    ///< halves are too coarse for it: they step by 0.5 m a kilometre away
    bool by_default = true;      ///< made unless the user says which
    bool of_render = true;       ///< what render() makes
    bool of_reference = false;   ///< what render_reference() makes
    int parts = 1;               ///< more: a file has it as so many layers of these channels, name00, name01, ...

    /// Of all parts together.
    int channel_count() const { return parts * static_cast<int>(channels.size()); }
};

/// The table; beauty is the first.
RCS_API std::span<const LayerKind> all_layers();

/// What a file calls a part of the layer: its name where there is one part alone.
RCS_API std::string part_name(const LayerKind& layer, int part);

/// @return null: there is none of that name
RCS_API const LayerKind* look_up_layer(std::string_view name);

/// What makes pictures: render() and render_reference().
enum class Renderer { records, reference };
/// Names of the layers that one of the two can make, in the table's order; beauty is the first.
RCS_API std::vector<std::string> layer_names(Renderer renderer);
/// ... of them those that are made unless the user says which.
RCS_API std::vector<std::string> default_layer_names(Renderer renderer);

/// A layer that render() can make. @throws Error not_found; lists those there are
RCS_API const LayerKind& find_layer(std::string_view name);

}  // namespace rcs
