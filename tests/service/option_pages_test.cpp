// Pages that show the table of options: docs/options.md and the Python client's types.

#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>
#include <type_traits>
#include <variant>

#include <gtest/gtest.h>

#include "rcs/option_table.h"
#include "support/temporary_folder.h"

namespace rcs {
namespace {

/// The page of docs/options.md.
std::string page()
{
    std::string text =
        "# Options of a render\n\n"
        "One table in the library ([option_table.cpp](../librcs/src/options/option_table.cpp)) says what a user can\n"
        "ask of a render. This page shows it: `RCS_UPDATE_DOCS=1 build/release/bin/option_pages_test` writes it, the\n"
        "test compares. `rcsplat render` takes the options of the first column; librcs (`RenderOptions`), messages\n"
        "([options.proto](../proto/rcs/v1/options.proto)) and the Python client have the names of the second. Quality\n"
        "is one of settings (error_tolerance, rays, noise_target and what else lies in `QualitySettings`),\n"
        "target_error, target_indirect_error and budget_seconds.\n\n"
        "A new option is a member of `RenderOptions`, a row of the table and a field of options.proto, and then the\n"
        "stage that obeys it.\n\n"
        "| command line | field | value | default | what it is |\n| --- | --- | --- | --- | --- |\n";
    for (const OptionInfo& option : option_table()) {
        std::string expected = expected_of(option);
        if (option.name.starts_with("--with")) expected = "names that `rcsplat plan` lists";
        expected.insert(0, option.prefix);
        if (!option.unit.empty()) expected.append(" [").append(option.unit).append("]");
        const std::string value = text_of(option, RenderOptions{});
        text.append("| `").append(option.name).append("` | `").append(option.key).append("` | ").append(expected);
        text.append(" | ").append(value.empty() ? "none" : value).append(" | ").append(option.help).append(" |\n");
    }
    return text;
}

template <typename Field>
struct Member;
template <typename Owner, typename Value>
struct Member<Value Owner::*> {
    using Type = Value;
};
template <typename Field>
using MemberOf = typename Member<Field>::Type;

/// Words in indented lines of at most 110 characters.
std::string wrapped(const std::string& words)
{
    constexpr std::size_t kLongest = 110;
    std::string text = "   ", word;
    std::size_t begin = 0;
    for (std::istringstream list(words); list >> word;) {
        if (text.size() - begin + word.size() >= kLongest) {
            begin = text.size() + 1;
            text += "\n   ";
        }
        text += " " + word;
    }
    return text + "\n";
}

/// The options as the Python client types them.
std::string python_module()
{
    std::string choices;
    std::string text =
        "\"\"\"Options of a render. RCS_UPDATE_DOCS=1 build/release/bin/option_pages_test writes this from the "
        "library's "
        "table.\"\"\"\n\n"
        "from __future__ import annotations\n\n"
        "from typing import Dict, Sequence, Tuple, TypedDict\n\n\n"
        "class RenderOptions(TypedDict, total=False):\n"
        "    \"\"\"Those of docs/options.md, by the same names.\"\"\"\n\n";
    for (const OptionInfo& option : option_table()) {
        const auto type = [](auto field) -> std::string {
            using Value = MemberOf<decltype(field)>;
            if constexpr (std::is_same_v<Value, EffectSet>) return "Sequence[str]";
            if constexpr (std::is_same_v<Value, std::optional<Crop>>) return "Tuple[int, int, int, int]";
            if constexpr (std::is_enum_v<Value>) return "str";
            if constexpr (std::is_integral_v<Value>) return "int";
            return "float";
        };
        std::string expected =
            option.name.starts_with("--with") ? "names that rcsplat plan lists" : expected_of(option);
        if (!option.unit.empty()) expected.append(" [").append(option.unit).append("]");
        text.append("    ").append(option.key).append(": ").append(std::visit(type, option.field)).append("\n");
        text.append(wrapped("\"\"\"" + std::string(option.help) + ": " + expected + ".\"\"\""));
        if (option.choices.empty()) continue;
        choices.append("    \"").append(option.key).append("\": (");
        for (const std::string_view choice : option.choices) choices.append("\"").append(choice).append("\", ");
        choices.replace(choices.size() - 2, 2, "),\n");
    }
    return text + "\n\nCHOICES: Dict[str, Tuple[str, ...]] = {\n" + choices + "}\n";
}

TEST(OptionPages, IsTheOneOfPython)
{
    const std::string path = RCS_TESTS_DIR "/../service/python/src/rcsplat/render_options.py";
    if (std::getenv("RCS_UPDATE_DOCS") != nullptr) std::ofstream(path) << python_module();
    EXPECT_EQ(test::bytes_of(path), python_module()) << "RCS_UPDATE_DOCS=1 writes it";
}

TEST(OptionPages, IsTheOneOfTheDocs)
{
    const std::string path = RCS_TESTS_DIR "/../docs/options.md";
    if (std::getenv("RCS_UPDATE_DOCS") != nullptr) std::ofstream(path) << page();
    EXPECT_EQ(test::bytes_of(path), page()) << "RCS_UPDATE_DOCS=1 writes it";
}

}  // namespace
}  // namespace rcs
