#pragma once

#include <string>
#include <vector>

/// A batch in tasks, which machines that share a folder do at a time: none writes what another one does.
namespace rcs::service {

enum class TaskKind {
    all,       ///< the whole batch: its frames and the report
    overture,  ///< first frames of parts, whose records and exposure the others begin with
    part,      ///< frames that follow each other
    report,    ///< no frame: what there is, told
};

struct Task {
    TaskKind kind = TaskKind::all;
    int part = 1;   ///< in [1, parts]
    int parts = 1;  ///< of the batch
};

/// "3/6", "overture/6", "report"; "": all. @throws rcs::Error bad_argument
Task parse_task(const std::string& text);

/// How many parts of at most `chunk` frames there are.
int count_parts(std::size_t frames, int chunk);

/// Of all frames those of a task. Parts are as long as each other but for one frame; an overture takes about as long as
/// a part.
std::vector<int> frames_of(const Task& task, const std::vector<int>& all);

}  // namespace rcs::service
