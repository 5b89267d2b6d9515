#include "batch/tasks.h"

#include <algorithm>
#include <regex>

#include "rcs/error.h"

namespace rcs::service {
namespace {

/// Where a part begins, counted from 0; that after the last one ends the frames.
std::size_t begin_of(std::size_t part, std::size_t parts, std::size_t frames) { return frames * part / parts; }

}  // namespace

Task parse_task(const std::string& text)
{
    static const std::regex form(R"(^(overture|\d{1,5})/(\d{1,5})$)");
    if (text.empty()) return {};
    if (text == "report") return {TaskKind::report};
    std::smatch found;
    if (!std::regex_match(text, found, form))
        throw Error(ErrorCode::bad_argument, text + " is neither K/N nor overture/N nor report");
    Task task{TaskKind::overture, 1, std::stoi(found[2])};
    if (found[1] != "overture") task = {TaskKind::part, std::stoi(found[1]), task.parts};
    if (task.part < 1 || task.part > task.parts)
        throw Error(ErrorCode::bad_argument, text + " is none of the parts 1 to " + std::to_string(task.parts));
    return task;
}

int count_parts(std::size_t frames, int chunk)
{
    const auto most = static_cast<std::size_t>(chunk);
    return static_cast<int>((frames + most - 1) / most);
}

std::vector<int> frames_of(const Task& task, const std::vector<int>& all)
{
    const auto part = static_cast<std::size_t>(task.part), parts = static_cast<std::size_t>(task.parts);
    if (parts > all.size())
        throw Error(ErrorCode::bad_argument, "--task: " + std::to_string(all.size()) + " frames do not make " +
                                                 std::to_string(parts) + " parts");
    if (task.kind == TaskKind::part)
        return {all.begin() + static_cast<std::ptrdiff_t>(begin_of(part - 1, parts, all.size())),
                all.begin() + static_cast<std::ptrdiff_t>(begin_of(part, parts, all.size()))};
    if (task.kind != TaskKind::overture) return all;
    std::vector<int> frames;
    const std::size_t count = std::min(parts, (all.size() + parts - 1) / parts);
    for (std::size_t i = 0; i < count; ++i) frames.push_back(all[begin_of(i * parts / count, parts, all.size())]);
    return frames;
}

}  // namespace rcs::service
