#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "rcs/api.h"
#include "rcs/image.h"
#include "rcs/log.h"
#include "rcs/thread_pool.h"

namespace rcs {

/// How scene-linear pictures are shown.
struct ToneMapOptions {
    std::string ocio_config;        ///< file; "" takes $OCIO, and where that is unset the built-in configuration
    std::string display;            ///< "" is the configuration's default display
    std::string view;               ///< "" is that display's default view
    std::optional<float> exposure;  ///< [EV], radiance x 2^EV before the view; empty: automatic
    bool one_file_only = false;     ///< a configuration that names files, as tables for colours are, is refused
};

/// A display transform, ready to use. Built from ToneMapOptions before rendering starts, so that a
/// wrong view fails early.
class RCS_API ToneMapper {
public:
    /// @throws Error not_found: a config, display or view that is named but missing (lists those there are);
    ///         bad_file: a config that OpenColorIO refuses
    explicit ToneMapper(const ToneMapOptions& options, const LogFunction& log = {});
    ~ToneMapper();
    /// Takes over what the other holds, which is of no use then.
    ToneMapper(ToneMapper&&) noexcept;
    /// The same, in place of what this one held.
    ToneMapper& operator=(ToneMapper&&) noexcept;

    /// The exposure that apply() uses for this picture [EV].
    float exposure(const Image& beauty) const;
    /// From now on this exposure takes the place of that of the options [EV]; none: automatic.
    void hold_exposure(std::optional<float> exposure);
    /// @param beauty  scene-linear RGB or RGBA
    /// @return display values in [0, 1], same size, RGB
    Image apply(const Image& beauty, ThreadPool& pool) const;

    const std::string& display() const noexcept;      ///< that it is made for
    const std::string& view() const noexcept;         ///< of that display
    const std::string& config_name() const noexcept;  ///< "built-in" or the config's file

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

/// The exposure [EV] that brings the log-average luminance of the lit pixels to middle grey 0.18
/// (Reinhard et al. 2002, eq. 1, without pixels that are black). 0 for a black picture.
RCS_API float automatic_exposure(const Image& beauty);

}  // namespace rcs
