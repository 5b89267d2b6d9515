#include "view/door.h"

#include <array>
#include <cstddef>

#include <sys/random.h>

#include "rcs/error.h"

namespace rcs::service {

std::string random_token()
{
    constexpr char kDigits[] = "0123456789abcdef";
    std::array<unsigned char, 16> bytes{};
    if (::getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size()))
        throw Error(ErrorCode::io, "the system gives no random numbers for an address");
    std::string token;
    for (const unsigned char byte : bytes) {
        token += kDigits[byte >> 4];
        token += kDigits[byte & 15];
    }
    return token;
}

std::string address_of(const Door& door)
{
    return "http://127.0.0.1:" + std::to_string(door.port) + "/" + door.token + "/";
}

bool same_secret(std::string_view a, std::string_view b)
{
    unsigned difference = a.size() == b.size() ? 0 : 1;
    for (std::size_t i = 0; i < b.size(); ++i)
        difference |= static_cast<unsigned char>(i < a.size() ? a[i] : 0) ^ static_cast<unsigned char>(b[i]);
    return difference == 0;
}

Answer answer_door(const Door& door, const Asked& asked)
{
    const std::string port = std::string(":").append(std::to_string(door.port));
    if (asked.host != "127.0.0.1" + port && asked.host != "localhost" + port)
        return {Room::page, "asked for by another name than this machine's"};
    if (!asked.origin.empty() && asked.origin != "http://" + std::string(asked.host))
        return {Room::page, "asked for by another page"};
    if (asked.method != "GET") return {Room::page, "this page is read only"};
    constexpr std::size_t kToken = 32;
    const std::string_view path = asked.target;
    if (path.size() < kToken + 2 || path[0] != '/' || path[kToken + 1] != '/' ||
        !same_secret(path.substr(1, kToken), door.token))
        return {Room::page, "the address is not the one that was printed"};
    const std::string_view name = path.substr(kToken + 2);
    if (name == "socket") {
        if (!asked.is_socket) return {Room::page, "the socket is no page"};
        if (asked.origin.empty()) return {Room::page, "asked for by no page"};
        return {Room::socket, ""};
    }
    if (asked.is_socket) return {Room::page, "the page is no socket"};
    if (name.empty()) return {Room::page, ""};
    if (name == "page.css") return {Room::style, ""};
    if (name == "page.js") return {Room::script, ""};
    return {Room::page, "there is nothing here"};
}

}  // namespace rcs::service
