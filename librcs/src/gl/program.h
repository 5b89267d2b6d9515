#pragma once

#include <map>
#include <string>
#include <vector>

#include "gl/gl_objects.h"

namespace rcs {

/// Files of shaders/ by name, as shader_sources() gives them.
using ShaderFiles = std::map<std::string, std::string>;

/// A shader's text with its `#include "..."` lines replaced by the files they name, each once. #line
/// directives number the files, so that a driver's message "1:12" means line 12 of files[1].
struct ResolvedShader {
    std::string text;
    std::vector<std::string> files;
};
/// @throws Error internal: a file that does not exist
ResolvedShader resolve_includes(const ShaderFiles& sources, const std::string& name);

/// Names that a variant of a shader is compiled with, as by #define.
using ShaderDefines = std::vector<std::string>;

/// Compiles and links a vertex and a fragment shader in the current context.
/// @param defines  of the fragment shader
/// @throws Error internal, with the driver's log
GlProgram build_program(const ShaderFiles& sources, const std::string& vertex, const std::string& fragment,
                        const ShaderDefines& defines = {});

/// The same of a compute shader.
GlProgram build_compute_program(const ShaderFiles& sources, const std::string& compute,
                                const ShaderDefines& defines = {});

}  // namespace rcs
