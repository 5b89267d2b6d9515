#include "worker/worker_seal.h"

#include <cstdlib>
#include <string>

namespace rcs::service {
namespace {

/// Shaders that GL drivers keep: in a folder of the workers' own, unless whoever started the server says where.
std::string shader_folder(const std::string& state)
{
    const std::string own = state + "/shaders";
    for (const char* name : {"MESA_SHADER_CACHE_DIR", "__GL_SHADER_DISK_CACHE_PATH"}) ::setenv(name, own.c_str(), 0);
    return std::getenv("MESA_SHADER_CACHE_DIR");
}

}  // namespace

Seal seal_worker(const WorkerArguments& arguments)
{
    Reach reach = machine_places();
    reach.read.push_back(arguments.state + "/scenes");
    reach.read.insert(reach.read.end(), arguments.roots.begin(), arguments.roots.end());
    reach.write = {arguments.home, shader_folder(arguments.state)};
    return seal_process(reach);
}

}  // namespace rcs::service
