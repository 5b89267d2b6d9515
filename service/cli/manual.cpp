#include "cli/manual.h"

#include <algorithm>

#include "rcs/version.h"

namespace rcs::service {
namespace {

std::string dashed(std::string name)
{
    std::replace(name.begin(), name.end(), ' ', '-');
    return name;
}

/// Text as roff takes it: no line begins with a control character, hyphens stay what is typed.
std::string roff(const std::string& text)
{
    std::string escaped;
    for (const char c : text) {
        if (c == '\\')
            escaped += "\\e";
        else if (c == '-')
            escaped += "\\-";
        else if ((c == '.' || c == '\'') && (escaped.empty() || escaped.back() == '\n'))
            escaped += std::string("\\&") + c;
        else
            escaped += c;
    }
    return escaped;
}

std::string left_of(const OptionText& option, const char* name_begin, const char* name_end, const char* value_begin,
                    const char* value_end)
{
    std::string text;
    for (auto name = option.names.rbegin(); name != option.names.rend(); ++name)
        text.append(text.empty() ? "" : ", ").append(name_begin).append(*name).append(name_end);
    if (!option.value.empty()) text.append(" ").append(value_begin).append(option.value).append(value_end);
    return text;
}

std::string help_of(const OptionText& option)
{
    return option.help + (option.by_default.empty() ? "" : " (default " + option.by_default + ")");
}

std::string roff_options(const CommandText& command)
{
    std::string text;
    for (const std::string& group : option_groups()) {
        std::string entries;
        for (const OptionText& option : command.options) {
            if (option.group != group) continue;
            OptionText shown = option;
            for (std::string& name : shown.names) name = roff(name);
            shown.value = roff(shown.value);
            entries += ".TP\n" + left_of(shown, "\\fB", "\\fR", "\\fI", "\\fR") + "\n" + roff(help_of(option)) + ".\n";
        }
        if (!entries.empty()) text += ".SS " + roff(group) + "\n" + entries;
    }
    return text;
}

/// A cell of a table: a bar would end it.
std::string cell(const std::string& text)
{
    std::string escaped;
    for (const char c : text) {
        if (c == '|') escaped += '\\';
        if (c == '<') {
            escaped += "&lt;";
            continue;
        }
        escaped += c;
    }
    return escaped;
}

std::string command_section(const CommandText& command)
{
    std::string text = "## " + command.name + "\n\n" + command.about + ".\n\n```text\n" + command.name;
    for (const OptionText& word : command.words) text += word.required ? " " + word.value : " [" + word.value + "]";
    text += " [OPTIONS]\n```\n\n";
    for (const OptionText& word : command.words) text += "`" + word.value + "`: " + help_of(word) + ".\n\n";
    for (const std::string& group : option_groups()) {
        std::string rows;
        for (const OptionText& option : command.options) {
            if (option.group != group) continue;
            rows +=
                "| " + cell(left_of(option, "`", "`", "`", "`")) + " | " + cell(option.help) +
                (option.required ? " (required)" : "") + " | " +
                (option.by_default.empty() || option.by_default.front() == '/' ? ""
                                                                               : "`" + cell(option.by_default) + "`") +
                " |\n";
        }
        if (!rows.empty())
            text += "**" + group + "**\n\n| option | what it is | default |\n| --- | --- | --- |\n" + rows + "\n";
    }
    if (!command.notes.empty()) text += "```text\n" + command.notes + "\n```\n\n";
    return text;
}

}  // namespace

std::string manual_page(const CommandText& command)
{
    std::string text = ".TH " + dashed(command.name) + " 1 \"\" \"rcsplat " + kVersion + "\" \"rcsplat\"\n";
    text += ".SH NAME\n" + roff(dashed(command.name)) + " \\- " + roff(command.about) + "\n";
    text += ".SH SYNOPSIS\n.B " + command.name + "\n";
    if (!command.commands.empty()) text += ".I COMMAND\n";
    for (const OptionText& word : command.words) text += ".I " + word.value + "\n";
    text += "[options]\n.SH OPTIONS\n";
    for (const OptionText& word : command.words) text += ".TP\n.I " + word.value + "\n" + roff(help_of(word)) + ".\n";
    text += roff_options(command);
    if (!command.commands.empty()) text += ".SH COMMANDS\n";
    for (const CommandText& each : command.commands)
        text += ".TP\n.B " + last_word(each.name) + "\n" + roff(each.about) + ", see \\fB" + roff(dashed(each.name)) +
                "\\fR(1).\n";
    if (!command.notes.empty()) text += ".SH NOTES\n.nf\n" + roff(command.notes) + "\n.fi\n";
    return text;
}

std::string commands_page(const CommandText& program)
{
    std::string text =
        "# Commands\n\nEvery command with all its options, as `--help-all` has them. `rcsplat manual --markdown` "
        "writes this page;\na test compares.\n\n";
    for (const CommandText& command : program.commands) text += command_section(command);
    text.pop_back();
    return text;
}

}  // namespace rcs::service
