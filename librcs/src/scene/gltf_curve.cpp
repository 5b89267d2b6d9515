#include "scene/gltf_curve.h"

#include <algorithm>
#include <cmath>

#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>

#include "scene/gltf_accessor.h"

namespace rcs {
namespace {

/// glTF 2.0, appendix C.3: along the shorter arc.
std::vector<double> slerp(const std::vector<double>& from, const std::vector<double>& to, double t)
{
    const glm::dquat a(from[3], from[0], from[1], from[2]);
    const glm::dquat b(to[3], to[0], to[1], to[2]);
    const glm::dquat q = glm::slerp(glm::normalize(a), glm::normalize(b), t);
    return {q.x, q.y, q.z, q.w};
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

/// Interpolation and times; the numbers are still to be read.
Curve begin_curve(const GltfFile& file, const tinygltf::Model& model, const tinygltf::AnimationSampler& sampler,
                  const std::string& what)
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
    curve.times = read_scalars(file, model, sampler.input, what + ", input");
    return curve;
}

std::size_t keys_of(const Curve& curve) { return curve.times.size() * (curve.kind == Curve::Kind::cubic ? 3 : 1); }

void check_curve(const GltfFile& file, const Curve& curve, const std::string& what)
{
    const std::size_t keys = keys_of(curve);
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
}

}  // namespace

std::vector<double> evaluate(const Curve& curve, double time)
{
    const auto next = std::upper_bound(curve.times.begin(), curve.times.end(), time,
                                       [](double t, float key) { return t < static_cast<double>(key); });
    if (next == curve.times.begin()) return curve.values(0);
    const auto key = static_cast<std::size_t>(next - curve.times.begin()) - 1;
    if (next == curve.times.end() || curve.kind == Curve::Kind::step) return curve.values(key);

    const double span = static_cast<double>(*next) - curve.times[key];
    const double t = (time - curve.times[key]) / span;
    if (curve.kind == Curve::Kind::linear && curve.turns) return slerp(curve.values(key), curve.values(key + 1), t);
    std::vector<double> result(curve.length);
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

Curve read_curve(const GltfFile& file, const tinygltf::Model& model, const tinygltf::AnimationSampler& sampler,
                 const std::string& path, const std::string& what)
{
    Curve curve = begin_curve(file, model, sampler, what);
    curve.turns = path == "rotation";
    const std::string output = what + ", output";
    if (path == "weights")
        curve.numbers = read_scalars(file, model, sampler.output, output);
    else if (path == "rotation")
        curve.numbers = flat(read_vec4(file, model, sampler.output, output));
    else
        curve.numbers = flat(read_vec3(file, model, sampler.output, output));

    const std::size_t keys = keys_of(curve);
    curve.length = path == "rotation" ? 4 : path == "weights" && keys > 0 ? curve.numbers.size() / keys : 3;
    check_curve(file, curve, what);
    return curve;
}

Curve read_property_curve(const GltfFile& file, const tinygltf::Model& model, const tinygltf::AnimationSampler& sampler,
                          bool turns, const std::string& what)
{
    Curve curve = begin_curve(file, model, sampler, what);
    curve.turns = turns;
    const std::string output = what + ", output";
    accessor_count(file, model, sampler.output, output);  // there is such an accessor
    const int type = model.accessors[static_cast<std::size_t>(sampler.output)].type;
    if (type == TINYGLTF_TYPE_VEC2)
        curve.numbers = flat(read_vec2(file, model, sampler.output, output));
    else if (type == TINYGLTF_TYPE_VEC3)
        curve.numbers = flat(read_vec3(file, model, sampler.output, output));
    else if (type == TINYGLTF_TYPE_VEC4 || turns)
        curve.numbers = flat(read_vec4(file, model, sampler.output, output));
    else
        curve.numbers = read_scalars(file, model, sampler.output, output);
    const std::size_t keys = keys_of(curve);
    curve.length = keys > 0 ? curve.numbers.size() / keys : 0;
    curve.is_list = type != TINYGLTF_TYPE_SCALAR || curve.length > 1;
    check_curve(file, curve, what);
    return curve;
}

}  // namespace rcs
