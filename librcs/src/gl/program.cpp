#include "gl/program.h"

#include <algorithm>
#include <initializer_list>
#include <sstream>
#include <string_view>

#include "rcs/error.h"

namespace rcs {
namespace {

constexpr std::string_view kInclude = "#include \"";

void append_file(const ShaderFiles& sources, const std::string& name, ResolvedShader& shader)
{
    const auto source = sources.find(name);
    if (source == sources.end()) throw Error(ErrorCode::internal, "shader file " + name + " does not exist");
    const std::size_t number = shader.files.size();
    shader.files.push_back(name);
    // #version has to come first in the text, so the outermost file begins without #line.
    if (number > 0) shader.text += "#line 1 " + std::to_string(number) + "\n";

    std::istringstream lines(source->second);
    std::string line;
    for (int at = 1; std::getline(lines, line); ++at) {
        if (line.rfind(kInclude, 0) != 0) {
            shader.text += line + "\n";
            continue;
        }
        const std::string included = line.substr(kInclude.size(), line.rfind('"') - kInclude.size());
        if (std::find(shader.files.begin(), shader.files.end(), included) == shader.files.end())
            append_file(sources, included, shader);
        shader.text += "#line " + std::to_string(at + 1) + " " + std::to_string(number) + "\n";
    }
}

[[noreturn]] void fail_with_log(const std::string& what, const std::string& log, const std::vector<std::string>& files)
{
    std::string message = what + ": " + log;
    for (std::size_t i = 0; i < files.size(); ++i)
        message += (i == 0 ? " (files: " : ", ") + std::to_string(i) + " = " + files[i];
    if (!files.empty()) message += ")";
    throw Error(ErrorCode::internal, message);
}

/// Defines belong behind #version, which has to come first.
void define(const ShaderDefines& defines, std::string& text)
{
    std::string lines;
    for (const std::string& name : defines) lines += "#define " + name + "\n";
    if (!lines.empty()) text.insert(text.find('\n') + 1, lines + "#line 2 0\n");
}

GlShader compile(const ShaderFiles& sources, const std::string& name, GLenum kind, const ShaderDefines& defines)
{
    ResolvedShader resolved = resolve_includes(sources, name);
    define(defines, resolved.text);
    GlShader shader(glCreateShader(kind));
    const char* text = resolved.text.c_str();
    glShaderSource(shader.id(), 1, &text, nullptr);
    glCompileShader(shader.id());
    GLint compiled = GL_FALSE;
    glGetShaderiv(shader.id(), GL_COMPILE_STATUS, &compiled);
    if (compiled == GL_TRUE) return shader;
    GLint length = 0;
    glGetShaderiv(shader.id(), GL_INFO_LOG_LENGTH, &length);
    std::string log(static_cast<std::size_t>(std::max(length, 1)), '\0');
    glGetShaderInfoLog(shader.id(), length, &length, log.data());
    log.resize(static_cast<std::size_t>(std::max(length, 0)));
    fail_with_log("shader " + name + " does not compile", log, resolved.files);
}

}  // namespace

ResolvedShader resolve_includes(const ShaderFiles& sources, const std::string& name)
{
    ResolvedShader shader;
    append_file(sources, name, shader);
    return shader;
}

namespace {

GlProgram link(std::initializer_list<GLuint> shaders, const std::string& words)
{
    GlProgram program(glCreateProgram());
    for (const GLuint shader : shaders) glAttachShader(program.id(), shader);
    glLinkProgram(program.id());
    for (const GLuint shader : shaders) glDetachShader(program.id(), shader);
    GLint linked = GL_FALSE;
    glGetProgramiv(program.id(), GL_LINK_STATUS, &linked);
    if (linked == GL_TRUE) return program;
    GLint length = 0;
    glGetProgramiv(program.id(), GL_INFO_LOG_LENGTH, &length);
    std::string log(static_cast<std::size_t>(std::max(length, 1)), '\0');
    glGetProgramInfoLog(program.id(), length, &length, log.data());
    log.resize(static_cast<std::size_t>(std::max(length, 0)));
    fail_with_log(words + " does not link", log, {});
}

}  // namespace

GlProgram build_program(const ShaderFiles& sources, const std::string& vertex, const std::string& fragment,
                        const ShaderDefines& defines)
{
    const GlShader vertex_shader = compile(sources, vertex, GL_VERTEX_SHADER, {});
    const GlShader fragment_shader = compile(sources, fragment, GL_FRAGMENT_SHADER, defines);
    return link({vertex_shader.id(), fragment_shader.id()}, "the program of shaders " + vertex + " and " + fragment);
}

GlProgram build_compute_program(const ShaderFiles& sources, const std::string& compute, const ShaderDefines& defines)
{
    const GlShader shader = compile(sources, compute, GL_COMPUTE_SHADER, defines);
    return link({shader.id()}, "the program of shader " + compute);
}

}  // namespace rcs
