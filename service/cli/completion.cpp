#include "cli/completion.h"

#include <algorithm>

#include "rcs/scene.h"

namespace rcs::service {
namespace {

std::string joined(const std::vector<std::string>& words, const char* between = " ")
{
    std::string text;
    for (const std::string& word : words) text.append(text.empty() ? "" : between).append(word);
    return text;
}

/// "--output|-o", as a pattern of a shell's case.
std::string pattern(const OptionText& option) { return joined(option.names, "|"); }

bool is_folder(const std::string& value) { return value == "DIR" || value == "FOLDER"; }
bool is_file(const std::string& value)
{
    return value.find("FILE") != value.npos || value == "PATH" || value == "FRAME" || value == "A" || value == "B";
}

/// Text between single quotes, where every shell leaves it as it is.
std::string in_quotes(std::string text)
{
    std::replace(text.begin(), text.end(), '\'', '`');
    return text;
}

std::string first_sentence(const std::string& text) { return text.substr(0, text.find_first_of(";:")); }

// bash

std::string bash_values(const OptionText& option)
{
    if (!option.choices.empty()) return "COMPREPLY=($(compgen -W '" + joined(option.choices) + "' -- \"$word\"))";
    if (is_folder(option.value)) return "COMPREPLY=($(compgen -d -- \"$word\"))";
    if (is_file(option.value)) return "COMPREPLY=($(compgen -f -- \"$word\"))";
    return "COMPREPLY=()";
}

std::string bash_command(const CommandText& command)
{
    std::vector<std::string> names;
    std::string values;
    for (const OptionText& option : command.options) {
        names.insert(names.end(), option.names.begin(), option.names.end());
        if (!option.value.empty())
            values += "            " + pattern(option) + ") " + bash_values(option) + "; return ;;\n";
    }
    const bool scene = !command.words.empty() && command.words.front().value == "SCENE";
    const bool files = !command.words.empty() && is_file(command.words.front().value);
    std::string text = "        " + last_word(command.name) + ")\n            case $before in\n" + values +
                       "            esac\n            options='" + joined(names) + "'\n";
    if (scene) text += "            words=\"$scenes\" files=1\n";
    if (files) text += "            files=1\n";
    if (!command.words.empty() && !command.words.front().choices.empty())
        text += "            words='" + joined(command.words.front().choices) + "'\n";
    return text + "            ;;\n";
}

std::string bash_script(const CommandText& program)
{
    std::vector<std::string> names;
    std::string commands;
    for (const CommandText& command : program.commands) {
        names.push_back(last_word(command.name));
        commands += bash_command(command);
    }
    for (const OptionText& option : program.options) names.push_back(option.names.front());
    return "# Completes rcsplat's command line in bash.\n"
           "_rcsplat() {\n"
           "    local line=${COMP_LINE:0:COMP_POINT} word before options= words= files= scenes='" +
           joined(demo_scene_names()) +
           "'\n"
           "    local -a said\n"
           "    read -ra said <<<\"$line\"  # COMP_WORDS would be cut at each colon\n"
           "    [[ $line == *[[:space:]] ]] && said+=('')\n"
           "    local last=$((${#said[@]} - 1))\n"
           "    word=${said[last]} before=\n"
           "    if ((last > 0)); then before=${said[last - 1]}; fi\n"
           "    if ((last <= 1)); then COMPREPLY=($(compgen -W '" +
           joined(names) +
           "' -- \"$word\")); return; fi\n"
           "    case ${said[1]} in\n" +
           commands +
           "    esac\n"
           "    if [[ $word == -* ]]; then COMPREPLY=($(compgen -W \"$options\" -- \"$word\")); return; fi\n"
           "    COMPREPLY=($(compgen -W \"$words\" -- \"$word\"))\n"
           "    if [[ -n $files ]]; then COMPREPLY+=($(compgen -f -- \"$word\")); fi\n"
           "    if [[ $word == *:* ]]; then COMPREPLY=(\"${COMPREPLY[@]#\"${word%:*}:\"}\"); fi\n"
           "}\n"
           "complete -o filenames -F _rcsplat rcsplat\n";
}

// zsh

std::string zsh_text(const std::string& text)
{
    std::string escaped;
    for (const char c : in_quotes(first_sentence(text))) {
        if (c == '[' || c == ']' || c == ':' || c == '\\') escaped += '\\';
        escaped += c;
    }
    return escaped;
}

std::string zsh_action(const OptionText& option)
{
    if (!option.choices.empty()) return "(" + joined(option.choices) + ")";
    if (option.value == "SCENE") return "_rcsplat_scene";
    if (is_folder(option.value)) return "_files -/";
    return is_file(option.value) ? "_files" : "";
}

std::string zsh_script(const CommandText& program)
{
    std::string commands, cases;
    for (const CommandText& command : program.commands) {
        commands += "        '" + last_word(command.name) + ":" + zsh_text(command.about) + "'\n";
        cases += "        " + last_word(command.name) + ") _arguments";
        for (const OptionText& option : command.options)
            for (const std::string& name : option.names)
                cases += " \\\n            '*" + name + "[" + zsh_text(option.help) + "]" +
                         (option.value.empty() ? "" : ": :" + zsh_action(option)) + "'";
        for (const OptionText& word : command.words) cases += " \\\n            '*: :" + zsh_action(word) + "'";
        cases += " ;;\n";
    }
    std::string scenes = joined(demo_scene_names());
    for (std::size_t at = scenes.find(':'); at != scenes.npos; at = scenes.find(':', at + 2)) scenes.insert(at, "\\");
    return "#compdef rcsplat\n"
           "# Completes rcsplat's command line in zsh.\n"
           "_rcsplat_scene() { _alternative 'built-in:built-in scene:(" +
           scenes +
           ")' 'files:scene file:_files' }\n"
           "_rcsplat() {\n"
           "    local -a commands=(\n" +
           commands +
           "    )\n"
           "    if ((CURRENT == 2)); then _describe command commands; return; fi\n"
           "    local command=${words[2]}\n"
           "    shift words; ((CURRENT--))\n"
           "    case $command in\n" +
           cases +
           "    esac\n"
           "}\n"
           "if [[ $funcstack[1] == _rcsplat ]]; then _rcsplat \"$@\"; else compdef _rcsplat rcsplat; fi\n";
}

// fish

std::string fish_option(const std::string& condition, const OptionText& option)
{
    std::string line = "complete -c rcsplat " + condition;
    for (const std::string& name : option.names)
        line += name.starts_with("--") ? " -l " + name.substr(2) : " -s " + name.substr(1);
    if (!option.value.empty()) line += is_file(option.value) || is_folder(option.value) ? " -r -F" : " -x";
    if (!option.choices.empty()) line += " -a '" + joined(option.choices) + "'";
    return line + " -d '" + in_quotes(first_sentence(option.help)) + "'\n";
}

std::string fish_script(const CommandText& program)
{
    const std::string none = "-n __fish_use_subcommand";
    std::string text = "# Completes rcsplat's command line in fish.\ncomplete -c rcsplat -f\n";
    for (const OptionText& option : program.options) text += fish_option(none, option);
    for (const CommandText& command : program.commands) {
        const std::string name = last_word(command.name);
        const std::string within = "-n '__fish_seen_subcommand_from " + name + "'";
        text += "complete -c rcsplat " + none + " -a " + name + " -d '" + in_quotes(command.about) + "'\n";
        for (const OptionText& option : command.options) text += fish_option(within, option);
        for (const OptionText& word : command.words) {
            if (word.value == "SCENE")
                text += "complete -c rcsplat " + within + " -a '" + joined(demo_scene_names()) + "'\n";
            if (word.value == "SCENE" || is_file(word.value)) text += "complete -c rcsplat " + within + " -F\n";
            if (!word.choices.empty()) text += "complete -c rcsplat " + within + " -a '" + joined(word.choices) + "'\n";
        }
    }
    return text;
}

}  // namespace

std::string completion_script(const CommandText& program, const std::string& shell)
{
    if (shell == "bash") return bash_script(program);
    return shell == "zsh" ? zsh_script(program) : fish_script(program);
}

}  // namespace rcs::service
