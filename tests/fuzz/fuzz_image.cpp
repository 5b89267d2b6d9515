// Bytes as an image of a scene file: decoding gives a texture or one error.
#include <cstdint>
#include <cstdlib>
#include <span>

#include "rcs/error.h"
#include "scene/image_decoder.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
    constexpr std::int64_t kMostTexels = 1 << 20;
    try {
        rcs::decode_texture(std::span(data, size), rcs::ColorSpace::srgb, kMostTexels, "fuzzed", "input");
    } catch (const rcs::Error& e) {
        if (e.code() == rcs::ErrorCode::internal) std::abort();
    }
    return 0;
}
