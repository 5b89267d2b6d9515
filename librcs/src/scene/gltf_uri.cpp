#include "scene/gltf_uri.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <string_view>
#include <system_error>

namespace rcs {
namespace {

int hex_digit(char c)
{
    if (c >= '0' && c <= '9') return c - '0';
    if (c >= 'a' && c <= 'f') return c - 'a' + 10;
    if (c >= 'A' && c <= 'F') return c - 'A' + 10;
    return -1;
}

/// RFC 3986, section 2.1.
std::string percent_decoded(std::string_view uri)
{
    std::string text;
    for (std::size_t i = 0; i < uri.size(); ++i) {
        const int high = uri[i] == '%' && i + 2 < uri.size() ? hex_digit(uri[i + 1]) : -1;
        const int low = high >= 0 ? hex_digit(uri[i + 2]) : -1;
        if (low >= 0) {
            text += static_cast<char>(high * 16 + low);
            i += 2;
        } else {
            text += uri[i];
        }
    }
    return text;
}

/// 0 to 63; -1 for what is no digit.
std::array<std::int8_t, 256> base64_digits()
{
    constexpr std::string_view kAlphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::array<std::int8_t, 256> digits{};
    digits.fill(-1);
    for (std::size_t i = 0; i < kAlphabet.size(); ++i) {
        digits[static_cast<unsigned char>(kAlphabet[i])] = static_cast<std::int8_t>(i);
    }
    return digits;
}

/// RFC 4648, section 4; padding may be left out.
std::vector<unsigned char> base64_decoded(const GltfFile& file, std::string_view text, const std::string& what)
{
    static const std::array<std::int8_t, 256> digits = base64_digits();
    while (text.ends_with('=')) text.remove_suffix(1);
    std::vector<unsigned char> bytes;
    bytes.reserve(text.size() / 4 * 3 + 2);
    std::uint32_t bits = 0;
    int count = 0;
    for (const char c : text) {
        const int digit = digits[static_cast<unsigned char>(c)];
        if (digit < 0) bad_file(file, what + " has data that are no base64");
        bits = bits << 6 | static_cast<std::uint32_t>(digit);
        if ((count += 6) < 8) continue;
        count -= 8;
        bytes.push_back(static_cast<unsigned char>(bits >> count & 0xff));
    }
    return bytes;
}

bool is_inside(const std::filesystem::path& folder, const std::filesystem::path& path)
{
    std::error_code problem;
    const auto root = std::filesystem::canonical(folder.empty() ? "." : folder, problem);
    if (problem) return false;
    const auto target = std::filesystem::weakly_canonical(path, problem);
    if (problem) return false;
    return std::mismatch(root.begin(), root.end(), target.begin(), target.end()).first == root.end();
}

constexpr std::string_view kData = "data:";

}  // namespace

std::filesystem::path external_path(const GltfFile& file, const std::string& uri, const std::string& what)
{
    const std::string decoded = percent_decoded(uri);
    const std::filesystem::path relative(decoded);
    // A colon before the first slash is a scheme (http:) or a drive; a backslash is a path on another system.
    const bool scheme = decoded.substr(0, decoded.find('/')).find(':') != std::string::npos;
    const bool upwards = file.root.empty() && std::find(relative.begin(), relative.end(), "..") != relative.end();
    if (decoded.empty() || scheme || upwards || relative.is_absolute() ||
        decoded.find_first_of(std::string("\\\0", 2)) != std::string::npos ||
        !is_inside(file.root.empty() ? file.folder : file.root, file.folder / relative)) {
        constexpr std::size_t kShown = 80;  // the URI may be a whole embedded file
        bad_file(file, what + " refers to '" + on_one_line(uri.substr(0, kShown)) +
                           "', expected a relative path inside " +
                           (file.root.empty() ? "the scene's folder; an asset root (--asset-root) lets it reach further"
                                              : "the asset root '" + file.root.string() + "'"));
    }
    return file.folder / relative;
}

std::vector<unsigned char> uri_bytes(const GltfFile& file, const std::string& uri, const std::string& what)
{
    if (!uri.starts_with(kData)) return read_file(external_path(file, uri, what), file.path + ": " + what);
    const std::string_view text(uri);
    const std::size_t comma = text.find(',');
    if (comma == text.npos) bad_file(file, what + " has a data URI without data");
    const std::string_view contents = text.substr(comma + 1);
    if (text.substr(0, comma).ends_with(";base64")) return base64_decoded(file, contents, what);
    const std::string decoded = percent_decoded(contents);
    return {decoded.begin(), decoded.end()};
}

}  // namespace rcs
