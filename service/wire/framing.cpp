#include "wire/framing.h"

#include <cstdint>

#include <google/protobuf/io/coded_stream.h>

#include "wire/errors.h"

namespace rcs::service {
namespace {

constexpr std::string_view kMagic = "RCSP";
constexpr int kMostNesting = 16;                 // our own messages take 6
constexpr std::size_t kLengthBytes = 4;          // 28 bits are more than kMaxMessage takes
constexpr std::size_t kKeptCapacity = 64 << 10;  // of a reader with nothing to read [bytes]

}  // namespace

std::string greeting()
{
    std::string bytes(kMagic);
    bytes += static_cast<char>(kProtocolVersion >> 8);
    bytes += static_cast<char>(kProtocolVersion & 0xff);
    return bytes + std::string(2, '\0');
}

void check_greeting(std::string_view bytes)
{
    if (bytes.size() != kGreetingSize || bytes.substr(0, kMagic.size()) != kMagic) {
        throw ServiceError(v1::ERROR_CODE_PROTOCOL,
                           "the connection did not begin with the greeting of rcsplat's protocol");
    }
    const auto byte = [&](std::size_t i) { return static_cast<int>(static_cast<unsigned char>(bytes[i])); };
    const int version = byte(4) << 8 | byte(5);
    if (version != kProtocolVersion) {
        throw ServiceError(v1::ERROR_CODE_VERSION, "protocol version " + std::to_string(version) +
                                                       " is not spoken here, version " +
                                                       std::to_string(kProtocolVersion) + " is");
    }
}

std::string frame(const google::protobuf::MessageLite& message)
{
    const std::size_t size = message.ByteSizeLong();
    if (size > kMaxMessage) {
        throw ServiceError(v1::ERROR_CODE_LIMIT, "a message of " + std::to_string(size) + " bytes is larger than the " +
                                                     std::to_string(kMaxMessage) + " that are allowed");
    }
    std::string bytes;
    std::size_t rest = size;
    for (; rest >= 0x80; rest >>= 7) {
        bytes += static_cast<char>(0x80 | (rest & 0x7f));
    }
    bytes += static_cast<char>(rest);
    message.AppendToString(&bytes);
    return bytes;
}

void parse(std::string_view bytes, google::protobuf::MessageLite& message)
{
    google::protobuf::io::CodedInputStream stream(reinterpret_cast<const std::uint8_t*>(bytes.data()),
                                                  static_cast<int>(bytes.size()));
    stream.SetRecursionLimit(kMostNesting);
    if (!message.ParseFromCodedStream(&stream) || !stream.ConsumedEntireMessage()) {
        throw ServiceError(v1::ERROR_CODE_PROTOCOL, "bytes that are no " + message.GetTypeName());
    }
}

std::optional<std::string_view> FrameReader::next()
{
    drop_read();
    std::size_t length = 0;
    for (std::size_t i = 0; i < kLengthBytes; ++i) {
        if (begin_ + i == buffer_.size()) return std::nullopt;
        const auto byte = static_cast<unsigned char>(buffer_[begin_ + i]);
        length |= static_cast<std::size_t>(byte & 0x7f) << (7 * i);
        if (byte & 0x80) continue;
        if (length > kMaxMessage) {
            throw ServiceError(v1::ERROR_CODE_PROTOCOL, "a message of " + std::to_string(length) +
                                                            " bytes was announced, at most " +
                                                            std::to_string(kMaxMessage) + " are allowed");
        }
        if (held() < i + 1 + length) return std::nullopt;
        const std::size_t start = begin_ + i + 1;
        begin_ = start + length;
        return std::string_view(buffer_).substr(start, length);
    }
    throw ServiceError(v1::ERROR_CODE_PROTOCOL,
                       "a message's length takes more than " + std::to_string(kLengthBytes) + " bytes");
}

std::optional<std::string> FrameReader::take(std::size_t size)
{
    drop_read();
    if (held() < size) return std::nullopt;
    begin_ += size;
    return buffer_.substr(begin_ - size, size);
}

void FrameReader::drop_read()
{
    if (begin_ == buffer_.size()) {
        buffer_.clear();
        if (buffer_.capacity() > kKeptCapacity) buffer_.shrink_to_fit();
        begin_ = 0;
    } else if (begin_ > kKeptCapacity) {
        buffer_.erase(0, begin_);
        begin_ = 0;
    }
}

}  // namespace rcs::service
