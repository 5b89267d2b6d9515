# Writes `output`, a C++ file that holds the named files of shaders/ as text: the library needs no
# shader files at run time.
function(rcs_embed_shaders output)
    set(entries "")
    foreach(name IN LISTS ARGN)
        set(path ${PROJECT_SOURCE_DIR}/shaders/${name})
        set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${path})
        file(READ ${path} text)
        string(APPEND entries "    {\"${name}\", R\"glsl(${text})glsl\"},\n")
    endforeach()
    file(CONFIGURE OUTPUT ${output} @ONLY CONTENT [[
// Made by embed_shaders.cmake from shaders/.
#include "gl/shader_sources.h"

namespace rcs {
const std::map<std::string, std::string>& shader_sources()
{
    static const std::map<std::string, std::string> sources = {
@entries@    };
    return sources;
}
}  // namespace rcs
]])
endfunction()
