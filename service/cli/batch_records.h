#pragma once

#include <string>

#include "batch/tasks.h"
#include "rcs/render_options.h"
#include "rcs/session.h"

namespace rcs::service {

/// Records that a file hands from one run of a batch to another. Parts only read it: they run at a time.
class SharedRecords {
public:
    /// @param file  empty: none @throws rcs::Error: it could not be written
    SharedRecords(std::string file, TaskKind task);

    /// Whether the file is still to be begun with.
    bool are_wanted() const { return !begun_ && !file_.empty(); }
    /// Once a frame's scene is shown. A file of another pose is left alone where poses change.
    /// @param is_last  this is the last scene that is tried   @return whether the session begins with them
    /// @throws rcs::Error bad_file
    bool begin(Session& session, const RenderOptions& options, bool is_animated, bool is_last, const LogFunction& log);
    /// Those that hold in the scene that is shown. @throws rcs::Error io
    void save(const Session& session, const RenderOptions& options) const;

private:
    std::string file_;
    TaskKind task_;
    bool begun_ = false;
};

}  // namespace rcs::service
