#include "server/listeners.h"

#include <cerrno>
#include <cstring>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <openssl/rand.h>

#include "rcs/error.h"
#include "wire/address.h"
#include "wire/files.h"
#include "wire/sha256.h"

namespace rcs::service {
namespace {

/// The secret of TCP clients: 32 random bytes in hexadecimal, made if the file is not there. Others must not read it.
std::string read_token(const std::string& path, bool make)
{
    if (make && ::access(path.c_str(), F_OK) != 0) {
        std::string random(32, '\0');
        if (RAND_bytes(reinterpret_cast<unsigned char*>(random.data()), static_cast<int>(random.size())) != 1) {
            throw Error(ErrorCode::internal, "no random bytes for a token");
        }
        const Fd file(::open(path.c_str(), O_CREAT | O_EXCL | O_WRONLY | O_CLOEXEC, 0600));
        if (!file) fail_file("write", path);
        write_all(file.get(), hex(random) + "\n", path);
    }
    struct stat status{};
    if (::stat(path.c_str(), &status) != 0)
        throw Error(errno == ENOENT ? ErrorCode::not_found : ErrorCode::io,
                    "cannot read the token file " + path + ": " + std::strerror(errno));
    if ((status.st_mode & 0077) != 0) throw Error(ErrorCode::bad_file, "others can read the token file " + path);
    std::string token = read_part(path, 0, 4096);
    while (!token.empty() && (token.back() == '\n' || token.back() == '\r')) token.pop_back();
    constexpr std::size_t kShortest = 32;
    if (token.size() < kShortest)
        throw Error(ErrorCode::bad_file, "the token in " + path + " has fewer than 32 characters");
    return token;
}

}  // namespace

Secrets read_secrets(const ServerConfig& config)
{
    Secrets secrets;
    if (config.listen.empty()) return secrets;
    const bool has_own = config.token_file.empty();
    std::string file = config.token_file;
    if (has_own) file.assign(config.state).append("/token");
    secrets.token = read_token(file, has_own);
    if (!config.tls_certificate.empty())
        secrets.tls = TlsContext::server(config.tls_certificate, config.tls_key, config.client_ca);
    return secrets;
}

Listeners::Listeners(const ServerConfig& config, const ServerLog& log, bool tls) : unix_(config.socket, config.group)
{
    if (!config.listen.empty()) {
        const HostPort address = parse_host_port(config.listen);
        tcp_ = listen_tcp(address);
        log.info("listening", {{"address", address.host}, {"port", port_of(tcp_)}, {"tls", tls ? "yes" : "no"}});
    }
    log.info(
        "listening",
        {{"socket", config.socket}, {"state", config.state}, {"workers", config.workers}, {"threads", config.threads}});
}

Fd listen_for_browsers(const ServerConfig& config, const ServerLog& log)
{
    if (config.http.empty()) return Fd();
    const HostPort address = parse_host_port(config.http);
    Fd fd = listen_tcp(address);
    log.info("listening", {{"http", address.host}, {"port", port_of(fd)}});
    return fd;
}

}  // namespace rcs::service
