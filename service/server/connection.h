#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "rcs/v1/service.pb.h"
#include "server/service.h"
#include "wire/framing.h"
#include "wire/stream.h"

namespace rcs::service {

/// One client. Holds at most a message that is arriving and kMostWaiting of answers: whoever does not take those is not
/// listened to until he does, and is sent away when that takes too long.
class Connection {
public:
    /// @param owner  of a Unix peer; "" where a token or certificate has to say it
    Connection(Stream stream, const std::string& owner, bool sees_all, std::int64_t now);

    /// Reads what has arrived. Requests are appended to `requests`, at most a few at a time.
    /// @throws ServiceError protocol, version: the client is to be told and sent away
    void receive(std::vector<v1::Request>& requests, std::int64_t now);
    /// What was received, but not answered yet: receive() returns it once more.
    void keep(std::vector<v1::Request> requests) { kept_ = std::move(requests); }
    bool has_asked() const { return !kept_.empty(); }
    void send(const v1::Response& response);
    void flush(std::int64_t now);
    /// No more is read; it closes once all is sent.
    void finish(const v1::Error& error, std::int64_t now);
    bool is_finishing() const { return finishing_; }
    /// Whatever was still to be sent is dropped.
    void close() { closed_ = true; }

    /// Who it is. @param token  of the server @throws ServiceError unauthenticated
    void greet(const v1::HelloRequest& hello, const std::string& token);
    bool known() const { return hello_; }
    const Caller& caller() const { return caller_; }
    bool is_local() const { return local_; }  ///< came by the Unix socket
    std::int64_t since_ms() const { return since_ms_; }

    void watch(std::uint64_t job, std::uint64_t request);
    /// Something about this job has changed. @param now  as one of its frames has ended: watchers are told at once
    void touch(std::uint64_t job, bool now);
    /// Jobs to be told about now, with the requests that watch them.
    std::vector<std::pair<std::uint64_t, std::uint64_t>> due(std::int64_t now);
    void unwatch(std::uint64_t request);
    std::optional<std::int64_t> next_due() const;

    int fd() const { return stream_.fd(); }
    short events() const;  ///< for poll()
    bool has_pending() const { return !finishing_ && may_read() && (has_asked() || stream_.has_pending() || backlog_); }
    bool closed() const { return closed_ || (finishing_ && out_.empty()); }
    /// When it is sent away unless something happens. [ms]
    std::int64_t deadline(double message_seconds) const;

private:
    static constexpr std::size_t kMostWaiting = 4 << 20;  ///< of unsent answers [bytes]

    struct Watch {
        std::uint64_t job = 0;
        bool changed = true;
        std::int64_t told_ms = 0;
    };
    bool may_read() const { return out_.size() - sent_ < kMostWaiting; }

    Stream stream_;
    const std::shared_ptr<const void> presence_ = std::make_shared<char>();  ///< what callers are known to last by
    Caller caller_;
    FrameReader reader_;
    std::vector<v1::Request> kept_;
    std::string out_;
    std::size_t sent_ = 0;  ///< of out_
    bool greeted_ = false, hello_ = false, finishing_ = false, closed_ = false;
    bool backlog_ = false;  ///< whole messages were left in reader_
    const bool local_;
    const std::int64_t since_ms_;
    std::int64_t heard_ms_;  ///< when the message that is arriving began, or the last one ended
    std::int64_t unsent_since_ms_ = 0;
    std::map<std::uint64_t, Watch> watches_;  ///< by request
};

}  // namespace rcs::service
