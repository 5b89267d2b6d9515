#pragma once

#include <string>
#include <string_view>

namespace rcs::service {

/// Who may come in: whoever knows the token that is part of the address, from this machine's own name, and, where a
/// script asks, from the page that is served here.
struct Door {
    std::string token;  ///< 128 random bits, as 32 hexadecimal digits
    int port = 0;       ///< on loopback
};

/// @throws rcs::Error io: the system has no random numbers
std::string random_token();

/// "http://127.0.0.1:PORT/TOKEN/".
std::string address_of(const Door& door);

/// What a browser asks for.
struct Asked {
    std::string_view method, target, host, origin;  ///< "" of headers that are not there, or there more than once
    bool is_socket = false;                         ///< it is to become a WebSocket
};

/// What may be had, by name.
enum class Room { page, style, script, socket };
struct Answer {
    Room room = Room::page;
    std::string refusal;  ///< why nothing is to be had: one line; "": it is
};
Answer answer_door(const Door& door, const Asked& asked);

/// In a time that tells nothing of where they differ.
bool same_secret(std::string_view a, std::string_view b);

}  // namespace rcs::service
