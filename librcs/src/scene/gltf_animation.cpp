#include "scene/gltf_animation.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <set>
#include <string>
#include <utility>

#include "scene/gltf_accessor.h"

namespace rcs {
namespace {

constexpr GltfNoteKind kOverlap{"motion of what an earlier animation moves", "animation", "ignored"};
constexpr GltfNoteKind kUnknownPath{"channels of a kind that this build does not know", "animation", "ignored"};

using Values = std::vector<double>;

/// Keyframes of one channel. Each key has `length` numbers, or three times as many with tangents.
struct Curve {
    enum class Kind { step, linear, cubic };
    Kind kind = Kind::linear;
    bool turns = false;  ///< quaternions
    std::size_t length = 0;
    std::vector<float> times;
    std::vector<float> numbers;

    /// @param part  0: value; cubic only: -1 in-tangent, 1 out-tangent
    double at(std::size_t key, std::size_t i, int part = 0) const
    {
        const std::size_t stride = kind == Kind::cubic ? 3 : 1;
        const std::size_t middle = kind == Kind::cubic ? static_cast<std::size_t>(1 + part) : 0;
        return numbers[(key * stride + middle) * length + i];
    }

    Values values(std::size_t key) const
    {
        Values result(length);
        for (std::size_t i = 0; i < length; ++i) result[i] = at(key, i);
        return result;
    }
};

/// glTF 2.0, appendix C.3: along the shorter arc.
Values slerp(const Values& from, const Values& to, double t)
{
    const glm::dquat a(from[3], from[0], from[1], from[2]);
    const glm::dquat b(to[3], to[0], to[1], to[2]);
    const glm::dquat q = glm::slerp(glm::normalize(a), glm::normalize(b), t);
    return {q.x, q.y, q.z, q.w};
}

Values evaluate(const Curve& curve, double time)
{
    const auto next = std::upper_bound(curve.times.begin(), curve.times.end(), time,
                                       [](double t, float key) { return t < static_cast<double>(key); });
    if (next == curve.times.begin()) return curve.values(0);
    const auto key = static_cast<std::size_t>(next - curve.times.begin()) - 1;
    if (next == curve.times.end() || curve.kind == Curve::Kind::step) return curve.values(key);

    const double span = static_cast<double>(*next) - curve.times[key];
    const double t = (time - curve.times[key]) / span;
    if (curve.kind == Curve::Kind::linear && curve.turns) return slerp(curve.values(key), curve.values(key + 1), t);
    Values result(curve.length);
    for (std::size_t i = 0; i < curve.length; ++i) {
        const double from = curve.at(key, i);
        const double to = curve.at(key + 1, i);
        if (curve.kind == Curve::Kind::linear) {
            result[i] = from + t * (to - from);
        } else {  // appendix C.5: a Hermite spline
            const double t2 = t * t;
            const double t3 = t2 * t;
            result[i] = (2 * t3 - 3 * t2 + 1) * from + span * (t3 - 2 * t2 + t) * curve.at(key, i, 1) +
                        (3 * t2 - 2 * t3) * to + span * (t3 - t2) * curve.at(key + 1, i, -1);
        }
    }
    return result;
}

template <class Vectors>
std::vector<float> flat(const Vectors& vectors)
{
    std::vector<float> numbers;
    for (const auto& vector : vectors) {
        for (glm::length_t i = 0; i < vector.length(); ++i) numbers.push_back(vector[i]);
    }
    return numbers;
}

/// @param path  one of the four of glTF
Curve read_curve(const GltfFile& file, const tinygltf::Model& model, const tinygltf::AnimationSampler& sampler,
                 const std::string& path, const std::string& what)
{
    Curve curve;
    if (sampler.interpolation == "STEP")
        curve.kind = Curve::Kind::step;
    else if (sampler.interpolation == "CUBICSPLINE")
        curve.kind = Curve::Kind::cubic;
    else if (sampler.interpolation != "LINEAR" && !sampler.interpolation.empty()) {
        bad_file(file,
                 what + " has the interpolation '" + sampler.interpolation + "', expected LINEAR, STEP or CUBICSPLINE");
    }
    curve.turns = path == "rotation";
    curve.times = read_scalars(file, model, sampler.input, what + ", input");
    const std::string output = what + ", output";
    if (path == "weights")
        curve.numbers = read_scalars(file, model, sampler.output, output);
    else if (path == "rotation")
        curve.numbers = flat(read_vec4(file, model, sampler.output, output));
    else
        curve.numbers = flat(read_vec3(file, model, sampler.output, output));

    const std::size_t keys = curve.times.size() * (curve.kind == Curve::Kind::cubic ? 3 : 1);
    curve.length = path == "rotation" ? 4 : path == "weights" && keys > 0 ? curve.numbers.size() / keys : 3;
    if (keys == 0 || curve.length == 0 || curve.numbers.size() != keys * curve.length) {
        bad_file(file, what + " has " + std::to_string(curve.times.size()) + " keyframes, but " +
                           std::to_string(curve.numbers.size()) + " numbers");
    }
    for (std::size_t i = 0; i < curve.times.size(); ++i) {
        if (!std::isfinite(curve.times[i]) || (i > 0 && !(curve.times[i] > curve.times[i - 1]))) {
            bad_file(file, what + " has keyframes whose times do not ascend");
        }
    }
    for (const float number : curve.numbers) {
        if (!std::isfinite(number)) bad_file(file, what + " has a value that is not finite");
    }
    return curve;
}

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

/// A node and what of it moves.
using Target = std::pair<int, std::string>;

std::set<Target> targets_of(const tinygltf::Animation& animation)
{
    std::set<Target> targets;
    for (const tinygltf::AnimationChannel& channel : animation.channels) {
        if (channel.target_node >= 0) targets.emplace(channel.target_node, channel.target_path);
    }
    return targets;
}

void apply(const GltfFile& file, const tinygltf::Model& model, std::size_t index, double time,
           std::vector<NodePose>& poses)
{
    const tinygltf::Animation& animation = model.animations[index];
    for (std::size_t i = 0; i < animation.channels.size(); ++i) {
        const tinygltf::AnimationChannel& channel = animation.channels[i];
        const std::string what = element_name("animation", index, animation.name) + ", channel " + std::to_string(i);
        const std::string& path = channel.target_path;
        if (path != "translation" && path != "rotation" && path != "scale" && path != "weights") {
            file.notes->add(kUnknownPath, short_name(index, animation.name));
            continue;
        }
        if (channel.target_node < 0) continue;  // glTF: ignored
        if (static_cast<std::size_t>(channel.target_node) >= poses.size()) {
            bad_file(file, what + " names node " + std::to_string(channel.target_node) + ", the file has " +
                               std::to_string(poses.size()));
        }
        if (channel.sampler < 0 || static_cast<std::size_t>(channel.sampler) >= animation.samplers.size()) {
            bad_file(file, what + " names sampler " + std::to_string(channel.sampler) + ", the animation has " +
                               std::to_string(animation.samplers.size()));
        }
        const Curve curve =
            read_curve(file, model, animation.samplers[static_cast<std::size_t>(channel.sampler)], path, what);
        set_pose(file, path, evaluate(curve, time), what, poses[static_cast<std::size_t>(channel.target_node)]);
    }
}

}  // namespace

std::vector<NodePose> pose_at(const GltfFile& file, const tinygltf::Model& model, double time)
{
    std::vector<NodePose> poses(model.nodes.size());
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
        apply(file, model, i, time, poses);
    }
    return poses;
}

}  // namespace rcs
