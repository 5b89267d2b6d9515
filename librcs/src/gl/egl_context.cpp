#include <algorithm>
#include <array>
#include <cstdio>
#include <string_view>
#include <utility>
#include <vector>

#include "gl/gl_context_impl.h"
#include "gl/gl_libraries.h"
#include "gl/shader_sources.h"
#include "rcs/error.h"

namespace rcs {
namespace {

std::string egl_error_name()
{
    switch (const EGLint error = eglGetError()) {
        case EGL_SUCCESS:
            return "no reason given";
        case EGL_NOT_INITIALIZED:
            return "EGL_NOT_INITIALIZED";
        case EGL_BAD_ACCESS:
            return "EGL_BAD_ACCESS";
        case EGL_BAD_ALLOC:
            return "EGL_BAD_ALLOC";
        case EGL_BAD_ATTRIBUTE:
            return "EGL_BAD_ATTRIBUTE";
        case EGL_BAD_CONFIG:
            return "EGL_BAD_CONFIG";
        case EGL_BAD_CONTEXT:
            return "EGL_BAD_CONTEXT";
        case EGL_BAD_DISPLAY:
            return "EGL_BAD_DISPLAY";
        case EGL_BAD_MATCH:
            return "EGL_BAD_MATCH";
        case EGL_BAD_PARAMETER:
            return "EGL_BAD_PARAMETER";
        default: {
            std::array<char, 32> text{};
            std::snprintf(text.data(), text.size(), "EGL error 0x%x", static_cast<unsigned>(error));
            return text.data();
        }
    }
}

/// Whether `name` is one of the space-separated words of `extensions`, which may be null.
bool has_extension(const char* extensions, std::string_view name)
{
    std::string_view rest = extensions != nullptr ? extensions : "";
    while (!rest.empty()) {
        const std::size_t end = std::min(rest.find(' '), rest.size());
        if (rest.substr(0, end) == name) return true;
        rest.remove_prefix(std::min(end + 1, rest.size()));
    }
    return false;
}

bool is_software(const std::string& renderer)
{
    for (const char* name : {"llvmpipe", "softpipe", "swrast", "Software Rasterizer", "SWR"})
        if (renderer.find(name) != std::string::npos) return true;
    return false;
}

/// One way to a display: a platform, and the device or the default display on it.
struct Candidate {
    std::string platform;     ///< as GlContext::platform() reports it
    std::string description;  ///< for messages
    EGLenum platform_enum;
    void* native;
    int device = -1;  ///< its number
};

std::string describe_device(PFNEGLQUERYDEVICESTRINGEXTPROC query_string, EGLDeviceEXT device, const char* extensions,
                            int index)
{
    const char* file =
        has_extension(extensions, "EGL_EXT_device_drm") ? query_string(device, EGL_DRM_DEVICE_FILE_EXT) : nullptr;
    const char* kind = has_extension(extensions, "EGL_MESA_device_software") ? " (software)" : "";
    return "EGL device " + std::to_string(index) + (file != nullptr ? std::string(" (") + file + ")" : kind);
}

/// Hardware devices, the surfaceless platform, software devices: the order in which they are tried.
std::vector<Candidate> list_candidates(std::vector<std::string>& failures)
{
    const char* client = eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
    std::vector<Candidate> hardware, software;
    const auto query_devices = reinterpret_cast<PFNEGLQUERYDEVICESEXTPROC>(eglGetProcAddress("eglQueryDevicesEXT"));
    const auto query_string =
        reinterpret_cast<PFNEGLQUERYDEVICESTRINGEXTPROC>(eglGetProcAddress("eglQueryDeviceStringEXT"));
    const bool can_list =
        query_devices != nullptr && query_string != nullptr && has_extension(client, "EGL_EXT_platform_device");
    std::array<EGLDeviceEXT, 64> devices{};
    EGLint count = 0;
    if (!can_list)
        failures.emplace_back("EGL devices: EGL cannot list them");
    else if (query_devices(static_cast<EGLint>(devices.size()), devices.data(), &count) != EGL_TRUE)
        failures.push_back("EGL devices: " + egl_error_name());
    else if (count == 0)
        failures.emplace_back("EGL devices: there is none");
    for (int i = 0; i < count; ++i) {
        const EGLDeviceEXT device = devices[static_cast<std::size_t>(i)];
        const char* extensions = query_string(device, EGL_EXTENSIONS);
        auto& list = has_extension(extensions, "EGL_MESA_device_software") ? software : hardware;
        list.push_back(
            {"device", describe_device(query_string, device, extensions, i), EGL_PLATFORM_DEVICE_EXT, device, i});
    }
    std::vector<Candidate> candidates = std::move(hardware);
    if (has_extension(client, "EGL_MESA_platform_surfaceless"))
        candidates.push_back(
            {"surfaceless", "Mesa's surfaceless platform", EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY});
    else
        failures.emplace_back("Mesa's surfaceless platform: EGL has no such platform");
    candidates.insert(candidates.end(), software.begin(), software.end());
    return candidates;
}

/// Leaves a current 4.5 core context in `impl`. @return why that failed, or ""
std::string try_candidate(const Candidate& candidate, GlContext::Impl& impl)
{
    const auto get_display =
        reinterpret_cast<PFNEGLGETPLATFORMDISPLAYEXTPROC>(eglGetProcAddress("eglGetPlatformDisplayEXT"));
    if (get_display == nullptr) return "EGL lacks EGL_EXT_platform_base";
    const EGLDisplay display = get_display(candidate.platform_enum, candidate.native, nullptr);
    if (display == EGL_NO_DISPLAY) return "eglGetPlatformDisplay: " + egl_error_name();
    if (eglInitialize(display, nullptr, nullptr) != EGL_TRUE) return "eglInitialize: " + egl_error_name();
    impl.display = display;

    const char* extensions = eglQueryString(display, EGL_EXTENSIONS);
    for (const char* needed : {"EGL_KHR_surfaceless_context", "EGL_KHR_no_config_context", "EGL_KHR_create_context"})
        if (!has_extension(extensions, needed)) return std::string("the driver lacks ") + needed;
    if (eglBindAPI(EGL_OPENGL_API) != EGL_TRUE) return "eglBindAPI: " + egl_error_name();

    const std::array<EGLint, 7> attributes = {EGL_CONTEXT_MAJOR_VERSION_KHR,
                                              4,
                                              EGL_CONTEXT_MINOR_VERSION_KHR,
                                              5,
                                              EGL_CONTEXT_OPENGL_PROFILE_MASK_KHR,
                                              EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT_KHR,
                                              EGL_NONE};
    impl.context = eglCreateContext(display, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, attributes.data());
    if (impl.context == EGL_NO_CONTEXT) return "no OpenGL 4.5 core context: " + egl_error_name();
    if (eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, impl.context) != EGL_TRUE)
        return "eglMakeCurrent: " + egl_error_name();

