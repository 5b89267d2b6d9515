#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "rcs/v1/service.pb.h"
#include "wire/errors.h"
#include "wire/framing.h"
#include "wire/stream.h"

namespace rcs::service {

struct ClientOptions {
    std::string token;  ///< for TCP
    std::string ca;     ///< authority of the server's certificate [PEM file]; TLS is spoken beyond loopback, or with it
    std::string certificate, key;  ///< to show instead of a token [PEM files]
    double connect_seconds = 10.0;
    double reply_seconds = 120.0;        ///< that a request may take
    std::function<bool()> keep_waiting;  ///< asked a few times a second while waiting; false ends it
    /// How long to look for a server that has gone away while something was asked of it [s]; 0: not at all.
    double patience_seconds = 0.0;
    std::function<void(const std::string&)> news;  ///< told when the server has gone, and when it is back
};

/// The server went away, or was stopped. What was asked may have been done.
class ConnectionLost : public ServiceError {
public:
    explicit ConnectionLost(const std::string& why) : ServiceError(v1::ERROR_CODE_UNAVAILABLE, why) {}
};

/// A connection to a render server. Not for several threads at a time. What fails throws ServiceError (the server said
/// so, or the connection broke: ConnectionLost) or rcs::Error cancelled (keep_waiting said so). With patience, what can
/// be asked twice is asked again once the server is back: all but jobs without an idempotency key, which submit() gives
/// them.
class Client {
public:
    /// @param address  path of a Unix socket, or HOST:PORT
    explicit Client(const std::string& address, const ClientOptions& options = {});

    const v1::HelloReply& server() const { return hello_; }

    /// One request, one answer; an error is thrown.
    v1::Response call(v1::Request request);

    /// Uploads what of these files the server does not have.
    struct LocalFile {
        std::string path;
        v1::Blob blob;
    };
    void upload(const std::vector<LocalFile>& files, const std::function<void(float fraction)>& progress = {});

    v1::SubmitReply submit(const v1::Job& job);
    /// Calls `news` until the job has ended. @return its last state
    v1::JobStatus watch(std::uint64_t job, const std::function<void(const v1::JobStatus&)>& news = {});
    v1::CancelReply cancel(std::uint64_t job);
    /// Some frames of a job, from the `first` on. @return fewer than asked for only at the job's end
    v1::JobReply details(std::uint64_t job, std::uint32_t first = 0, std::uint32_t frames = 0);
    /// Writes a picture; it appears under `path` only once it is complete and what the server has.
    void fetch(std::uint64_t job, int frame, const std::string& name, const std::string& path);

private:
    void begin();
    void connect_to(const std::string& address, const ClientOptions& options);
    v1::Response call_once(v1::Request& request);
    void come_back(const std::string& why);
    void pause(std::int64_t ms);
    void send(const v1::Request& request);
    v1::Response receive();
    void wait(short events, std::int64_t until);

    ClientOptions options_;
    std::optional<TlsContext> tls_;
    std::optional<Stream> stream_;
    FrameReader reader_;
    std::string address_;
    v1::HelloReply hello_;
    std::uint64_t next_id_ = 1;
};

/// A local file with its digest. @throws rcs::Error not_found, io
Client::LocalFile local_file(const std::string& path);

}  // namespace rcs::service
