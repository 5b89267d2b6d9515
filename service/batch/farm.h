#pragma once

#include <map>
#include <string>
#include <vector>

namespace rcs::service {

/// Who runs the tasks of a batch.
enum class Engine { local, slurm, openjd };
/// "local", "slurm", "openjd". @throws rcs::Error bad_argument
Engine parse_engine(const std::string& text);

/// A batch as a farm takes it.
struct FarmJob {
    Engine engine = Engine::local;
    std::string name;                ///< for lists of jobs
    std::string folder;              ///< of the job; absolute, and the same on all machines
    std::string directory;           ///< in which the command was given
    std::vector<std::string> words;  ///< of the command that all tasks have in common, the program's path first
    int parts = 1;
    int threads = 0;       ///< that a task asks for; 0: all of its machine
    bool overture = true;  ///< frames begin with what others found
};

/// The files of a job's folder by name: `task`, which does what its first word says, and what hands it to the engine.
/// @throws rcs::Error bad_argument: more parts than the engine takes
std::map<std::string, std::string> farm_files(const FarmJob& job);

/// What starts the job, to be called with execv(); empty: nothing that could be known here.
std::vector<std::string> start_command(const FarmJob& job);

/// task.sh, submit.sh and template.yaml, by name.
const std::map<std::string, std::string>& farm_sources();

}  // namespace rcs::service
