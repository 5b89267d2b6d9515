// Bytes as a scene file, binary or not: loading gives a valid scene or one error.
#include <cstdint>
#include <cstdlib>

#include "fuzz_file.h"
#include "rcs/error.h"
#include "rcs/scene.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
    const char* const ending = size > 0 && data[0] == '{' ? "gltf" : "glb";
    try {
        rcs::validate(rcs::load_scene(rcs::fuzz::write_input(data, size, ending)));
    } catch (const rcs::Error& e) {
        if (e.code() == rcs::ErrorCode::internal) std::abort();
    }
    return 0;
}
