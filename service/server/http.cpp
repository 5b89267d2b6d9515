#include "server/http.h"

#include <algorithm>
#include <cctype>

#include <fcntl.h>
#include <poll.h>

#include "wire/address.h"

namespace rcs::service {
namespace {

constexpr std::size_t kLongestRequest = 8 << 10;  // [bytes]
constexpr std::int64_t kTime = 10'000;            // for request and answer [ms]

const char* reason(int status)
{
    switch (status) {
        case 200:
            return "OK";
        case 400:
            return "Bad Request";
        case 403:
            return "Forbidden";
        case 404:
            return "Not Found";
        case 405:
            return "Method Not Allowed";
        case 431:
            return "Request Header Fields Too Large";
        case 503:
            return "Service Unavailable";
        default:
            return "Internal Server Error";
    }
}

/// Up to its length.
std::string head_of(const HttpAnswer& answer)
{
    return "HTTP/1.1 " + std::to_string(answer.status) + " " + reason(answer.status) +
           "\r\nContent-Type: " + answer.type +
           "\r\nConnection: close\r\nCache-Control: no-store\r\nX-Content-Type-Options: nosniff\r\n"
           "Content-Security-Policy: default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; "
           "img-src 'self'; "
           "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'\r\n";
}

/// @return "" also where there are two
std::string header(const std::string& request, const std::string& name)
{
    std::string lower = request;
    std::transform(lower.begin(), lower.end(), lower.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    const std::size_t at = lower.find("\r\n" + name + ":");
    if (at == lower.npos || lower.find("\r\n" + name + ":", at + 1) != lower.npos) return {};
    const std::size_t begin = std::min(request.find_first_not_of(" \t", at + name.size() + 3), request.size());
    return request.substr(begin, request.find("\r\n", begin) - begin);
}

bool names_this_machine(std::string host)
{
    const std::size_t colon = host.rfind(':');
    if (colon != host.npos && host.find(']', colon) == host.npos) host.resize(colon);
    if (host.size() > 2 && host.front() == '[') host = host.substr(1, host.size() - 2);
    return is_loopback(host);
}

}  // namespace

std::optional<std::string> HttpConnection::receive()
{
    char bytes[4096];
    const long count = stream_.read(bytes, sizeof bytes);
    if (count == Stream::kEnd) closed_ = true;
    if (count <= 0 || answered_) return std::nullopt;
    in_.append(bytes, static_cast<std::size_t>(count));
    const std::size_t end = in_.find("\r\n\r\n");
    if (end == in_.npos) {
        if (in_.size() > kLongestRequest) answer({431, "text/plain", "the request is too long\n"});
        return std::nullopt;
    }
    const std::size_t method_end = in_.find(' '), path_end = in_.find(' ', method_end + 1), line_end = in_.find("\r\n");
    if (path_end == in_.npos || path_end > line_end || in_.compare(path_end + 1, 7, "HTTP/1.") != 0) {
        answer({400, "text/plain", "no request\n"});
        return std::nullopt;
    }
    const std::string method = in_.substr(0, method_end), path = in_.substr(method_end + 1, path_end - method_end - 1);
    head_only_ = method == "HEAD";
    if (method != "GET" && method != "HEAD") {
        answer({405, "text/plain", "this page is read only\n"});
    } else if (!names_this_machine(header(in_, "host"))) {
        answer({403, "text/plain", "asked for by another name than this machine's\n"});
    } else {
        return path.substr(0, path.find('?'));
    }
    return std::nullopt;
}

void HttpConnection::answer(const HttpAnswer& answer)
{
    out_ = head_of(answer) + "Content-Length: " + std::to_string(answer.body.size()) + "\r\n\r\n";
    if (!head_only_) out_ += answer.body;
    answered_ = true;
}

void HttpConnection::answer(const HttpAnswer& answer, FileSender& sender)
{
    if (answer.file.empty() || head_only_) return this->answer(answer);
    Fd browser(::fcntl(stream_.fd(), F_DUPFD_CLOEXEC, 0));
    if (!browser || !sender.send(std::move(browser), answer.file, head_of(answer)))
        return this->answer({503, "text/plain", "too many pictures are asked for\n"});
    answered_ = closed_ = true;  // here; the other end is the sender's
}

void HttpConnection::flush()
{
    while (!closed_ && sent_ < out_.size()) {
        const long count = stream_.write(std::string_view(out_).substr(sent_));
        if (count == Stream::kLater) return;
        if (count == Stream::kEnd)
            closed_ = true;
        else
            sent_ += static_cast<std::size_t>(count);
    }
}

short HttpConnection::events() const { return answered_ && sent_ < out_.size() ? POLLOUT : POLLIN; }

bool HttpConnection::done(std::int64_t now) const
{
    return closed_ || (answered_ && sent_ == out_.size()) || now > begin_ms_ + kTime;
}

}  // namespace rcs::service
