#include "server/server.h"

#include <algorithm>
#include <csignal>

#include <poll.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <google/protobuf/stubs/logging.h>

#include "process/clock.h"
#include "server/daemon.h"
#include "server/guests.h"
#include "server/log.h"
#include "server/page.h"
#include "server/service.h"
#include "server/sockets.h"
#include "wire/errors.h"

namespace rcs::service {
namespace {

/// Whether its answer says that something was put down.
bool changes_jobs(const v1::Request& request)
{
    return request.has_submit() || request.has_cancel() || request.has_retry() || request.has_pause() ||
           request.has_priority();
}

class Server {
public:
    Server(const ServerConfig& config, const std::function<ServerConfig()>& reload);
    void run();

private:
    struct Answer {
        Connection* connection;
        v1::Response response;
        bool durable;  ///< says that something was put down
    };

    void turn();
    void wait();
    void read_signals();
    void read_requests(Connection& connection);
    void answer(Connection& connection, const v1::Request& request);
    void undo_turn(const std::string& why);
    void finish_turn();
    void tell_watchers();
    void reload_config();

    ServerConfig config_;
    std::function<ServerConfig()> reload_;
    ServerLog log_;
    Fd signals_;
    Service service_;
    Guests guests_;
    FileSender files_;
    std::vector<Answer> answers_;  ///< of this turn; sent once it is committed
    std::vector<FrameEnd> ends_;
    std::vector<std::uint64_t> changed_,
        ended_;  ///< jobs of this turn with news, and with an end of a frame or of waiting
    std::vector<pollfd> polled_;
    std::size_t first_worker_ = 0;  ///< in polled_
    std::int64_t next_tend_ms_ = 0;
    std::int64_t stop_at_ms_ = 0;  ///< 0: not stopping
};

Server::Server(const ServerConfig& config, const std::function<ServerConfig()>& reload)
    : config_(config),
      reload_(reload),
      signals_(catch_signals()),
      service_(config_, log_),
      guests_(config_, log_, service_.counters())
{
    log_.set_debug(config_.log_debug);
    raise_file_limit();
}

void Server::run()
{
    notify("READY=1");
    for (;;) {
        turn();
        if (stop_at_ms_ != 0 && (service_.is_idle() || steady_ms() >= stop_at_ms_)) break;
    }
    service_.end();
    const std::int64_t now = steady_ms();
    for (Connection& connection : guests_.connections()) {
        connection.finish(error_message(v1::ERROR_CODE_UNAVAILABLE, "the server has stopped"), now);
        connection.flush(now);
    }
    log_.info("stopped");
}

/// What has arrived is done, made to last, and only then answered.
void Server::turn()
{
    wait();
    const std::int64_t now = steady_ms();
    changed_.clear();
    ended_.clear();
    read_signals();
    std::size_t next = first_worker_;
    for (Worker& worker : service_.workers().workers()) {
        const short events =
            next < polled_.size() && polled_[next].fd == worker.socket.get() ? polled_[next].revents : 0;
        ++next;
        service_.workers().serve(worker, (events & (POLLIN | POLLHUP)) != 0, (events & POLLOUT) != 0, ends_, changed_);
    }
    try {
        service_.take(std::exchange(ends_, {}));
    } catch (const ServiceError& e) {
        undo_turn(e.what());
    }
    for (HttpConnection& browser : guests_.browsers()) {
        const short events = next < polled_.size() && polled_[next].fd == browser.fd() ? polled_[next].revents : 0;
        ++next;
        if (events == 0) continue;
        if (const auto path = browser.receive()) browser.answer(page_answer(service_, *path), files_);
        browser.flush();
    }
    for (Connection& connection : guests_.connections()) {
        const short events = next < polled_.size() && polled_[next].fd == connection.fd() ? polled_[next].revents : 0;
        ++next;
        if ((events & (POLLIN | POLLHUP | POLLERR)) != 0 || connection.has_pending()) read_requests(connection);
    }
    finish_turn();
    guests_.let_in(polled_);
    service_.schedule();
    if (now >= next_tend_ms_) next_tend_ms_ = service_.tend();
    tell_watchers();
    guests_.drop(steady_ms());
}

void Server::wait()
{
    const std::int64_t now = steady_ms();
    std::int64_t until = next_tend_ms_;
    polled_.clear();
    polled_.push_back({signals_.get(), POLLIN, 0});
    guests_.add_doors_to(polled_, now);
    first_worker_ = polled_.size();
    for (const Worker& worker : service_.workers().workers()) {
        polled_.push_back({worker.socket.get(), static_cast<short>(POLLIN | (worker.out.empty() ? 0 : POLLOUT)), 0});
    }
    for (const HttpConnection& browser : guests_.browsers()) polled_.push_back({browser.fd(), browser.events(), 0});
    for (const Connection& connection : guests_.connections()) {
        polled_.push_back({connection.fd(), connection.events(), 0});
        if (connection.has_pending()) until = now;
        until = std::min({until, connection.deadline(config_.message_seconds), connection.next_due().value_or(until)});
    }
    ::poll(polled_.data(), polled_.size(), static_cast<int>(std::clamp<std::int64_t>(until - now, 0, 1000)));
}

void Server::read_signals()
{
    signalfd_siginfo signal{};
    while (::read(signals_.get(), &signal, sizeof signal) == sizeof signal) {
        switch (signal.ssi_signo) {
            case SIGCHLD:
                service_.workers().reap(ends_);
                next_tend_ms_ = 0;
                break;
            case SIGHUP:
                reload_config();
                break;
            default:
                notify("STOPPING=1");
                log_.info("stopping", {{"signal", static_cast<int>(signal.ssi_signo)}});
                service_.stop();
                stop_at_ms_ = stop_at_ms_ == 0 ? steady_ms() + static_cast<std::int64_t>(1e3 * config_.stop_grace) : 1;
        }
    }
}

void Server::reload_config()
{
    try {
        ServerConfig fresh = config_;
        const std::string left_out = fresh.adopt_reloadable(reload_());
        std::swap(config_, fresh);
        guests_.reception().adopt(config_);
        service_.adopt_config();
        log_.set_debug(config_.log_debug);
        left_out.empty() ? log_.info("reloaded")
                         : log_.write(Level::warning, "reloaded", {{"only_at_the_next_start", left_out}});
    } catch (const std::exception& e) {
        log_.write(Level::error, "not_reloaded", {{"why", e.what()}});
    }
}

void Server::read_requests(Connection& connection)
{
    std::vector<v1::Request> requests;
    std::optional<v1::Error> farewell;
    try {
        connection.receive(requests, steady_ms());
    } catch (const ServiceError& e) {
        farewell = error_message(e.code(), e.what());
    }
    try {
        for (const v1::Request& request : requests) answer(connection, request);
    } catch (const ServiceError& e) {
        farewell = error_message(e.code(), e.what());
    }
    if (!farewell) return;
    ++service_.counters().connections_refused;
    log_.write(Level::warning, "sent_away", {{"owner", connection.caller().owner}, {"why", farewell->message()}});
    finish_turn();  // what was asked before is still answered
    connection.finish(*farewell, steady_ms());
}

void Server::answer(Connection& connection, const v1::Request& request)
{
    if (request.has_watch()) {
        v1::Response response;
        response.set_id(request.id());
        try {
            service_.status(request.watch().job(), connection.caller());
            connection.watch(request.watch().job(), request.id());
            return;
        } catch (const ServiceError& e) {
            if (e.code() == v1::ERROR_CODE_PROTOCOL) throw;
            *response.mutable_error() = error_message(e.code(), e.what());
        }
        answers_.push_back({&connection, response, false});
        return;
    }
    try {
        answers_.push_back({&connection, service_.answer(request, connection.caller()), changes_jobs(request)});
        if (request.has_cancel()) ended_.push_back(request.cancel().job());
        if (request.has_retry()) changed_.push_back(request.retry().job());
        if (request.has_pause()) changed_.push_back(request.pause().job());
        if (changes_jobs(request)) next_tend_ms_ = 0;
    } catch (const ServiceError& e) {
        undo_turn(e.what());
        v1::Response response;
        response.set_id(request.id());
        *response.mutable_error() = error_message(e.code(), e.what());
        answers_.push_back({&connection, response, false});
    }
}

/// Nothing of this turn was put down: answers that said so are taken back.
void Server::undo_turn(const std::string& why)
{
    log_.write(Level::error, "undone", {{"why", why}});
    service_.roll_back();
    for (Answer& answer : answers_) {
        if (answer.durable && !answer.response.has_error()) {
            *answer.response.mutable_error() = error_message(v1::ERROR_CODE_UNAVAILABLE, why);
        }
    }
}

void Server::finish_turn()
{
    try {
        for (const std::uint64_t job : service_.commit()) ended_.push_back(job);
    } catch (const ServiceError& e) {
        undo_turn(e.what());
    }
    const std::int64_t now = steady_ms();
    for (Answer& answer : answers_) {
        try {
            answer.connection->send(answer.response);
        } catch (const ServiceError& e) {  // larger than a message may be
            v1::Response response;
            response.set_id(answer.response.id());
            *response.mutable_error() = error_message(e.code(), e.what());
            answer.connection->send(response);
        }
        answer.connection->flush(now);
    }
    answers_.clear();
}

void Server::tell_watchers()
{
    const std::int64_t now = steady_ms();
    for (Connection& connection : guests_.connections()) {
        for (const std::uint64_t job : changed_) connection.touch(job, false);
        for (const std::uint64_t job : ended_) connection.touch(job, true);
        for (const auto& [job, request] : connection.due(now)) {
            v1::Response response;
            response.set_id(request);
            try {
                v1::WatchReply& reply = *response.mutable_watch();
                *reply.mutable_status() = service_.status(job, connection.caller());
                reply.set_last(has_ended(reply.status().state()));
                if (reply.last()) connection.unwatch(request);
            } catch (const ServiceError& e) {
                *response.mutable_error() = error_message(e.code(), e.what());
                connection.unwatch(request);
            }
            connection.send(response);
        }
        connection.flush(now);
    }
}

}  // namespace

void serve(const ServerConfig& config, const std::function<ServerConfig()>& reload)
{
    google::protobuf::SetLogHandler(nullptr);  // what clients send wrong is told to them, and in this log's own form
    Server(config, reload).run();
}

}  // namespace rcs::service
