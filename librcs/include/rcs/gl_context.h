#pragma once

#include <memory>
#include <string>
#include <vector>

#include "rcs/api.h"
#include "rcs/log.h"

namespace rcs {

/// A headless OpenGL 4.5 core context through EGL, with the programs built for it. Tries each EGL
/// device that has hardware behind it, then Mesa's surfaceless platform, then software devices.
/// Belongs to the thread that made it; several may exist.
class RCS_API GlContext {
public:
    /// @throws Error gl_unavailable: what was tried, and why each attempt failed
    explicit GlContext(const LogFunction& log = {}) : GlContext(-1, log) {}
    /// On one EGL device and no other. @param device  its index in gl_devices(); -1: as above
    /// @throws Error bad_argument: there is no such device, and which there are; gl_unavailable
    explicit GlContext(int device, const LogFunction& log = {});
    ~GlContext();
    GlContext(const GlContext&) = delete;
    GlContext& operator=(const GlContext&) = delete;

    const std::string& platform() const noexcept;  ///< "device", "surfaceless"
    const std::string& renderer() const noexcept;  ///< GL_RENDERER
    const std::string& version() const noexcept;   ///< GL_VERSION
    int device() const noexcept;                   ///< its number; -1: none has
    bool software() const noexcept;                ///< llvmpipe, softpipe and the like

    struct Impl;
    /// For the library's own use.
    Impl& impl() noexcept { return *impl_; }

private:
    std::unique_ptr<Impl> impl_;
};

/// The EGL devices of this machine, by number: what is known of each without using it. Empty where EGL cannot list
/// them.
/// @throws Error gl_unavailable: there is no EGL
RCS_API std::vector<std::string> gl_devices();

}  // namespace rcs
