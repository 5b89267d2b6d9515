#include "worker/server_link.h"

#include <cerrno>
#include <csignal>

#include <unistd.h>

#include "wire/errors.h"
#include "wire/framing.h"

namespace rcs::service {
namespace {

/// Without a server there is nobody to render for; what is under way is of no use, and destructors would only delay.
[[noreturn]] void leave() { ::_exit(0); }

}  // namespace

ServerLink::ServerLink(int in, int out) : in_(in), out_(out)
{
    ::signal(SIGPIPE, SIG_IGN);  // a server that is gone is told by what write() returns
    std::thread([this] { listen(); }).detach();
}

internal::Task ServerLink::next_task()
{
    std::unique_lock lock(mutex_);
    arrived_.wait(lock, [&] { return !tasks_.empty(); });
    internal::Task task = std::move(tasks_.front());
    tasks_.pop_front();
    return task;
}

void ServerLink::send(const internal::FromWorker& message)
{
    const std::string bytes = frame(message);
    const std::scoped_lock lock(sending_);
    for (std::size_t sent = 0; sent < bytes.size();) {
        const ssize_t count = ::write(out_, bytes.data() + sent, bytes.size() - sent);
        if (count < 0 && errno == EINTR) continue;
        if (count < 0) leave();
        sent += static_cast<std::size_t>(count);
    }
}

void ServerLink::listen()
{
    FrameReader reader;
    char bytes[64 << 10];
    for (;;) {
        const ssize_t count = ::read(in_, bytes, sizeof bytes);
        if (count < 0 && errno == EINTR) continue;
        if (count <= 0) leave();
        try {
            reader.append({bytes, static_cast<std::size_t>(count)});
            while (const auto message = reader.next()) {
                internal::ToWorker to;
                parse(*message, to);
                if (to.cancel()) cancelled_ = true;
                if (!to.has_task()) continue;
                const std::scoped_lock lock(mutex_);
                cancelled_ = false;
                tasks_.push_back(std::move(*to.mutable_task()));
                arrived_.notify_one();
            }
        } catch (const ServiceError&) {
            leave();
        }
    }
}

}  // namespace rcs::service
