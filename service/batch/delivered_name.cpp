#include "batch/delivered_name.h"

#include <filesystem>

#include "batch/frames.h"
#include "process/printable.h"

namespace rcs::service {

std::string delivered_name(const std::string& given, const std::string& output, int frames)
{
    const bool usable =
        !given.empty() && given.front() != '.' && given.find('/') == given.npos && printable(given) == given;
    const std::filesystem::path name = usable ? given : output;
    if (frames == 1 || has_frame_pattern(name.string())) return name.string();
    return name.stem().string() + ".####" + name.extension().string();
}

}  // namespace rcs::service
