#pragma once

#include <memory>
#include <string>

#include "rcs/api.h"
#include "rcs/log.h"

namespace rcs {

/// A headless OpenGL 4.5 core context through EGL, with the programs built for it. Tries each EGL
/// device that has hardware behind it, then Mesa's surfaceless platform, then software devices.
/// Belongs to the thread that made it; several may exist.
class RCS_API GlContext {
public:
    /// @throws Error gl_unavailable: what was tried, and why each attempt failed
    explicit GlContext(const LogFunction& log = {});
    ~GlContext();
    GlContext(const GlContext&) = delete;
    GlContext& operator=(const GlContext&) = delete;

    const std::string& platform() const noexcept;  ///< "device", "surfaceless"
    const std::string& renderer() const noexcept;  ///< GL_RENDERER
    const std::string& version() const noexcept;   ///< GL_VERSION
    bool software() const noexcept;                ///< llvmpipe, softpipe and the like

    struct Impl;
    /// For the library's own use.
    Impl& impl() noexcept { return *impl_; }

private:
    std::unique_ptr<Impl> impl_;
};

}  // namespace rcs
