#pragma once

#include <string>
#include <vector>

#include "cli/render_arguments.h"
#include "rcs/scene.h"
#include "view/look.h"
#include "view/viewer.h"

namespace CLI {
class App;
}

namespace rcs::service {

/// A word as a POSIX shell reads it: in quotes where it has to be.
std::string shell_word(const std::string& text);

/// What a view's command line and its page say, as `rcsplat render` would be told.
class ViewSource {
public:
    /// @param command  of `rcsplat view`, whose options have been parsed   @param arguments  of it
    ViewSource(const CLI::App& command, RenderArguments arguments);

    /// The arguments of a render of what is looked at, to view.png.
    RenderArguments arguments_of(const Look& look) const;
    /// @param scene  that is shown
    ViewRequest request_of(const Look& look, const Scene& scene) const;

private:
    RenderArguments arguments_;
    std::string given_;  ///< options of the command line that the page does not choose, with blanks before them
};

/// The first look: a camera of the scene, or that of the command line, and a point before it.
/// @param distance  to that point [m]
Look look_of(const Camera& camera, const Scene& scene, double distance);

}  // namespace rcs::service
