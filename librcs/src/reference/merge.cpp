#include <cmath>
#include <cstdlib>
#include <string>

#include <glm/glm.hpp>

#include "rcs/error.h"
#include "rcs/reference.h"

namespace rcs {
namespace {

[[noreturn]] void refuse(const std::string& why)
{
    throw Error(ErrorCode::bad_argument, "the references cannot be merged: " + why);
}

std::string text_of(const LayeredImage& image, const std::string& name)
{
    const auto found = image.metadata.find(name);
    return found == image.metadata.end() ? "missing" : found->second;
}

/// A whole number of the metadata, at least 0.
int number_of(const LayeredImage& image, const std::string& name)
{
    const std::string text = text_of(image, name);
    char* end = nullptr;
    const long value = std::strtol(text.c_str(), &end, 10);
    if (end == text.c_str() || *end != '\0' || value < 0 || value > 1 << 20)
        refuse(name + " is " + text + ", expected a whole number in [0, 1048576]");
    return static_cast<int>(value);
}

void check_match(const LayeredImage& sum, const LayeredImage& more)
{
    for (const char* name : {"rcs:stride", "rcs:bounces", "rcs:aa"}) {
        if (text_of(sum, name) != text_of(more, name))
            refuse(std::string(name) + " is " + text_of(sum, name) + " in one and " + text_of(more, name) +
                   " in the other");
    }
    const bool same_seed = text_of(sum, "rcs:seed") == text_of(more, "rcs:seed");
    if (same_seed &&
        number_of(sum, "rcs:first-sample") + number_of(sum, "rcs:samples") != number_of(more, "rcs:first-sample"))
        refuse("they have the same seed, and the second does not begin at the sample where the first ends");
    for (const auto& [name, layer] : more.layers) {
        const auto found = sum.layers.find(name);
        if (found == sum.layers.end()) refuse("the first has no layer " + name);
        const Image& other = found->second;
        if (layer.width != other.width || layer.height != other.height || layer.channels != other.channels)
            refuse("layer " + name + " differs in size");
    }
    if (sum.layers.size() != more.layers.size()) refuse("the second lacks a layer");
}

/// Parts of the new whole, which add up to 1.
struct Shares {
    double first, second;
};

float mean(float first, float second, Shares shares)
{
    return static_cast<float>(shares.first * static_cast<double>(first) + shares.second * static_cast<double>(second));
}

void merge_means(Image& sum, const Image& more, Shares shares)
{
    for (std::size_t i = 0; i < sum.pixels.size(); ++i) sum.pixels[i] = mean(sum.pixels[i], more.pixels[i], shares);
}

void merge_standard_errors(Image& sum, const Image& more, Shares shares)
{
    for (std::size_t i = 0; i < sum.pixels.size(); ++i) {
        sum.pixels[i] = static_cast<float>(std::hypot(shares.first * static_cast<double>(sum.pixels[i]),
                                                      shares.second * static_cast<double>(more.pixels[i])));
    }
}

/// Of what the paths saw: pixels that none of them hit have an infinite depth and no normal.
void merge_geometry(LayeredImage& sum, const LayeredImage& more, Shares shares)
{
    Image& depths = sum.layers.at("depth");
    Image& normals = sum.layers.at("normal");
    for (int y = 0; y < depths.height; ++y) {
        for (int x = 0; x < depths.width; ++x) {
            const double first = shares.first * static_cast<double>(sum.layers.at("beauty").at(x, y)[3]);
            const double second = shares.second * static_cast<double>(more.layers.at("beauty").at(x, y)[3]);
            if (!(second > 0.0)) continue;
            const Shares cover{first / (first + second), second / (first + second)};
            const float* n = more.layers.at("normal").at(x, y);
            float* const p = normals.at(x, y);
            const float depth = *more.layers.at("depth").at(x, y);
            *depths.at(x, y) = first > 0.0 ? mean(*depths.at(x, y), depth, cover) : depth;
            const glm::dvec3 normal =
                cover.first * glm::dvec3(p[0], p[1], p[2]) + cover.second * glm::dvec3(n[0], n[1], n[2]);
            const double length = glm::length(normal);
            for (int c = 0; c < 3; ++c) p[c] = length > 0.0 ? static_cast<float>(normal[c] / length) : 0.0f;
        }
    }
}

}  // namespace

void merge_references(LayeredImage& sum, const LayeredImage& more)
{
    if (sum.layers.empty()) {
        sum = more;
        return;
    }
    check_match(sum, more);
    const int first = number_of(sum, "rcs:samples");
    const int second = number_of(more, "rcs:samples");
    const double all = first + second;
    const Shares shares{first / all, second / all};
    merge_geometry(sum, more, shares);  // weighs by the cover that beauty still holds
    for (auto& [name, layer] : sum.layers) {
        if (name == "standard_error" || name == "indirect_standard_error")
            merge_standard_errors(layer, more.layers.at(name), shares);
        else if (name != "depth" && name != "normal")
            merge_means(layer, more.layers.at(name), shares);
    }
    sum.metadata["rcs:samples"] = std::to_string(first + second);
    if (text_of(sum, "rcs:seed") != text_of(more, "rcs:seed"))
        sum.metadata["rcs:seed"] = text_of(sum, "rcs:seed") + "," + text_of(more, "rcs:seed");
}

}  // namespace rcs
