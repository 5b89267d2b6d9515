#include "view/web.h"

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <exception>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <utility>

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>

#include "rcs/error.h"

namespace rcs::service {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using asio::ip::tcp;
using boost::system::error_code;

constexpr std::uint32_t kLongestHeader = 8 << 10;    // of a request [bytes]
constexpr std::size_t kLongestMessage = 4 << 10;     // of a page [bytes]
constexpr std::size_t kLongestReason = 120;          // of a closing frame [bytes]
constexpr std::size_t kMostWaiting = 32;             // messages to a page that does not take them
constexpr int kMostVisitors = 32;                    // connections at a time
constexpr auto kTime = std::chrono::seconds(10);     // for a request and its answer
constexpr auto kSilence = std::chrono::seconds(60);  // of a page, after which it is asked for, and then given up
constexpr unsigned kTakenOver = 4001;                // what a page is closed with by the next one

http::response<http::string_body> response(http::status status, const char* type, std::string body)
{
    http::response<http::string_body> answer(status, 11);
    answer.set(http::field::content_type, type);
    answer.set(http::field::cache_control, "no-store");
    answer.set("X-Content-Type-Options", "nosniff");
    answer.set("Referrer-Policy", "no-referrer");
    answer.set("Cross-Origin-Resource-Policy", "same-origin");
    answer.set("Cross-Origin-Opener-Policy", "same-origin");
    answer.keep_alive(false);
    answer.body() = std::move(body);
    answer.prepare_payload();
    return answer;
}

/// What a page from here may load: itself.
std::string policy(int port)
{
    const std::string name = std::to_string(port);
    return "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; connect-src 'self' "
           "ws://127.0.0.1:" +
           name + " ws://localhost:" + name + "; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";
}

http::response<http::string_body> page_file(Room room, int port)
{
    const auto& files = view_page_sources();
    auto answer = room == Room::style ? response(http::status::ok, "text/css; charset=utf-8", files.at("page.css"))
                  : room == Room::script
                      ? response(http::status::ok, "text/javascript; charset=utf-8", files.at("page.js"))
                      : response(http::status::ok, "text/html; charset=utf-8", files.at("page.html"));
    answer.set("Content-Security-Policy", policy(port));
    return answer;
}

std::string_view view_of(beast::string_view text) { return {text.data(), text.size()}; }

/// @return "" also where there are two
std::string_view only(const http::request_header<>& request, http::field name)
{
    return request.count(name) == 1 ? view_of(request[name]) : std::string_view{};
}

struct Outgoing {
    bool binary = false;
    std::string bytes = {};
};

class Page;

/// What all connections have in common; used by the server's thread alone.
struct House {
    asio::io_context io;
    tcp::acceptor acceptor{io};
    Door door;
    Visits visits;
    std::shared_ptr<Page> page;  // that is served
    int visitors = 0;
};

/// A page's WebSocket.
class Page : public std::enable_shared_from_this<Page> {
public:
    Page(House& house, beast::tcp_stream stream) : house_(house), socket_(std::move(stream)) { ++house_.visitors; }
    ~Page() { --house_.visitors; }
    Page(const Page&) = delete;
    Page& operator=(const Page&) = delete;

    void begin(const http::request<http::empty_body>& request)
    {
        socket_.next_layer().expires_never();
        websocket::stream_base::timeout times{kTime, kSilence, true};
        socket_.set_option(times);
        socket_.read_message_max(kLongestMessage);
        socket_.auto_fragment(false);
        socket_.async_accept(request, [self = shared_from_this()](error_code failed) {
            if (!failed) self->come();
        });
    }

    void send(Outgoing message)
    {
        if (closing_ || out_.size() >= kMostWaiting) return;
        out_.push_back(std::move(message));
        if (out_.size() == 1) write();
    }

    /// @param why  one line
    void close(unsigned code, std::string why)
    {
        if (std::exchange(closing_, true)) return;
        if (why.size() > kLongestReason) why.resize(kLongestReason);
        socket_.async_close({static_cast<websocket::close_code>(code), why},
                            [self = shared_from_this()](error_code) { self->leave(); });
    }

private:
    void come()
    {
        if (house_.page) house_.page->close(kTakenOver, "another page has taken over");
        house_.page = shared_from_this();
        send({false, house_.visits.greeting()});
        read();
    }

    void leave()
    {
        closing_ = true;
        if (house_.page.get() != this) return;
        house_.page.reset();
        house_.visits.gone();
    }

    void read()
    {
        socket_.async_read(in_, [self = shared_from_this()](error_code failed, std::size_t) {
            if (failed) return self->leave();
            self->take();
        });
    }

    void take()
    {
        const std::string text = beast::buffers_to_string(in_.data());
        in_.consume(in_.size());
        if (!closing_ && house_.page.get() == this) {
            try {
                if (!socket_.got_text()) throw Error(ErrorCode::bad_argument, "a message is binary, expected text");
                house_.visits.wished(parse_wish(text));
            } catch (const Error& e) {
                close(websocket::close_code::policy_error, e.what());
            } catch (const std::exception& e) {
                close(websocket::close_code::internal_error, e.what());
            }
        }
        read();  // until the other end has gone
    }