    const auto text = [](GLenum name) {
        const GLubyte* value = glGetString(name);
        return std::string(value != nullptr ? reinterpret_cast<const char*>(value) : "unknown");
    };
    impl.platform = candidate.platform;
    impl.device = candidate.device;
    impl.renderer = text(GL_RENDERER);
    impl.version = text(GL_VERSION);
    impl.software = is_software(impl.renderer);
    return "";
}

}  // namespace

GlContext::Impl::~Impl()
{
    if (context == EGL_NO_CONTEXT) return;
    // The programs go with the context, whichever thread or context is current now.
    for (auto& [variant, program] : programs) program.release();
    if (eglGetCurrentContext() == context) eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    eglDestroyContext(display, context);
}

void GlContext::Impl::make_current()
{
    if (eglGetCurrentContext() == context) return;
    if (eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context) != EGL_TRUE)
        throw Error(ErrorCode::gl_unavailable, "the OpenGL context cannot be used in this thread: " + egl_error_name());
}

GLuint GlContext::Impl::program(const std::string& vertex, const std::string& fragment, const ShaderDefines& defines)
{
    std::string variant = vertex + " " + fragment;
    for (const std::string& name : defines) variant += " " + name;
    used.insert(variant);
    GlProgram& program = programs[variant];
    if (program.id() == 0) program = build_program(shader_sources(), vertex, fragment, defines);
    return program.id();
}

GLuint GlContext::Impl::compute_program(const std::string& compute, const ShaderDefines& defines)
{
    std::string variant = compute;
    for (const std::string& name : defines) variant += " " + name;
    used.insert(variant);
    GlProgram& program = programs[variant];
    if (program.id() == 0) program = build_compute_program(shader_sources(), compute, defines);
    return program.id();
}

namespace {

void expect_libraries()
{
    expect_library({"libEGL.so.1"}, "libegl1");
    expect_library({"libOpenGL.so.0", "libGL.so.1"}, "libopengl0");
}

/// The device of that number alone, or all.
std::vector<Candidate> choose_candidates(int device, std::vector<std::string>& failures)
{
    std::vector<Candidate> candidates = list_candidates(failures);
    if (device < 0) return candidates;
    const auto chosen =
        std::find_if(candidates.begin(), candidates.end(), [&](const Candidate& c) { return c.device == device; });
    if (chosen != candidates.end()) return {*chosen};
    std::string there;
    for (const std::string& name : gl_devices()) there.append(there.empty() ? "" : ", ").append(name);
    throw Error(ErrorCode::bad_argument, "device is " + std::to_string(device) + ", of which there is none; there " +
                                             (there.empty() ? "are no EGL devices" : "is " + there));
}

}  // namespace

std::vector<std::string> gl_devices()
{
    expect_libraries();
    std::vector<std::string> failures, names;
    for (const Candidate& c : list_candidates(failures)) {
        if (c.device < 0) continue;
        names.resize(std::max(names.size(), static_cast<std::size_t>(c.device) + 1));
        names[static_cast<std::size_t>(c.device)] = c.description;
    }
    return names;
}

GlContext::GlContext(int device, const LogFunction& log)
{
    expect_libraries();
    std::vector<std::string> failures;
    for (const Candidate& candidate : choose_candidates(device, failures)) {
        auto attempt = std::make_unique<Impl>();
        const std::string failure = try_candidate(candidate, *attempt);
        if (failure.empty()) {
            impl_ = std::move(attempt);
            break;
        }
        failures.push_back(candidate.description + ": " + failure);
    }
    std::string reasons;
    for (const std::string& failure : failures) reasons += (reasons.empty() ? "" : "; ") + failure;
    if (!impl_) throw Error(ErrorCode::gl_unavailable, "no OpenGL 4.5 through EGL; tried " + reasons);
    if (!log) return;
    if (!reasons.empty()) log(LogLevel::debug, "EGL: " + reasons);
    log(LogLevel::debug, "OpenGL " + version() + " on " + renderer() + ", " + platform() + " platform");
}

GlContext::~GlContext() = default;

const std::string& GlContext::platform() const noexcept { return impl_->platform; }
const std::string& GlContext::renderer() const noexcept { return impl_->renderer; }
const std::string& GlContext::version() const noexcept { return impl_->version; }
int GlContext::device() const noexcept { return impl_->device; }
bool GlContext::software() const noexcept { return impl_->software; }

}  // namespace rcs
