#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "server/file_sender.h"
#include "wire/stream.h"

namespace rcs::service {

struct HttpAnswer {
    int status = 200;
    std::string type = "text/plain; charset=utf-8";
    std::string body = {};
    std::string file = {};  ///< its bytes are sent instead, by a FileSender
};

/// A browser that asks for one thing and is answered: as much of HTTP/1.1 (RFC 9112) as a read-only page takes.
class HttpConnection {
public:
    HttpConnection(Fd fd, std::int64_t now) : stream_(std::move(fd)), begin_ms_(now) {}

    /// Reads on. @return the path that is asked for, once the request is complete and may be answered; what may not is
    /// answered
    ///         here. Only names of this machine are taken as Host, so that no page from elsewhere can read this one.
    std::optional<std::string> receive();
    void answer(const HttpAnswer& answer, FileSender& sender);
    void flush();

    int fd() const { return stream_.fd(); }
    std::int64_t since_ms() const { return begin_ms_; }
    short events() const;
    bool done(std::int64_t now) const;

private:
    void answer(const HttpAnswer& answer);

    Stream stream_;
    std::int64_t begin_ms_;
    std::string in_, out_;
    std::size_t sent_ = 0;
    bool answered_ = false, closed_ = false, head_only_ = false;
};

}  // namespace rcs::service
