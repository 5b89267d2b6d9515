#include "wire/stream.h"

#include <cerrno>
#include <cstring>

#include <arpa/inet.h>
#include <fcntl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <openssl/err.h>
#include <openssl/ssl.h>
#include <openssl/x509v3.h>

#include "rcs/error.h"

namespace rcs::service {
namespace {

std::string tls_error()
{
    const unsigned long code = ERR_peek_last_error();
    const char* reason = code != 0 ? ERR_reason_error_string(code) : nullptr;
    ERR_clear_error();
    return reason != nullptr ? reason : "the connection broke";
}

[[noreturn]] void refuse(const std::string& what, const std::string& file)
{
    throw Error(ErrorCode::bad_file, what + " " + file + ": " + tls_error());
}

}  // namespace

void Stream::FreeTls::operator()(ssl_st* tls) const { SSL_free(tls); }

Stream::Stream(Fd fd) : fd_(std::move(fd)) { ::fcntl(fd_.get(), F_SETFL, O_NONBLOCK); }

Stream::Stream(Fd fd, ssl_ctx_st* context, bool server, const std::string& host) : Stream(std::move(fd))
{
    tls_.reset(SSL_new(context));
    if (!tls_ || SSL_set_fd(tls_.get(), fd_.get()) != 1) throw Error(ErrorCode::internal, "TLS: " + tls_error());
    if (server) {
        SSL_set_accept_state(tls_.get());
        return;
    }
    in6_addr address{};
    const bool numeric =
        ::inet_pton(AF_INET, host.c_str(), &address) == 1 || ::inet_pton(AF_INET6, host.c_str(), &address) == 1;
    X509_VERIFY_PARAM* verify = SSL_get0_param(tls_.get());
    if (numeric ? X509_VERIFY_PARAM_set1_ip_asc(verify, host.c_str()) != 1
                : SSL_set1_host(tls_.get(), host.c_str()) != 1) {
        throw Error(ErrorCode::bad_argument, "TLS: no name of a host: " + host);
    }
    if (!numeric) SSL_set_tlsext_host_name(tls_.get(), host.c_str());
    SSL_set_connect_state(tls_.get());
}

Stream::Stream(Stream&&) noexcept = default;
Stream& Stream::operator=(Stream&&) noexcept = default;
Stream::~Stream() = default;

long Stream::result_of(int code)
{
    switch (SSL_get_error(tls_.get(), code)) {
        case SSL_ERROR_WANT_READ:
            return kLater;
        case SSL_ERROR_WANT_WRITE:
            wants_write_ = true;
            return kLater;
        case SSL_ERROR_ZERO_RETURN:
            return kEnd;
        default:
            // The first failure says why; what is tried after it only finds the connection broken.
            if (failure_.empty()) failure_ = "TLS: " + tls_error();
            return kEnd;
    }
}

long Stream::read(char* data, std::size_t size)
{
    wants_write_ = false;
    if (tls_) {
        ERR_clear_error();
        const int count = SSL_read(tls_.get(), data, static_cast<int>(size));
        return count > 0 ? count : result_of(count);
    }
    const ssize_t count = ::recv(fd_.get(), data, size, 0);
    if (count > 0) return count;
    if (count < 0 && (errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR)) return kLater;
    if (count < 0) failure_ = std::strerror(errno);
    return kEnd;
}

long Stream::write(std::string_view bytes)
{
    wants_write_ = false;
    if (tls_) {
        ERR_clear_error();
        const int count = SSL_write(tls_.get(), bytes.data(), static_cast<int>(bytes.size()));
        return count > 0 ? count : result_of(count);
    }
    const ssize_t count = ::send(fd_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (count >= 0) return count;
    if (errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR) return kLater;
    failure_ = std::strerror(errno);
    return kEnd;
}

bool Stream::has_pending() const { return tls_ && SSL_pending(tls_.get()) > 0; }

std::string Stream::peer_name() const
{
    if (!tls_ || !SSL_is_init_finished(tls_.get()) || SSL_get_verify_result(tls_.get()) != X509_V_OK) return {};
    X509* certificate = SSL_get0_peer_certificate(tls_.get());
    if (certificate == nullptr) return {};
    char name[256] = {};
    X509_NAME_get_text_by_NID(X509_get_subject_name(certificate), NID_commonName, name, sizeof name);
    return *name != '\0' ? name : "unnamed";
}

void TlsContext::Free::operator()(ssl_ctx_st* context) const { SSL_CTX_free(context); }

TlsContext::TlsContext(bool server) : context_(SSL_CTX_new(server ? TLS_server_method() : TLS_client_method()))
{
    if (!context_ || SSL_CTX_set_min_proto_version(context_.get(), TLS1_2_VERSION) != 1) {
        throw Error(ErrorCode::internal, "TLS: " + tls_error());
    }
    SSL_CTX_set_mode(context_.get(), SSL_MODE_ENABLE_PARTIAL_WRITE | SSL_MODE_ACCEPT_MOVING_WRITE_BUFFER);
}

void TlsContext::use(const std::string& certificate, const std::string& key)
{
    if (SSL_CTX_use_certificate_chain_file(context_.get(), certificate.c_str()) != 1)
        refuse("cannot use the certificate", certificate);
    if (SSL_CTX_use_PrivateKey_file(context_.get(), key.c_str(), SSL_FILETYPE_PEM) != 1)
        refuse("cannot use the key", key);
    if (SSL_CTX_check_private_key(context_.get()) != 1) refuse("does not belong to the certificate: the key", key);
}

TlsContext TlsContext::server(const std::string& certificate, const std::string& key, const std::string& client_ca)
{
    TlsContext context(true);
    context.use(certificate, key);
    if (!client_ca.empty()) {
        if (SSL_CTX_load_verify_locations(context.get(), client_ca.c_str(), nullptr) != 1)
            refuse("cannot use the client CA", client_ca);
        SSL_CTX_set_client_CA_list(context.get(), SSL_load_client_CA_file(client_ca.c_str()));
        SSL_CTX_set_verify(context.get(), SSL_VERIFY_PEER,
                           nullptr);  // one that is shown has to be good; a token may stand for it
    }
    return context;
}

TlsContext TlsContext::client(const std::string& ca, const std::string& certificate, const std::string& key)
{
    TlsContext context(false);
    if (!certificate.empty()) context.use(certificate, key);
    if (ca.empty() ? SSL_CTX_set_default_verify_paths(context.get()) != 1
                   : SSL_CTX_load_verify_locations(context.get(), ca.c_str(), nullptr) != 1) {
        refuse("cannot use the CA", ca);
    }
    SSL_CTX_set_verify(context.get(), SSL_VERIFY_PEER, nullptr);
    return context;
}

}  // namespace rcs::service
