#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "rcs/image.h"
#include "rcs/scene.h"

// Mattes by name, as Cryptomatte 1.2 lays them out (J. Friedman, A. C. Jones: Fully automatic ID mattes with support
// for motion blur and transparency. SIGGRAPH 2015 posters; github.com/Psyop/Cryptomatte, specification): each pixel has
// pairs of an id, which is a hash of a name, and the part of the pixel that it covers, largest parts first.
namespace rcs {

inline constexpr const char* kObjectLayer = "CryptoObject";
inline constexpr const char* kMaterialLayer = "CryptoMaterial";
inline constexpr int kCryptomatteRanks = 6;  ///< pairs that a picture keeps of a pixel, two in each layer of a file

/// The hash of a name as a float holds it: never zero, denormal, infinite or not a number.
std::uint32_t cryptomatte_id(std::string_view name);

/// Which id each instance of a scene has.
struct CryptomatteIds {
    std::vector<std::uint32_t> of_instance;
    std::map<std::string, std::uint32_t> names;
};
/// Of the instances' own names: those of one name are one object.
CryptomatteIds object_ids(const Scene& scene);
/// Of their materials' names, likewise.
CryptomatteIds material_ids(const Scene& scene);

/// Adds to the part that `id` covers of a pixel. @param pairs  of ids and parts, as many as a pixel ever needed
void add_coverage(Image& pairs, std::size_t pixel, std::uint32_t id, float part);
/// Adds the first pass's parts once more, where `met` is not 0.
void repeat_coverage(const Image& first, const std::vector<std::uint8_t>& met, Image& pairs);
/// The largest parts in order; of equal ones the smaller id is first. Each counts as one of `passes`.
void rank_coverage(int passes, Image& pairs);

/// What readers look for in a file's header.
void describe_cryptomatte(std::string_view layer, const CryptomatteIds& ids, LayeredImage& image);

}  // namespace rcs
