#include "report/encoding.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>

#include "rcs/image_io.h"

namespace rcs::service {
namespace {

/// Two significant digits, without an exponent.
std::string two_digits(double value)
{
    const int decimals = value > 0.0 ? std::max(0, 1 - static_cast<int>(std::floor(std::log10(value) + 1e-9))) : 0;
    char text[64];
    std::snprintf(text, sizeof text, "%.*f", std::min(decimals, 6), value);
    std::string short_text = text;
    if (short_text.find('.') != std::string::npos) {
        while (short_text.back() == '0') short_text.pop_back();
        if (short_text.back() == '.') short_text.pop_back();
    }
    return short_text;
}

}  // namespace

std::string base64(std::string_view bytes)
{
    constexpr char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    text.reserve((bytes.size() + 2) / 3 * 4);
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        const std::size_t left = std::min<std::size_t>(3, bytes.size() - i);
        std::uint32_t word = 0;
        for (std::size_t k = 0; k < 3; ++k)
            word = word << 8 | (k < left ? static_cast<unsigned char>(bytes[i + k]) : 0u);
        for (std::size_t k = 0; k < 4; ++k) text += k <= left ? digits[word >> (18 - 6 * k) & 63u] : '=';
    }
    return text;
}

std::string html_escape(std::string_view text)
{
    std::string escaped;
    for (const char c : text) {
        switch (c) {
            case '&':
                escaped += "&amp;";
                break;
            case '<':
                escaped += "&lt;";
                break;
            case '>':
                escaped += "&gt;";
                break;
            case '"':
                escaped += "&quot;";
                break;
            default:
                escaped += c;
        }
    }
    return escaped;
}

std::string csv_field(std::string_view text)
{
    if (text.find_first_of(",\"\r\n") == text.npos) return std::string(text);
    std::string quoted = "\"";
    for (const char c : text) quoted.append(c == '"' ? 2 : 1, c);
    return quoted + '"';
}

std::string fill_page(const std::string& page, const std::map<std::string, std::string>& texts)
{
    std::string filled;
    std::size_t done = 0;
    for (std::size_t begin = page.find("{{"); begin != page.npos; begin = page.find("{{", done)) {
        const std::size_t end = page.find("}}", begin);
        filled.append(page, done, begin - done).append(texts.at(page.substr(begin + 2, end - begin - 2)));
        done = end + 2;
    }
    return filled.append(page, done);
}

std::string script_text(std::string json)
{
    for (std::size_t at = json.find('<'); at != json.npos; at = json.find('<', at)) json.replace(at, 1, "\\u003c");
    return json;
}

std::string jpeg_bytes(const Image& display)
{
    ImageFileOptions options;
    options.jpeg_quality = 88;
    return display_image_bytes("picture.jpg", display, options);
}

std::string percent_text(double fraction) { return two_digits(100.0 * fraction) + " %"; }

std::string duration_text(double seconds)
{
    if (seconds < 0.995) return two_digits(1000.0 * seconds) + " ms";
    if (seconds < 99.5) return two_digits(seconds) + " s";
    if (seconds < 99.5 * 60.0) return two_digits(seconds / 60.0) + " min";
    if (seconds < 72.0 * 3600.0) return two_digits(seconds / 3600.0) + " h";
    return two_digits(seconds / 86400.0) + " days";
}

}  // namespace rcs::service
