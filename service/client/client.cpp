#include "client/client.h"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <utility>

#include <fcntl.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include "process/clock.h"
#include "rcs/error.h"
#include "rcs/version.h"
#include "wire/address.h"
#include "wire/errors.h"
#include "wire/files.h"
#include "wire/sha256.h"

namespace rcs::service {
namespace {

constexpr std::int64_t kAskPeriod = 200;  // between questions whether to go on [ms]

constexpr std::int64_t kFirstPause = 250, kLongestPause = 5000;  // between attempts to find a server again [ms]

[[noreturn]] void unavailable(const std::string& what) { throw ConnectionLost(what); }

/// Nobody may pose as a server: it is this user or root, or whose socket and folder they are where the address was
/// given. Said before a byte is sent. @throws ServiceError forbidden
void check_owner(const std::string& path, int fd)
{
    ucred peer{};
    socklen_t size = sizeof peer;
    if (::getsockopt(fd, SOL_SOCKET, SO_PEERCRED, &peer, &size) != 0) unavailable("cannot tell who answers on " + path);
    if (peer.uid == ::geteuid() || peer.uid == 0) return;
    std::string folder = std::filesystem::path(path).parent_path().string();
    if (folder.empty()) folder.assign(1, '.');
    struct stat of_folder{}, of_socket{};
    const bool owned = ::stat(folder.c_str(), &of_folder) == 0 && ::stat(path.c_str(), &of_socket) == 0 &&
                       of_folder.st_uid == peer.uid && of_socket.st_uid == peer.uid && (of_folder.st_mode & 0022) == 0;
    if (owned && path != default_socket()) return;
    throw ServiceError(v1::ERROR_CODE_FORBIDDEN, "who answers on " + path + " is user " + std::to_string(peer.uid) +
                                                     ", neither this user nor the owner of a folder of its own");
}

Fd connected_unix(const std::string& path)
{
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    if (path.size() >= sizeof address.sun_path)
        throw Error(ErrorCode::bad_argument, "the socket's path is too long: " + path);
    path.copy(address.sun_path, path.size());
    Fd fd(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
    if (!fd || ::connect(fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
        unavailable("no server answers on " + path + ": " + std::strerror(errno) + " (rcsplat serve starts one)");
    }
    check_owner(path, fd.get());
    return fd;
}

Fd connected_tcp(const HostPort& to, double seconds)
{
    addrinfo hints{};
    hints.ai_socktype = SOCK_STREAM;
    addrinfo* list = nullptr;
    const int code = ::getaddrinfo(to.host.c_str(), to.port.c_str(), &hints, &list);
    if (code != 0) unavailable("cannot find " + to.host + ": " + ::gai_strerror(code));
    const std::unique_ptr<addrinfo, void (*)(addrinfo*)> owner(list, ::freeaddrinfo);
    std::string why = "no address";
    for (const addrinfo* a = list; a != nullptr; a = a->ai_next) {
        Fd fd(::socket(a->ai_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
        if (!fd) continue;
        int error = ::connect(fd.get(), a->ai_addr, a->ai_addrlen) == 0 ? 0 : errno;
        if (error == EINPROGRESS) {
            pollfd one{fd.get(), POLLOUT, 0};
            socklen_t size = sizeof error;
            error = ETIMEDOUT;
            if (::poll(&one, 1, static_cast<int>(1e3 * seconds)) == 1)
                ::getsockopt(fd.get(), SOL_SOCKET, SO_ERROR, &error, &size);
        }
        const int on = 1;
        ::setsockopt(fd.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
        if (error == 0) return fd;
        why = std::strerror(error);
    }
    unavailable("no server answers on " + to.host + ":" + to.port + ": " + why);
}

}  // namespace

Client::LocalFile local_file(const std::string& path)
{
    const FileDigest digest = sha256_of_file(path);
    Client::LocalFile file{path, {}};
    file.blob.set_sha256(digest.digest);
    file.blob.set_size(digest.size);
    return file;
}

Client::Client(const std::string& address, const ClientOptions& options) : options_(options), address_(address)
{
    begin();
}

/// Connects, greets and says who it is.
void Client::begin()
{
    reader_ = {};
    connect_to(address_, options_);
    const std::string first = greeting();
    const std::int64_t until = steady_ms() + static_cast<std::int64_t>(1e3 * options_.connect_seconds);
    for (std::size_t sent = 0; sent < first.size();) {
        const long count = stream_->write(std::string_view(first).substr(sent));
        if (count == Stream::kEnd) break;  // what the server said before it closed is still to be read
        if (count == Stream::kLater)
            wait(stream_->wants_write() ? POLLOUT : POLLIN, until);
        else
            sent += static_cast<std::size_t>(count);
    }
    std::string theirs;
    for (char bytes[kGreetingSize]; theirs.size() < kGreetingSize;) {
        const long count = stream_->read(bytes, kGreetingSize - theirs.size());
        if (count == Stream::kEnd) unavailable("the connection to " + address_ + " broke: " + stream_->failure());
        if (count == Stream::kLater)
            wait(POLLIN, until);
        else
            theirs.append(bytes, static_cast<std::size_t>(count));
    }
    check_greeting(theirs);
    v1::Request hello;
    hello.mutable_hello()->set_client(std::string("rcsplat ") + kVersion);
    hello.mutable_hello()->set_token(options_.token);
    hello_ = call_once(hello).hello();
}

void Client::connect_to(const std::string& address, const ClientOptions& options)
{
    if (address.find('/') != address.npos || address.find(':') == address.npos) {
        stream_.emplace(connected_unix(address));
        return;
    }
    const HostPort to = parse_host_port(address);
    Fd fd = connected_tcp(to, options.connect_seconds);
    if (is_loopback(to.host) && options.ca.empty() && options.certificate.empty()) {
        stream_.emplace(std::move(fd));
        return;
    }
    tls_ = TlsContext::client(options.ca, options.certificate, options.key);
    stream_.emplace(std::move(fd), tls_->get(), false, to.host);
}

void Client::wait(short events, std::int64_t until)
{
    for (;;) {
        if (options_.keep_waiting && !options_.keep_waiting()) throw Error(ErrorCode::cancelled, "interrupted");
        const std::int64_t left = until - steady_ms();
        if (left <= 0) unavailable("the server on " + address_ + " did not answer in time");
        pollfd one{stream_->fd(), events, 0};
        if (::poll(&one, 1, static_cast<int>(std::min(left, kAskPeriod))) > 0) return;
    }
}

void Client::send(const v1::Request& request)
{
    const std::string bytes = frame(request);
    const std::int64_t until = steady_ms() + static_cast<std::int64_t>(1e3 * options_.reply_seconds);
    for (std::size_t sent = 0; sent < bytes.size();) {
        const long count = stream_->write(std::string_view(bytes).substr(sent));
        if (count == Stream::kEnd) return;  // as above
        if (count == Stream::kLater)
            wait(POLLOUT, until);
        else
            sent += static_cast<std::size_t>(count);
    }
}

v1::Response Client::receive()
{
    const std::int64_t until = steady_ms() + static_cast<std::int64_t>(1e3 * options_.reply_seconds);
    for (;;) {
        if (const auto message = reader_.next()) {
            v1::Response response;
            parse(*message, response);
            const v1::Error& error = response.error();
            if (response.id() == 0 && error.code() == v1::ERROR_CODE_UNAVAILABLE) unavailable(error.message());
            if (response.has_error()) throw ServiceError(error.code(), error.message());
            return response;
        }
        char bytes[64 << 10];
        const long count = stream_->read(bytes, sizeof bytes);
        if (count == Stream::kEnd) {
            unavailable("the connection to " + address_ + " ended" +
                        std::string(stream_->failure().empty() ? "" : ": ") + stream_->failure());
        }
        if (count == Stream::kLater)
            wait(stream_->wants_write() ? POLLOUT : POLLIN, until);
        else
            reader_.append({bytes, static_cast<std::size_t>(count)});
    }
}

void Client::pause(std::int64_t ms)
{
    for (const std::int64_t until = steady_ms() + ms; steady_ms() < until;) {
        if (options_.keep_waiting && !options_.keep_waiting()) throw Error(ErrorCode::cancelled, "interrupted");
        ::poll(nullptr, 0, static_cast<int>(std::min(kAskPeriod, until - steady_ms())));
    }
}

/// Returns with a new connection. @throws ConnectionLost: patience is at an end
void Client::come_back(const std::string& why)
{
    if (options_.patience_seconds <= 0.0) throw ConnectionLost(why);
    if (options_.news) options_.news("the server has gone (" + why + "); looking for it until it is back");
    const std::int64_t until = steady_ms() + static_cast<std::int64_t>(1e3 * options_.patience_seconds);
    for (std::int64_t wait = kFirstPause;; wait = std::min(2 * wait, kLongestPause)) {
        pause(wait);
        try {
            begin();
            if (options_.news) options_.news("the server is back");
            return;
        } catch (const ConnectionLost&) {
            if (steady_ms() >= until) throw;
        }
    }
}

v1::Response Client::call(v1::Request request)
{
    for (;;) {
        try {
            return call_once(request);
        } catch (const ConnectionLost& e) {
            if (request.has_submit() && request.submit().job().idempotency_key().empty()) throw;
            come_back(e.what());
        }
    }
}

v1::Response Client::call_once(v1::Request& request)
{
    request.set_id(next_id_++);
    send(request);
    for (;;) {
        v1::Response response = receive();
        if (response.id() == request.id()) return response;
    }
}

void Client::upload(const std::vector<LocalFile>& files, const std::function<void(float)>& progress)
{
    v1::Request ask;
    for (const LocalFile& file : files) *ask.mutable_blob_status()->add_blobs() = file.blob;
    const v1::BlobStatusReply there = call(ask).blob_status();
    double all = 1.0, done = 0.0;
    for (const LocalFile& file : files) all += static_cast<double>(file.blob.size());
    for (std::size_t i = 0; i < files.size(); ++i) {
        const v1::Blob& blob = files[i].blob;
        std::uint64_t held = there.held(static_cast<int>(i));
        bool complete = held == blob.size() && blob.size() > 0;
        const Fd file(::open(files[i].path.c_str(), O_RDONLY | O_CLOEXEC));
        if (!file) throw Error(ErrorCode::io, "cannot read " + files[i].path + ": " + std::strerror(errno));
        while (!complete) {
            v1::Request put;
            *put.mutable_blob_put()->mutable_blob() = blob;
            put.mutable_blob_put()->set_offset(held);
            put.mutable_blob_put()->set_data(read_part(
                file, held, std::min<std::uint64_t>(hello_.max_chunk_bytes(), blob.size() - held), files[i].path));
            held = call(put).blob_put().held();
            complete = held == blob.size();
            if (progress) progress(static_cast<float>((done + static_cast<double>(held)) / all));
        }
        done += static_cast<double>(blob.size());
    }
}

v1::SubmitReply Client::submit(const v1::Job& job)
{
    v1::Request request;
    *request.mutable_submit()->mutable_job() = job;
    if (options_.patience_seconds > 0.0 && job.idempotency_key().empty())
        request.mutable_submit()->mutable_job()->set_idempotency_key("once-" + random_id());
    return call(request).submit();
}

v1::JobStatus Client::watch(std::uint64_t job, const std::function<void(const v1::JobStatus&)>& news)
{
    v1::Request request;
    request.mutable_watch()->set_job(job);
    const double usual = std::exchange(options_.reply_seconds, 1e9);  // a frame may take long
    for (bool asked = false;;) {
        try {
            if (!std::exchange(asked, true)) {
                request.set_id(next_id_++);
                send(request);
            }
            const v1::Response response = receive();
            if (response.id() != request.id()) continue;
            if (news) news(response.watch().status());
            if (!response.watch().last()) continue;
            options_.reply_seconds = usual;
            return response.watch().status();
        } catch (const ConnectionLost& e) {
            come_back(e.what());
            asked = false;
        }
    }
}

v1::CancelReply Client::cancel(std::uint64_t job)
{
    v1::Request request;
    request.mutable_cancel()->set_job(job);
    return call(request).cancel();
}

v1::JobReply Client::details(std::uint64_t job, std::uint32_t first, std::uint32_t frames)
{
    v1::Request request;
    request.mutable_job()->set_job(job);
    request.mutable_job()->set_first_frame(first);
    request.mutable_job()->set_frames(frames);
    return call(request).job();
}

void Client::fetch(std::uint64_t job, int frame, const std::string& name, const std::string& path)
{
    namespace fs = std::filesystem;
    const fs::path target(path);
    const std::string temporary =
        (target.parent_path() /
         std::string(".").append(target.filename().string()).append(".tmp-").append(std::to_string(::getpid())))
            .string();
    struct Remove {
        const std::string& file;
        ~Remove() { ::unlink(file.c_str()); }
    } const remove{temporary};
    const Fd file(::open(temporary.c_str(), O_CREAT | O_TRUNC | O_WRONLY | O_CLOEXEC | O_NOFOLLOW, 0666));
    const auto fail = [&]() { throw Error(ErrorCode::io, "cannot write " + path + ": " + std::strerror(errno)); };
    if (!file) fail();
    Sha256 sum;
    v1::OutputFile whole;
    std::uint64_t offset = 0;
    do {
        v1::Request request;
        request.mutable_fetch()->set_job(job);
        request.mutable_fetch()->set_frame(frame);
        request.mutable_fetch()->set_name(name);
        request.mutable_fetch()->set_offset(offset);
        const v1::FetchReply part = call(request).fetch();
        whole = part.file();
        if (part.data().empty() && offset < whole.size())
            unavailable("the server sent less of " + name + " than there is");
        std::string_view rest = part.data();
        while (!rest.empty()) {
            const ssize_t count = ::write(file.get(), rest.data(), rest.size());
            if (count < 0 && errno == EINTR) continue;
            if (count < 0) fail();
            rest.remove_prefix(static_cast<std::size_t>(count));
        }
        sum.add(part.data());
        offset += part.data().size();
    } while (offset < whole.size());
    if (sum.digest() != whole.sha256())
        throw ServiceError(v1::ERROR_CODE_BAD_FILE, "what arrived of " + name + " is not what was rendered");
    if (::rename(temporary.c_str(), path.c_str()) != 0) fail();
}

}  // namespace rcs::service
