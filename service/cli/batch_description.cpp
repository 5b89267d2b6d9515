#include "cli/batch_description.h"

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <optional>
#include <regex>

#include <nlohmann/json.hpp>

#include "rcs/error.h"

namespace rcs::service {
namespace {

/// Takes the option's value out of the words; none: it is not among them.
std::optional<std::string> take_value(std::vector<std::string>& words, const std::string& name)
{
    for (auto word = words.begin(); word != words.end(); ++word) {
        const bool joined = word->starts_with(name + "=");
        if (!joined && (*word != name || word + 1 == words.end())) continue;
        std::string value = joined ? word->substr(name.size() + 1) : *(word + 1);
        words.erase(word, word + (joined ? 1 : 2));
        return value;
    }
    return std::nullopt;
}

struct Item {
    std::string name;
    std::vector<std::string> values;
};

/// Text up to a comment; @param depth  of lists that are open behind it
std::string without_comment(const std::string& line, int& depth)
{
    bool quoted = false;
    for (std::size_t i = 0; i < line.size(); ++i) {
        if (quoted && line[i] == '\\')
            ++i;
        else if (line[i] == '"')
            quoted = !quoted;
        else if (!quoted && line[i] == '#')
            return line.substr(0, i);
        else if (!quoted)
            depth += line[i] == '[' ? 1 : line[i] == ']' ? -1 : 0;
    }
    return line;
}

/// Values as the command line has them. TOML's strings, numbers, true, false and lists of those are JSON's.
std::vector<std::string> values_of(const std::string& text)
{
    using Json = nlohmann::json;
    const Json json = Json::parse(text, nullptr, false);
    std::vector<std::string> values;
    for (const Json& value : json.is_array() ? json : Json::array({json})) {
        if (value.is_structured() || value.is_discarded() || value.is_null()) return {};
        values.push_back(value.is_string() ? value.get<std::string>() : value.dump());
    }
    return values;
}

std::vector<Item> read_items(const std::string& file)
{
    static const std::regex entry(R"(^\s*([a-z][a-z0-9-]*)\s*=\s*(.*)$)"), empty(R"(^\s*$)");
    std::ifstream lines(file);
    if (!lines) throw Error(ErrorCode::not_found, "batch description '" + file + "' does not exist");
    std::error_code ignored;
    if (!std::filesystem::is_regular_file(file, ignored))
        throw Error(ErrorCode::io, "batch description '" + file + "' is no file");
    std::vector<Item> items;
    std::string line;
    for (int number = 1; std::getline(lines, line); ++number) {
        const std::string place = file + ", line " + std::to_string(number) + ": ";
        int depth = 0;
        std::string text = without_comment(line, depth);
        for (; depth > 0 && text.find('=') != text.npos && std::getline(lines, line); ++number)
            text.append(" ").append(without_comment(line, depth));
        if (std::regex_match(text, empty)) continue;
        std::smatch found;
        if (!std::regex_match(text, found, entry))
            throw Error(ErrorCode::bad_argument, place + "expected an option, as in: frames = \"1-240\"");
        items.push_back({found[1], values_of(found[2])});
        if (items.back().values.empty())
            throw Error(ErrorCode::bad_argument,
                        place + items.back().name + " is no \"text\", number, true, false or list of those");
    }
    return items;
}

bool is_given(const std::vector<std::string>& words, const std::string& name)
{
    return std::any_of(words.begin(), words.end(), [&](const std::string& word) {
        return word == name || word.starts_with(name + "=") || (name == "--output" && word == "-o");
    });
}

}  // namespace

std::vector<std::string> with_description(std::vector<std::string> words)
{
    if (words.empty() || words.front() != "batch") return words;
    const auto file = take_value(words, "--config");
    if (!file) return words;
    std::vector<std::string> told;
    for (const Item& item : read_items(*file)) {
        const std::string name = "--" + item.name;
        const std::string& first = item.values.front();
        if (is_given(words, name) || first == "false") continue;
        if (item.name == "scene")
            told.insert(told.begin(), first);
        else if (first == "true")
            told.push_back(name);
        else
            for (const std::string& value : item.values) told.push_back(name + "=" + value);
    }
    words.insert(words.begin() + 1, told.begin(), told.end());
    return words;
}

}  // namespace rcs::service
