#include "server/listeners.h"

#include <algorithm>

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
    if (::stat(path.c_str(), &status) != 0) fail_file("read", path);
    if ((status.st_mode & 0077) != 0) throw Error(ErrorCode::bad_file, "others can read the token file " + path);
    std::string token = read_part(path, 0, 4096);
    while (!token.empty() && (token.back() == '\n' || token.back() == '\r')) token.pop_back();
    constexpr std::size_t kShortest = 32;
    if (token.size() < kShortest)
        throw Error(ErrorCode::bad_file, "the token in " + path + " has fewer than 32 characters");
    return token;
}

}  // namespace

Listeners::Listeners(const ServerConfig& config, const ServerLog& log) : unix_(config.socket, config.group)
{
    if (!config.listen.empty()) {
        read_secrets(config);
        tcp_ = listen_tcp(parse_host_port(config.listen));
        log.info(
            "listening",
            {{"address", parse_host_port(config.listen).host}, {"port", port_of(tcp_)}, {"tls", tls_ ? "yes" : "no"}});
    }
    if (!config.http.empty()) {
        http_ = listen_tcp(parse_host_port(config.http));
        log.info("listening", {{"http", parse_host_port(config.http).host}, {"port", port_of(http_)}});
    }
    log.info(
        "listening",
        {{"socket", config.socket}, {"state", config.state}, {"workers", config.workers}, {"threads", config.threads}});
}

void Listeners::read_secrets(const ServerConfig& config)
{
    if (config.listen.empty()) return;
    const bool has_own = config.token_file.empty();
    std::string file = config.token_file;
    if (has_own) file.assign(config.state).append("/token");
    const std::string token = read_token(file, has_own);
    token_ = token;
    tls_.reset();
    if (!config.tls_certificate.empty())
        tls_ = TlsContext::server(config.tls_certificate, config.tls_key, config.client_ca);
}

void Listeners::add_to(std::vector<pollfd>& polled, bool unix_clients, bool tcp_clients, bool browsers)
{
    const auto add = [&](int fd, bool wanted) {
        polled.push_back({fd, static_cast<short>(wanted ? POLLIN : 0), 0});
        return polled.size() - 1;
    };
    polled_unix_ = add(unix_.fd(), unix_clients);
    polled_tcp_ = tcp_ ? add(tcp_.get(), tcp_clients) : 0;
    polled_http_ = http_ ? add(http_.get(), browsers) : 0;
}

Listeners::Waiting Listeners::waiting(const std::vector<pollfd>& polled) const
{
    const auto is_ready = [&](std::size_t index) { return index != 0 && (polled[index].revents & POLLIN) != 0; };
    return {is_ready(polled_unix_), is_ready(polled_tcp_), is_ready(polled_http_)};
}

Stream Listeners::stream_of(Fd tcp_client) const
{
    return tls_ ? Stream(std::move(tcp_client), tls_->get(), true) : Stream(std::move(tcp_client));
}

}  // namespace rcs::service
