#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "scene/gltf_file.h"
#include "scene/tinygltf.h"

namespace rcs {

/// Keyframes of one channel. Each key has `length` numbers, or three times as many with tangents.
struct Curve {
    enum class Kind { step, linear, cubic };
    Kind kind = Kind::linear;
    bool turns = false;    ///< quaternions
    bool is_list = false;  ///< of a property: JSON has an array there
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

    std::vector<double> values(std::size_t key) const
    {
        std::vector<double> result(length);
        for (std::size_t i = 0; i < length; ++i) result[i] = at(key, i);
        return result;
    }
};

/// The value at a time [s], held at the first and last keyframe outside of them.
std::vector<double> evaluate(const Curve& curve, double time);

/// @param path  one of the four of glTF   @throws Error bad_file
Curve read_curve(const GltfFile& file, const tinygltf::Model& model, const tinygltf::AnimationSampler& sampler,
                 const std::string& path, const std::string& what);
/// The same for KHR_animation_pointer: what a key has follows from the accessor. @param turns  quaternions
Curve read_property_curve(const GltfFile& file, const tinygltf::Model& model, const tinygltf::AnimationSampler& sampler,
                          bool turns, const std::string& what);

}  // namespace rcs
