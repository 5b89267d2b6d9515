#pragma once

#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace rcs::service {

/// What a command line takes, in words: help, completions, manual pages and the reference all read this.
struct OptionText {
    std::vector<std::string> names;    ///< "--output", "-o"; of a word without dashes its one name
    std::string value;                 ///< what follows it, as "FILE"; "" of a flag
    std::vector<std::string> choices;  ///< the values, if they are few and all known
    std::string help;                  ///< a sentence or two
    std::string by_default;            ///< the value without it; "": none, or the help says so
    std::string group;
    bool required = false;
};

struct CommandText {
    std::string name;   ///< "rcsplat render"
    std::string about;  ///< one line
    std::string notes;  ///< what its help ends in
    std::vector<OptionText> words, options;
    std::vector<CommandText> commands;  ///< those beneath it
};

/// @param name  as its caller calls it
CommandText describe(const CLI::App& app, const std::string& name);

/// "render" of the command "rcsplat render".
std::string last_word(const std::string& name);

/// Under a group's name, where options of one kind stand in help and manual.
namespace option_group {
inline constexpr const char* kView = "What is seen";
inline constexpr const char* kQuality = "Quality: settings, a target error or a budget";
inline constexpr const char* kOutput = "Output";
inline constexpr const char* kFrames = "Frames";
inline constexpr const char* kFarm = "Tasks on several machines";
inline constexpr const char* kServe = "The service";
inline constexpr const char* kPage = "The page";
inline constexpr const char* kOther = "Other";
// Of --help-all alone, unless all of a command's options fit on a screen.
inline constexpr const char* kCamera = "Another camera";
inline constexpr const char* kRecords = "Records";
inline constexpr const char* kDirect = "Direct light and reflections";
inline constexpr const char* kEffects = "Effects";
inline constexpr const char* kFiles = "How pictures are written";
inline constexpr const char* kLimits = "Limits";
inline constexpr const char* kServer = "Render server";
inline constexpr const char* kMachine = "This machine";
}  // namespace option_group

/// In the order of help.
const std::vector<std::string>& option_groups();
bool is_for_experts(const std::string& group);

}  // namespace rcs::service
