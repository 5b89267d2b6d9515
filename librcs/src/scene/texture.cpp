#include "scene/texture.h"

#include <cstdint>
#include <mutex>
#include <string>
#include <utility>

#include "rcs/error.h"
#include "rcs/fingerprint.h"

namespace rcs {
namespace {

using Texel = std::array<std::uint16_t, 4>;

/// The source texels that one texel of the next level covers along one axis, and by how much.
/// Weights are whole numbers, so that no rounding moves the mean.
struct Taps {
    int first = 0;
    int count = 1;
    std::uint64_t weight[3] = {1, 0, 0};
};

/// Texel i of `half` covers source texels [i s/n, (i+1) s/n), s = `full`, n = `half` = max(1, floor(s/2)).
Taps taps_of(int i, int full, int half)
{
    if (full == 1) return {};
    if (full == 2 * half) return {2 * i, 2, {1, 1, 0}};
    // s = 2n + 1: in units of 1/n texel the interval is [i s, (i+1) s) = [2i n + i, 2i n + 2n + i + 1).
    const auto n = static_cast<std::uint64_t>(half);
    const auto at = static_cast<std::uint64_t>(i);
    return {2 * i, 3, {n - at, n, at + 1}};
}

std::vector<Taps> all_taps(int full, int half)
{
    std::vector<Taps> taps(static_cast<std::size_t>(half));
    for (int i = 0; i < half; ++i) taps[static_cast<std::size_t>(i)] = taps_of(i, full, half);
    return taps;
}

Texel weighted_mean(const Texture::Level& source, const Taps& across, const Taps& down)
{
    std::uint64_t sum[4] = {0, 0, 0, 0};
    std::uint64_t total = 0;
    for (int j = 0; j < down.count; ++j) {
        const Texel* row = source.texels.data() +
                           static_cast<std::size_t>(down.first + j) * static_cast<std::size_t>(source.width) +
                           across.first;
        for (int i = 0; i < across.count; ++i) {
            const std::uint64_t weight = across.weight[i] * down.weight[j];
            for (int channel = 0; channel < 4; ++channel) {
                sum[channel] += weight * row[i][static_cast<std::size_t>(channel)];
            }
            total += weight;
        }
    }
    const auto rounded = [&](std::uint64_t value) { return static_cast<std::uint16_t>((value + total / 2) / total); };
    return {rounded(sum[0]), rounded(sum[1]), rounded(sum[2]), rounded(sum[3])};
}

/// The common case of two even sides, in 32-bit arithmetic.
Texel mean_of_four(const Texel* upper, const Texel* lower)
{
    Texel mean{};
    for (std::size_t channel = 0; channel < 4; ++channel) {
        const std::uint32_t sum =
            std::uint32_t{upper[0][channel]} + upper[1][channel] + lower[0][channel] + lower[1][channel];
        mean[channel] = static_cast<std::uint16_t>((sum + 2) / 4);
    }
    return mean;
}

Texture::Level halve(const Texture::Level& source)
{
    Texture::Level level;
    level.width = std::max(1, source.width / 2);
    level.height = std::max(1, source.height / 2);
    level.texels.reserve(static_cast<std::size_t>(level.width) * static_cast<std::size_t>(level.height));
    const bool even = source.width % 2 == 0 && source.height % 2 == 0;
    const std::vector<Taps> columns = all_taps(source.width, level.width);
    for (int y = 0; y < level.height; ++y) {
        const Taps down = taps_of(y, source.height, level.height);
        const Texel* upper =
            source.texels.data() + static_cast<std::size_t>(down.first) * static_cast<std::size_t>(source.width);
        for (const Taps& across : columns) {
            level.texels.push_back(even ? mean_of_four(upper + across.first, upper + source.width + across.first)
                                        : weighted_mean(source, across, down));
        }
    }
    return level;
}

std::uint64_t hash_of(const std::vector<Texture::Level>& levels)
{
    Fingerprint print;
    print.add(levels.size());
    for (const Texture::Level& level : levels) {
        print.add(level.width);
        print.add(level.height);
        print.add(level.texels.size());
        print.add_bytes(level.texels.data(), level.texels.size() * sizeof(Texel));
    }
    return print.value();
}

}  // namespace

struct Texture::Levels::Held {
    std::vector<Level> levels;
    mutable std::once_flag hashed;
    mutable std::uint64_t hash = 0;

    explicit Held(std::vector<Level> taken) : levels(std::move(taken)) {}
};

Texture::Levels::Levels(std::vector<Level> levels)
    : held_(std::make_shared<const Held>(std::move(levels))), first_(held_->levels.data()), count_(held_->levels.size())
{
}

std::uint64_t Texture::Levels::hash() const
{
    if (!held_) return hash_of({});
    std::call_once(held_->hashed, [this] { held_->hash = hash_of(held_->levels); });
    return held_->hash;
}

Texture make_texture(std::string name, Texture::Level full_size)
{
    std::vector<Texture::Level> levels;
    levels.push_back(std::move(full_size));
    while (levels.back().width > 1 || levels.back().height > 1) levels.push_back(halve(levels.back()));
    return {std::move(name), std::move(levels)};
}

Texture make_texture(std::string name, int width, int height, const std::vector<glm::vec3>& linear_rgb)
{
    if (width < 1 || height < 1 ||
        linear_rgb.size() != static_cast<std::size_t>(width) * static_cast<std::size_t>(height)) {
        throw Error(ErrorCode::bad_argument, "texture '" + name + "' has " + std::to_string(linear_rgb.size()) +
                                                 " texels, expected " + std::to_string(width) + " x " +
                                                 std::to_string(height) + ", each side at least 1");
    }
    // A comparison with NaN is false: it becomes 0.
    const auto code = [](float value) {
        return static_cast<std::uint16_t>(value > 0.0f ? std::min(value, 1.0f) * 65535.0f + 0.5f : 0.0f);
    };
    Texture::Level level{width, height, {}};
    level.texels.reserve(linear_rgb.size());
    for (const glm::vec3& rgb : linear_rgb) level.texels.push_back({code(rgb.r), code(rgb.g), code(rgb.b), 65535});
    return make_texture(std::move(name), std::move(level));
}

}  // namespace rcs