    void write()
    {
        socket_.binary(out_.front().binary);
        socket_.async_write(asio::buffer(out_.front().bytes),
                            [self = shared_from_this()](error_code failed, std::size_t) {
                                self->out_.pop_front();
                                if (!failed && !self->out_.empty() && !self->closing_) self->write();
                            });
    }

    House& house_;
    websocket::stream<beast::tcp_stream> socket_;
    beast::flat_buffer in_;
    std::deque<Outgoing> out_;
    bool closing_ = false;
};

/// Someone who asks for something: answered, or let in as a page.
class Visitor : public std::enable_shared_from_this<Visitor> {
public:
    Visitor(House& house, tcp::socket socket) : house_(house), stream_(std::move(socket)) { ++house_.visitors; }
    ~Visitor() { --house_.visitors; }
    Visitor(const Visitor&) = delete;
    Visitor& operator=(const Visitor&) = delete;

    void begin()
    {
        parser_.header_limit(kLongestHeader);
        parser_.body_limit(0);
        stream_.expires_after(kTime);
        http::async_read(stream_, buffer_, parser_, [self = shared_from_this()](error_code failed, std::size_t) {
            if (!failed) return self->look();
            if (failed != http::error::end_of_stream && failed != beast::error::timeout)
                self->answer(response(http::status::bad_request, "text/plain", "no request that is answered here\n"));
        });
    }

private:
    void look()
    {
        const http::request<http::empty_body>& request = parser_.get();
        const auto given = [&](http::field name) { return request.count(name) > 0; };
        Asked asked{view_of(request.method_string()), view_of(request.target()), only(request, http::field::host),
                    only(request, http::field::origin), websocket::is_upgrade(request)};
        if (given(http::field::origin) && asked.origin.empty()) asked.origin = "none";
        const Answer found = answer_door(house_.door, asked);
        if (!found.refusal.empty())
            return answer(response(http::status::forbidden, "text/plain", found.refusal + "\n"));
        if (found.room == Room::socket) return std::make_shared<Page>(house_, std::move(stream_))->begin(request);
        answer(page_file(found.room, house_.door.port));
    }

    void answer(http::response<http::string_body> with)
    {
        answer_.emplace(std::move(with));
        http::async_write(stream_, *answer_, [self = shared_from_this()](error_code, std::size_t) {
            error_code ignored;
            self->stream_.socket().shutdown(tcp::socket::shutdown_send, ignored);
        });
    }

    House& house_;
    beast::tcp_stream stream_;
    beast::flat_buffer buffer_{kLongestHeader};
    http::request_parser<http::empty_body> parser_;
    std::optional<http::response<http::string_body>> answer_;
};

void accept(House& house)
{
    house.acceptor.async_accept([&house](error_code failed, tcp::socket socket) {
        if (failed == asio::error::operation_aborted) return;
        if (!failed && house.visitors < kMostVisitors) {
            error_code ignored;
            socket.set_option(tcp::no_delay(true), ignored);
            std::make_shared<Visitor>(house, std::move(socket))->begin();
        }
        accept(house);
    });
}

void listen(House& house, int port)
{
    try {
        const tcp::endpoint at(asio::ip::address_v4::loopback(), static_cast<unsigned short>(port));
        house.acceptor.open(at.protocol());
        house.acceptor.set_option(tcp::acceptor::reuse_address(true));
        house.acceptor.bind(at);
        house.acceptor.listen();
        house.door.port = house.acceptor.local_endpoint().port();
    } catch (const boost::system::system_error& e) {
        throw Error(ErrorCode::io, "cannot listen at 127.0.0.1:" + std::to_string(port) + ": " + e.code().message());
    }
}

}  // namespace

struct ViewServer::State {
    House house;
    std::jthread thread;
};

ViewServer::ViewServer(int port, Visits visits) : state_(std::make_unique<State>())
{
    House& house = state_->house;
    house.visits = std::move(visits);
    house.door.token = random_token();
    listen(house, port);
    accept(house);
    state_->thread = std::jthread([&house] { house.io.run(); });
}

ViewServer::~ViewServer() { stop(); }

void ViewServer::stop()
{
    House& house = state_->house;
    if (!state_->thread.joinable()) return;
    asio::post(house.io, [&house] {
        error_code ignored;
        house.acceptor.close(ignored);
        if (house.page) house.page->close(websocket::close_code::going_away, "rcsplat view has ended");
        house.io.stop();
    });
    state_->thread.join();
    house.page.reset();
}

const Door& ViewServer::door() const { return state_->house.door; }

void ViewServer::tell(std::string json)
{
    House& house = state_->house;
    asio::post(house.io, [&house, json = std::move(json)]() mutable {
        if (house.page) house.page->send({false, std::move(json)});
    });
}

void ViewServer::show(std::string message)
{
    House& house = state_->house;
    asio::post(house.io, [&house, message = std::move(message)]() mutable {
        if (house.page) house.page->send({true, std::move(message)});
    });
}

}  // namespace rcs::service
