#pragma once

#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "cli/batch_run.h"
#include "rcs/render.h"

namespace rcs::service {

/// Looks at the views of frames before they are rendered, so that the records that they share are there from the first
/// one on: those that came as the camera finds them would let light flicker. Some frames at a time, so that a long way
/// does not fill the memory.
class FramesAhead {
public:
    /// @param is_animated  the scene moves: fewer are looked at, since what is seen ahead is still another one
    /// @param all  frames of the batch, ascending
    FramesAhead(const BatchArguments& arguments, bool is_animated, const std::vector<int>& all);

    /// The frames that are looked at together with this one; none: it is not.
    std::span<const int> part_of(int number) const;
    /// Whether nobody has looked at those.
    bool is_new(int number) const { return !part_of(number).empty() && known_ != part_of(number).front(); }
    /// Before a frame: looks at those around it, unless it has. Not where a process died at one of them; where it
    /// fails, frames do without.
    /// @param camera_of  a frame's   @param killed  whether one was begun by a process that did not end it
    /// @throws rcs::Error cancelled   @return what that came to
    AheadStats look(Session& session, int number, const RenderOptions& options,
                    const std::function<Camera(int)>& camera_of, const std::function<bool(int)>& killed,
                    const RenderHooks& hooks);
    /// What looks have taken so far, those too that did not come to their end.
    double seconds() const { return seconds_; }
    /// The next frame is looked at again, with those after it alone.
    void look_again()
    {
        known_.reset();
        is_again_ = true;
    }

private:
    std::vector<int> numbers_;  // empty: none are looked at
    std::size_t at_a_time_;
    std::optional<int> known_;  // first frame of the part looked at
    bool is_again_ = false;
    double seconds_ = 0.0;
};

}  // namespace rcs::service
