#include "cli/advice.h"

#include <algorithm>
#include <cctype>
#include <string_view>
#include <utility>

#include "cli/describe.h"
#include "rcs/error.h"
#include "rcs/suggestion.h"

namespace rcs::service {
namespace {

/// What other programs call it, and what it is called here.
constexpr std::pair<std::string_view, std::string_view> kElsewhere[] = {
    {"--resolution", "--size"},
    {"--width", "--size"},
    {"--height", "--size"},
    {"--res", "--size"},
    {"--samples", "--aa"},
    {"--spp", "--aa"},
    {"--out", "--output"},
    {"--verbose", "--log-level"},
    {"--quality", "--accuracy"},
    {"--gpu", "--gather"},
    {"--cpu", "--threads"},
    {"--jobs", "--threads"},
    {"--hdri", "--environment"},
    {"--sky", "--environment"},
    {"--envmap", "--environment"},
    {"--depth", "--bounces"},
    {"--max-depth", "--bounces"},
    {"--ev", "--exposure"},
    {"--frame", "--time"},
    {"--host", "--server"},
    {"--port", "--server"},
    {"help", "--help"},
    {"version", "--version"},
    {"-V", "--version"},
    {"-v", "--version"},
    {"jobs", "list"},
    {"ps", "list"},
    {"start", "serve"},
    {"server", "serve"},
    {"status", "list"},
    {"diff", "compare"},
    {"check", "doctor"},
    {"test", "doctor"},
    {"log", "watch"},
    {"result", "fetch"},
    {"download", "fetch"},
    {"kill", "cancel"},
    {"animate", "batch"},
    {"kill", "cancel"},
};

std::vector<std::string> names_of(const std::vector<OptionText>& options)
{
    std::vector<std::string> names;
    for (const OptionText& option : options) names.insert(names.end(), option.names.begin(), option.names.end());
    return names;
}

bool has(const std::vector<std::string>& names, std::string_view name)
{
    return std::find(names.begin(), names.end(), name) != names.end();
}

/// The name here of what was written, or "".
std::string meant(const std::string& word, const std::vector<std::string>& names)
{
    for (const auto& [elsewhere, here] : kElsewhere)
        if (word == elsewhere && has(names, here)) return std::string(here);
    const bool one_dash = word.size() > 2 && word[0] == '-' && word[1] != '-';
    std::string dashed(one_dash ? "-" : "");
    return closest_name(dashed.append(word), names);
}

bool is_scene(const std::string& word)
{
    return word.starts_with("demo:") || word.ends_with(".glb") || word.ends_with(".gltf");
}

bool is_picture(const std::string& word)
{
    return word.ends_with(".png") || word.ends_with(".jpg") || word.ends_with(".jpeg") || word.ends_with(".exr");
}

std::string unknown_command(const CommandText& program, const std::string& word)
{
    std::vector<std::string> names = names_of(program.options);
    std::string listed;
    for (const CommandText& command : program.commands) {
        names.push_back(command.name.substr(command.name.rfind(' ') + 1));
        listed.append(listed.empty() ? "" : ", ").append(names.back());
    }
    if (is_scene(word)) return "'" + word + "' is no command; did you mean rcsplat render " + word + "?";
    const std::string name = meant(word, names);
    const std::string what = word.starts_with('-') ? "there is no option '" : "there is no command '";
    return what + word + "'; " + (name.empty() ? "there are " + listed : "did you mean rcsplat " + name + "?");
}

std::string unknown_option(const CommandText& command, const CommandText& program, const std::string& word)
{
    const std::string written = word.substr(0, word.find('='));
    std::string text = command.name + " has no option '" + written + "'";
    const std::string name = meant(written, names_of(command.options));
    if (!name.empty()) return text + "; did you mean " + name + "?";
    for (const CommandText& other : program.commands)
        if (has(names_of(other.options), written))
            return text + ", " + other.name + " has; " + command.name + " --help lists its own";
    return text + "; " + command.name + " --help-all lists them";
}

std::string one_word_too_many(const CommandText& command, const std::string& word)
{
    const std::string text = "'" + word + "' is one word too many";
    const bool writes = has(names_of(command.options), "-o");
    if (writes && is_picture(word)) return text + "; a file to write has -o before it: -o " + word;
    return text + ": " + command.name + " --help shows what it takes";
}

/// "--size: 1 required WxH missing", "--size: At Most 1 required but received 2" or "frames: At least 2 required but
/// received 1", in other words.
std::string missing_value(const CommandText& command, const std::string& message)
{
    const std::string name = message.substr(0, message.find(':'));
    constexpr std::string_view kLeast = "At least ";
    if (const auto least = message.find(kLeast); least != message.npos) {
        const std::size_t count = least + kLeast.size();
        return name + " needs at least " + message.substr(count, message.find(' ', count) - count) + " of them";
    }
    if (message.find("received") != message.npos) return name + " is given more than once";
    for (const OptionText& option : command.options)
        if (has(option.names, name)) return name + " needs a value: " + option.value;
    return message;
}

/// "scene is required", with what it is.
std::string missing_option(const CommandText& command, const std::string& message)
{
    const std::string name = message.substr(0, message.find(' '));
    for (const auto* options : {&command.words, &command.options})
        for (const OptionText& option : *options)
            if (has(option.names, name)) return name + " is missing: " + option.help;
    return message;
}

}  // namespace

std::string advice(const CLI::App& app, const std::vector<std::string>& words, const CLI::ParseError& error)
{
    const CommandText program = describe(app, app.get_name());
    const auto chosen = app.get_subcommands();
    if (chosen.empty()) {
        if (words.empty()) return "a command is missing; rcsplat --help lists them";
        return unknown_command(program, words.front());
    }
    const CommandText command = describe(*chosen.front(), app.get_name() + " " + chosen.front()->get_name());
    if (error.get_name() == "RequiredError") return missing_option(command, error.what());
    if (error.get_name() == "ArgumentMismatch") return missing_value(command, error.what());
    const std::vector<std::string> extras = app.remaining(true);
    // In the order in which they were written: an unknown option comes before what was meant as its value.
    for (const std::string& word : words)
        if (has(extras, word))
            return word.starts_with('-') && word != "-" ? unknown_option(command, program, word)
                                                        : one_word_too_many(command, word);
    return error.what();
}

void refuse_short_assignments(const std::vector<std::string>& words)
{
    for (const std::string& word : words)
        if (word.size() > 2 && word[0] == '-' && std::isalpha(static_cast<unsigned char>(word[1])) != 0 &&
            word[2] == '=')
            throw Error(ErrorCode::bad_argument, "'" + word + "' has a '=' that would belong to the value; write " +
                                                     word.substr(0, 2) + " " + word.substr(3));
}

}  // namespace rcs::service
