#include "worker/task.h"

#include <filesystem>

#include <sys/stat.h>

#include "rcs/number_range.h"
#include "wire/scene.h"

namespace rcs::service {

namespace fs = std::filesystem;

std::string key_of(const internal::Task& task)
{
    std::string key =
        task.scene_key() + "\n" + task.environment_file() + "\n" + task.job().environment().SerializeAsString();
    key += "\n" + task.job().scene().animation();
    if (task.frame().has_time()) key += "\n" + number_text(task.frame().time());
    if (task.job().scene().has_path()) {
        const fs::path folder = fs::path(task.scene_file()).parent_path();
        for (const std::string& name : scene_files(task.scene_file())) {
            struct stat status{};
            ::stat((folder / name).c_str(), &status);
            key.append("\n")
                .append(name)
                .append(" ")
                .append(std::to_string(status.st_size))
                .append(" ")
                .append(std::to_string(status.st_mtim.tv_sec))
                .append(".")
                .append(std::to_string(status.st_mtim.tv_nsec));
        }
    }
    return key;
}

SceneChoice scene_choice(const internal::Task& task)
{
    SceneChoice choice{task.scene_file(),
                       {},
                       from_message(task.job().environment(), task.environment_file()),
                       {},
                       task.job().scene().animation()};
    if (task.frame().has_time()) choice.time = task.frame().time();
    return choice;
}

std::optional<MotionFrom> motion_from(const internal::Task& task, const Scene& scene)
{
    if (!task.frame().has_motion()) return std::nullopt;
    return load_motion(motion_choice(task.frame()), scene, scene_choice(task),
                       camera_choice(task.frame(), task.job().camera_path()));
}

std::string in_the_users_words(std::string text, const internal::Task& task)
{
    const auto rename = [&](const std::string& path, const std::string& name) {
        for (std::size_t at = 0; path.size() > 1 && (at = text.find(path, at)) != text.npos; at += name.size())
            text.replace(at, path.size(), name);
    };
    const v1::Job& job = task.job();
    if (!job.scene().has_path()) rename(task.scene_file(), job.scene().label());
    if (!job.scene().has_path()) rename(fs::path(task.scene_file()).parent_path().string() + "/", "");
    rename(task.environment_file(), job.environment().label());
    rename(task.ocio_file(), "of the job");
    rename(task.folder() + "/", "");
    return text;
}

}  // namespace rcs::service
