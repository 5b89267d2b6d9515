#pragma once

#include <map>
#include <set>
#include <string>

#include <epoxy/egl.h>

#include "gl/program.h"
#include "rcs/gl_context.h"

namespace rcs {

struct [[gnu::visibility("hidden")]] GlContext::Impl {
    /// Initialised, and left so: a display belongs to the whole process, eglTerminate would end it for other
    /// contexts on it too, and Mesa's driver loses a little memory each time it is loaded again.
    EGLDisplay display = EGL_NO_DISPLAY;
    EGLContext context = EGL_NO_CONTEXT;
    std::string platform, renderer, version;
    bool software = false;
    int device = -1;                            ///< its number; -1: none has
    std::map<std::string, GlProgram> programs;  ///< by vertex and fragment shader and defines
    std::set<std::string> used;                 ///< of these, since a render began

    Impl() = default;
    ~Impl();
    Impl(const Impl&) = delete;
    Impl& operator=(const Impl&) = delete;

    /// Every stage that draws begins with this: another context may have been made current meanwhile.
    void make_current();

    /// The program of these two files of shaders/, built when it is first asked for.
    GLuint program(const std::string& vertex, const std::string& fragment, const ShaderDefines& defines = {});
    /// The same of a compute shader.
    GLuint compute_program(const std::string& compute, const ShaderDefines& defines = {});
};

}  // namespace rcs
