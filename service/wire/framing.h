#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include <google/protobuf/message_lite.h>

namespace rcs::service {

inline constexpr std::size_t kMaxMessage = 1 << 20;  ///< of any message [bytes]
inline constexpr std::size_t kMaxChunk = 512 << 10;  ///< of a file's bytes in a message [bytes]
inline constexpr int kProtocolVersion = 2;
inline constexpr std::size_t kGreetingSize = 8;

/// What each side sends first (proto/rcs/v1/service.proto).
std::string greeting();
/// @throws ServiceError protocol: no greeting; version: of another protocol version
void check_greeting(std::string_view bytes);

/// A message with its length before it.
/// @throws ServiceError limit, if it is larger than kMaxMessage
std::string frame(const google::protobuf::MessageLite& message);

/// @param bytes  of one message @throws ServiceError protocol: no message of this kind, or nested too deep
void parse(std::string_view bytes, google::protobuf::MessageLite& message);

/// Cuts a stream of bytes into messages. Holds no more than what has arrived, whatever lengths are announced.
class FrameReader {
public:
    void append(std::string_view bytes) { buffer_.append(bytes); }

    /// The bytes of the next message, valid until the next call of any function; none while it is not complete.
    /// @throws ServiceError protocol: a length beyond kMaxMessage or that is none
    std::optional<std::string_view> next();
    /// Takes `size` bytes as they are; none while there are fewer.
    std::optional<std::string> take(std::size_t size);

    /// Whether bytes of an incomplete message are held.
    bool half_sent() const { return begin_ < buffer_.size(); }
    std::size_t held() const { return buffer_.size() - begin_; }  ///< [bytes]

private:
    void drop_read();

    std::string buffer_;
    std::size_t begin_ = 0;  ///< what lies before was read
};

}  // namespace rcs::service
