#include "cli/help.h"

#include <algorithm>
#include <sstream>

namespace rcs::service {
namespace {

constexpr std::size_t kWidth = 110;     ///< [columns]
constexpr std::size_t kColumn = 30;     ///< where help begins
constexpr std::size_t kOnAScreen = 16;  ///< so many options are all shown

std::string entry(const OptionText& option)
{
    std::string left = "  ";
    for (auto name = option.names.rbegin(); name != option.names.rend(); ++name)
        left.append(name == option.names.rbegin() ? "" : ", ").append(*name);
    if (option.names.front().starts_with('-') && !option.value.empty()) left += " " + option.value;
    if (!option.names.front().starts_with('-')) left = "  " + option.value;
    std::string right = option.help;
    if (!option.by_default.empty()) right += " (default " + option.by_default + ")";
    if (option.required) right += " (required)";
    const std::string gap =
        left.size() + 2 > kColumn ? "\n" + std::string(kColumn, ' ') : std::string(kColumn - left.size(), ' ');
    return left + gap + wrapped(right, kColumn, kWidth) + "\n";
}

std::string usage(const CommandText& command)
{
    std::string line = "Usage: " + command.name;
    if (!command.commands.empty()) line += " COMMAND";
    for (const OptionText& word : command.words) line += word.required ? " " + word.value : " [" + word.value + "]";
    return line + " [OPTIONS]\n";
}

}  // namespace

std::string wrapped(const std::string& text, std::size_t indent, std::size_t width)
{
    std::istringstream words(text);
    std::string lines, word;
    std::size_t column = indent;
    while (words >> word) {
        if (column > indent && column + 1 + word.size() > width) {
            lines += "\n" + std::string(indent, ' ');
            column = indent;
        }
        if (column > indent) lines += ' ', ++column;
        lines += word;
        column += word.size();
    }
    return lines;
}

std::string help_text(const CommandText& command, bool all)
{
    std::string text = command.about + "\n" + usage(command);
    if (!command.words.empty()) text += "\n";
    for (const OptionText& word : command.words) text += entry(word);
    const bool shows_all = all || command.options.size() <= kOnAScreen;
    std::size_t hidden = 0;
    for (const std::string& group : option_groups()) {
        std::string entries;
        for (const OptionText& option : command.options) {
            if (option.group != group) continue;
            if (shows_all || !is_for_experts(group))
                entries += entry(option);
            else
                ++hidden;
        }
        if (!entries.empty()) text += "\n" + group + ":\n" + entries;
    }
    if (!command.commands.empty()) text += "\nCommands:\n";
    for (const CommandText& each : command.commands) {
        const std::string name = each.name.substr(each.name.rfind(' ') + 1);
        text += entry({{name}, name, {}, each.about, "", "", false});
    }
    if (hidden > 0) text += "\n" + std::to_string(hidden) + " more options: " + command.name + " --help-all\n";
    if (!command.notes.empty()) text += "\n" + command.notes + "\n";
    return text;
}

std::string HelpFormatter::make_help(const CLI::App* app, std::string name, CLI::AppFormatMode mode) const
{
    return help_text(describe(*app, name), mode == CLI::AppFormatMode::All);
}

}  // namespace rcs::service
