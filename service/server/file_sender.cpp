#include "server/file_sender.h"

#include <algorithm>
#include <cerrno>
#include <cstring>

#include <fcntl.h>
#include <sys/sendfile.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/time.h>
#include <unistd.h>

namespace rcs::service {
namespace {

constexpr std::size_t kMostOrders = 256;
constexpr timeval kPatience{5, 0};  // for a browser to take some of it

bool send_all(const Fd& browser, const std::string& bytes)
{
    for (std::size_t sent = 0; sent < bytes.size();) {
        const ssize_t count = ::send(browser.get(), bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
        if (count < 0 && errno == EINTR) continue;
        if (count <= 0) return false;
        sent += static_cast<std::size_t>(count);
    }
    return true;
}

void send_file(const Fd& browser, const std::string& path, const std::string& head)
{
    ::fcntl(browser.get(), F_SETFL, 0);
    ::setsockopt(browser.get(), SOL_SOCKET, SO_SNDTIMEO, &kPatience, sizeof kPatience);
    const Fd file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW));
    struct stat status{};
    if (!file || ::fstat(file.get(), &status) != 0 || !S_ISREG(status.st_mode)) {
        send_all(browser, "HTTP/1.1 404 Not Found\r\nContent-Length: 0\r\nConnection: close\r\n\r\n");
        return;
    }
    if (!send_all(browser, head + "Content-Length: " + std::to_string(status.st_size) + "\r\n\r\n")) return;
    constexpr std::size_t kAtATime = 1 << 20;
    for (off_t sent = 0; sent < status.st_size;) {
        const auto rest = static_cast<std::size_t>(status.st_size - sent);
        if (::sendfile(browser.get(), file.get(), &sent, std::min(rest, kAtATime)) <= 0 && errno != EINTR) return;
    }
}

}  // namespace

FileSender::FileSender() : thread_([this] { run(); }) {}

FileSender::~FileSender()
{
    {
        const std::scoped_lock lock(mutex_);
        stopping_ = true;
        orders_.clear();
    }
    arrived_.notify_one();
    thread_.join();
}

bool FileSender::send(Fd browser, const std::string& path, const std::string& head)
{
    const std::scoped_lock lock(mutex_);
    if (orders_.size() >= kMostOrders) return false;
    orders_.push_back({std::move(browser), path, head});
    arrived_.notify_one();
    return true;
}

void FileSender::run()
{
    for (;;) {
        std::unique_lock lock(mutex_);
        arrived_.wait(lock, [&] { return stopping_ || !orders_.empty(); });
        if (stopping_) return;
        const Order order = std::move(orders_.front());
        orders_.pop_front();
        lock.unlock();
        send_file(order.browser, order.path, order.head);
    }
}

}  // namespace rcs::service
