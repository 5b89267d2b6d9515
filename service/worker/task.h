#pragma once

#include <optional>
#include <string>

#include "rcs/internal/worker.pb.h"
#include "rcs/motion.h"
#include "rcs/scene_choice.h"

/// What a task asks for, in the library's words.
namespace rcs::service {

/// Everything that the loaded scene depends on; of files by path also when they were written.
std::string key_of(const internal::Task& task);
SceneChoice scene_choice(const internal::Task& task);
std::optional<MotionFrom> motion_from(const internal::Task& task, const Scene& scene);

/// What went wrong as the user knows things: by the names in the job, not by those of the server's folders.
std::string in_the_users_words(std::string text, const internal::Task& task);

}  // namespace rcs::service
