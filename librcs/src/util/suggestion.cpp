#include "rcs/suggestion.h"

#include <algorithm>
#include <cstddef>

namespace rcs {
namespace {

std::string lower(std::string_view text)
{
    std::string result(text);
    for (char& c : result)
        if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    return result;
}

/// Letters to change, add, leave out or swap with the next one until `a` is `b` (optimal string alignment).
std::size_t edits(const std::string& a, const std::string& b)
{
    std::vector<std::size_t> before, last, row(b.size() + 1);
    for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
    for (std::size_t i = 1; i <= a.size(); ++i) {
        before = std::move(last);
        last = std::move(row);
        row.assign(b.size() + 1, i);
        for (std::size_t j = 1; j <= b.size(); ++j) {
            row[j] = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + (a[i - 1] != b[j - 1])});
            if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
                row[j] = std::min(row[j], before[j - 2] + 1);
        }
    }
    return row.back();
}

}  // namespace

std::string closest_name(std::string_view word, const std::vector<std::string>& names)
{
    constexpr std::size_t kLongest = 64;  // beyond, a word is no mistyped name
    constexpr std::size_t kLeastPart = 3;
    const std::string typed = lower(word);
    if (typed.empty() || typed.size() > kLongest) return {};
    std::string closest;
    std::size_t least = std::max<std::size_t>(1, typed.size() / 3) + 1;
    for (const std::string& name : names) {
        const std::string meant = lower(name);
        std::size_t distance = edits(typed, meant);
        if (typed.size() >= kLeastPart && meant.find(typed) != meant.npos)
            distance = std::min<std::size_t>(distance, 1);
        if (distance < least) closest = name, least = distance;
    }
    return closest;
}

std::string did_you_mean(std::string_view word, const std::vector<std::string>& names)
{
    const std::string name = closest_name(word, names);
    return name.empty() ? "" : "; did you mean '" + name + "'?";
}

}  // namespace rcs
