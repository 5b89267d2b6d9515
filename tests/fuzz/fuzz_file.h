#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <string>

#include <unistd.h>

namespace rcs::fuzz {

/// The input as a file of this process, the same one each time. @return its path
inline std::string write_input(const std::uint8_t* data, std::size_t size, const std::string& ending)
{
    const char* const folder = std::getenv("TMPDIR");
    const std::string path =
        std::string(folder ? folder : "/tmp") + "/rcs-fuzz-" + std::to_string(::getpid()) + "." + ending;
    std::ofstream file(path, std::ios::binary);
    if (!file.write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size)).flush()) std::abort();
    return path;
}

}  // namespace rcs::fuzz
