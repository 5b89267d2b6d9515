#include "cli/running_mark.h"

#include <filesystem>
#include <fstream>
#include <system_error>
#include <utility>

#include "output/stats_json.h"

namespace rcs::service {

int starts_without_end(const std::string& running)
{
    std::ifstream file(running);
    int starts = 0;
    return file >> starts ? starts : 0;
}

RunningMark::RunningMark(std::string path) : path_(std::move(path))
{
    write_text_file(path_, std::to_string(starts_without_end(path_) + 1) + "\n");
}

RunningMark::~RunningMark()
{
    std::error_code ignored;
    std::filesystem::remove(path_, ignored);
}

}  // namespace rcs::service
