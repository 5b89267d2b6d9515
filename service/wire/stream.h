#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <string_view>

#include "wire/files.h"

struct ssl_st;
struct ssl_ctx_st;

namespace rcs::service {

/// A connected socket that never blocks, with or without TLS.
class Stream {
public:
    /// What read() and write() return where bytes may come later, and where none will.
    static constexpr long kLater = -1, kEnd = -2;

    explicit Stream(Fd fd);
    /// @param server  side of the handshake, which the first read() or write() begins   @param host  to be verified by
    /// a client
    Stream(Fd fd, ssl_ctx_st* tls, bool server, const std::string& host = {});
    Stream(Stream&&) noexcept;
    Stream& operator=(Stream&&) noexcept;
    ~Stream();

    /// @return bytes, kLater or kEnd; failures end a stream as well
    long read(char* data, std::size_t size);
    long write(std::string_view bytes);

    int fd() const { return fd_.get(); }
    /// What poll() is to wait for beside what the caller wants: TLS may have to write to read, and the reverse.
    bool wants_write() const { return wants_write_; }
    /// Whether bytes were received that poll() does not know of.
    bool has_pending() const;
    /// Name in the certificate that the peer showed and that was verified; "" if it showed none.
    std::string peer_name() const;
    /// Why the stream failed; "" if it ended in order.
    const std::string& failure() const { return failure_; }

private:
    struct FreeTls {
        void operator()(ssl_st* tls) const;
    };
    long result_of(int code);

    Fd fd_;
    std::unique_ptr<ssl_st, FreeTls> tls_;
    bool wants_write_ = false;
    std::string failure_;
};

/// Certificates and keys of one side of TLS.
class TlsContext {
public:
    /// Of a server. @param client_ca  whose certificates clients may show; "" takes none
    static TlsContext server(const std::string& certificate, const std::string& key, const std::string& client_ca);
    /// Of a client. @param ca  that signed the server's certificate; "" takes the system's   @param certificate, key to
    /// show, or ""
    static TlsContext client(const std::string& ca, const std::string& certificate, const std::string& key);

    ssl_ctx_st* get() const { return context_.get(); }

private:
    struct Free {
        void operator()(ssl_ctx_st* context) const;
    };
    explicit TlsContext(bool server);
    void use(const std::string& certificate, const std::string& key);
    std::unique_ptr<ssl_ctx_st, Free> context_;
};

}  // namespace rcs::service
