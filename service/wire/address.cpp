#include "wire/address.h"

#include <cstdlib>

#include <arpa/inet.h>
#include <unistd.h>

#include "rcs/error.h"

namespace rcs::service {

std::string default_socket()
{
    const char* runtime = std::getenv("XDG_RUNTIME_DIR");
    if (runtime != nullptr && *runtime != '\0') return std::string(runtime) + "/rcsplat/socket";
    return std::string("/tmp/rcsplat-") + std::to_string(::getuid()) + "/socket";
}

HostPort parse_host_port(const std::string& text)
{
    const std::size_t colon = text.rfind(':');
    if (colon == text.npos || colon == 0) throw Error(ErrorCode::bad_argument, text + " is no HOST:PORT");
    HostPort result{text.substr(0, colon), text.substr(colon + 1)};
    if (result.host.front() == '[' && result.host.back() == ']')
        result.host = result.host.substr(1, result.host.size() - 2);
    const bool digits = !result.port.empty() && result.port.size() <= 5 &&
                        result.port.find_first_not_of("0123456789") == result.port.npos;
    if (!digits || std::stoi(result.port) > 65535)
        throw Error(ErrorCode::bad_argument, text + " is no HOST:PORT with a port in [0, 65535]");
    return result;
}

bool is_loopback(const std::string& host)
{
    in_addr v4{};
    in6_addr v6{};
    constexpr unsigned kLoopbackNet = 127;
    if (::inet_pton(AF_INET, host.c_str(), &v4) == 1) return ntohl(v4.s_addr) >> 24 == kLoopbackNet;
    if (::inet_pton(AF_INET6, host.c_str(), &v6) == 1) return IN6_IS_ADDR_LOOPBACK(&v6);
    return host == "localhost";
}

}  // namespace rcs::service
