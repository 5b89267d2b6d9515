#include "scene/gltf_animation.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <set>
#include <string>
#include <utility>

#include "rcs/suggestion.h"
#include "scene/gltf_curve.h"

namespace rcs {
namespace {

using Values = std::vector<double>;

constexpr GltfNoteKind kOverlap{"motion of what an earlier animation moves", "animation", "ignored"};
constexpr GltfNoteKind kUnknownPath{"channels of a kind that this build does not know", "animation", "ignored"};

void set_pose(const GltfFile& file, const std::string& path, const Values& v, const std::string& what, NodePose& pose)
{
    if (path == "weights") {
        pose.weights = v;
    } else if (path == "rotation") {
        const glm::dquat rotation(v[3], v[0], v[1], v[2]);
        const double length = glm::length(rotation);
        if (!(length > 0.0)) bad_file(file, what + " has a rotation of length 0");
        pose.rotation = rotation / length;
    } else {
        (path == "translation" ? pose.translation : pose.scale) = glm::dvec3(v[0], v[1], v[2]);
    }
}

/// The JSON pointer that a channel of KHR_animation_pointer writes to; "" for those of glTF's own four paths.
std::string pointer_of(const tinygltf::AnimationChannel& channel)
{
    const auto found = channel.target_extensions.find("KHR_animation_pointer");
    if (channel.target_path != "pointer" || found == channel.target_extensions.end()) return {};
    const tinygltf::Value& pointer = found->second.Get("pointer");
    return pointer.IsString() ? pointer.Get<std::string>() : std::string();
}

/// Whether an animation may move what a pointer points to: all else is no part of a scene, or of no concern to it.
bool is_posed(const std::string& pointer)
{
    for (const char* root : {"/nodes/", "/materials/", "/cameras/", "/extensions/KHR_lights_punctual/lights/"})
        if (pointer.starts_with(root)) return true;
    return false;
}

/// A node and what of it moves; -1 and a pointer.
using Target = std::pair<int, std::string>;

std::set<Target> targets_of(const tinygltf::Animation& animation)
{
    std::set<Target> targets;
    for (const tinygltf::AnimationChannel& channel : animation.channels) {
        if (channel.target_node >= 0) targets.emplace(channel.target_node, channel.target_path);
        if (const std::string pointer = pointer_of(channel); !pointer.empty()) targets.emplace(-1, pointer);
    }
    return targets;
}

const tinygltf::AnimationSampler& sampler_of(const GltfFile& file, const tinygltf::Animation& animation,
                                             const tinygltf::AnimationChannel& channel, const std::string& what)
{
    if (channel.sampler < 0 || static_cast<std::size_t>(channel.sampler) >= animation.samplers.size()) {
        bad_file(file, what + " names sampler " + std::to_string(channel.sampler) + ", the animation has " +
                           std::to_string(animation.samplers.size()));
    }
    return animation.samplers[static_cast<std::size_t>(channel.sampler)];
}

/// The value that takes the place of a property, as JSON has it there.
Json property_value(const Curve& curve, const Values& values, const std::string& pointer)
{
    if (pointer.ends_with("/KHR_node_visibility/visible")) return values.front() != 0.0;
    if (curve.is_list || pointer.ends_with("/weights")) return values;
    return values.front();
}

void apply(const GltfFile& file, const tinygltf::Model& model, std::size_t index, double time, GltfPose& pose)
{
    const tinygltf::Animation& animation = model.animations[index];
    for (std::size_t i = 0; i < animation.channels.size(); ++i) {
        const tinygltf::AnimationChannel& channel = animation.channels[i];
        const std::string what = element_name("animation", index, animation.name) + ", channel " + std::to_string(i);
        const std::string& path = channel.target_path;
        if (const std::string pointer = pointer_of(channel); is_posed(pointer)) {
            const Curve curve =
                read_property_curve(file, model, sampler_of(file, animation, channel, what),
                                    pointer.starts_with("/nodes/") && pointer.ends_with("/rotation"), what);
            pose.properties.push_back({pointer, property_value(curve, evaluate(curve, time), pointer), what});
            continue;
        }
        if (path != "translation" && path != "rotation" && path != "scale" && path != "weights") {
            file.notes->add(kUnknownPath, short_name(index, animation.name));
            continue;
        }
        if (channel.target_node < 0) continue;  // glTF: ignored
        if (static_cast<std::size_t>(channel.target_node) >= pose.nodes.size()) {
            bad_file(file, what + " names node " + std::to_string(channel.target_node) + ", the file has " +
                               std::to_string(pose.nodes.size()));
        }
        const Curve curve = read_curve(file, model, sampler_of(file, animation, channel, what), path, what);
        set_pose(file, path, evaluate(curve, time), what, pose.nodes[static_cast<std::size_t>(channel.target_node)]);
    }
}

/// The one with that name, or number; none: all of them are meant.
std::optional<std::size_t> chosen_animation(const GltfFile& file, const tinygltf::Model& model,
                                            const std::string& asked)
{
    if (asked.empty() || asked == kAllAnimations) return std::nullopt;
    std::vector<std::string> names;
    for (std::size_t i = 0; i < model.animations.size(); ++i) {
        if (model.animations[i].name == asked) return i;
        if (!model.animations[i].name.empty()) names.push_back(model.animations[i].name);
    }
    std::size_t number = 0;
    const char* end = asked.data() + asked.size();
    const auto [rest, problem] = std::from_chars(asked.data(), end, number);
    if (problem == std::errc() && rest == end && number < model.animations.size()) return number;
    std::string list;
    for (const std::string& name : names) list.append(list.empty() ? "" : ", ").append(name);
    if (names.size() < model.animations.size())
        list.append(list.empty() ? "" : " and ")
            .append(std::to_string(model.animations.size() - names.size()))
            .append(" without a name, which go by their number from 0");
    fail(file, ErrorCode::not_found,
         "has no animation '" + asked + "'; it has " + (list.empty() ? "none" : list) + did_you_mean(asked, names));
}

}  // namespace

void set_properties(GltfDocument& document, const std::vector<PosedProperty>& properties)
{
    for (const auto& [pointer, value, what] : properties) {
        Json* at = &document.root;
        for (std::size_t begin = 1; begin <= pointer.size();) {
            const std::size_t end = std::min(pointer.find('/', begin), pointer.size());
            const std::string key = pointer.substr(begin, end - begin);
            begin = end + 1;
            if (at->is_array()) {
                const bool number = !key.empty() && key.find_first_not_of("0123456789") == key.npos && key.size() < 9;
                const std::size_t index = number ? std::stoul(key) : at->size();
                at = index < at->size() ? &(*at)[index] : nullptr;
            } else {
                const bool may_be_new = at != &document.root;  // an object's defaults need not be written
                const bool there = at->is_object() && at->contains(key);
                at = there || (may_be_new && (at->is_object() || at->is_null())) ? &(*at)[key] : nullptr;
            }
            if (at == nullptr)
                bad_file(document.file, what + " points to " + pointer + ", which the file does not have");
        }
        *at = value;
    }
}

GltfPose pose_at(const GltfFile& file, const tinygltf::Model& model, const LoadOptions& options)
{
    GltfPose pose{std::vector<NodePose>(model.nodes.size()), {}};
    if (const std::optional<std::size_t> one = chosen_animation(file, model, options.animation)) {
        if (options.time) apply(file, model, *one, *options.time, pose);
        return pose;
    }
    if (!options.time) return pose;
    std::set<Target> moved;
    for (std::size_t i = 0; i < model.animations.size(); ++i) {
        const std::set<Target> targets = targets_of(model.animations[i]);
        const bool overlaps =
            std::any_of(targets.begin(), targets.end(), [&](const Target& target) { return moved.contains(target); });
        if (overlaps) {
            file.notes->add(kOverlap, short_name(i, model.animations[i].name));
            continue;
        }
        moved.insert(targets.begin(), targets.end());
        apply(file, model, i, *options.time, pose);
    }
    return pose;
}

}  // namespace rcs
