#include "worker/server_link.h"

#include <cerrno>

#include <sys/socket.h>
#include <unistd.h>

#include "wire/errors.h"
#include "wire/framing.h"

namespace rcs::service {
namespace {

/// Without a server there is nobody to render for; what is under way is of no use, and destructors would only delay.
[[noreturn]] void leave() { ::_exit(0); }

}  // namespace

ServerLink::ServerLink(int fd) : fd_(fd)
{
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
    for (std::size_t sent = 0; sent < bytes.size();) {
        const ssize_t count = ::send(fd_, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
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
        const ssize_t count = ::recv(fd_, bytes, sizeof bytes, 0);
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
