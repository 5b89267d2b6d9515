#include "wire/framing.h"

#include <random>

#include <gtest/gtest.h>

#include "rcs/v1/service.pb.h"
#include "wire/errors.h"
#include "wire/sha256.h"

namespace rcs::service {
namespace {

v1::Request cancel_request(std::uint64_t id)
{
    v1::Request request;
    request.set_id(id);
    request.mutable_cancel()->set_job(7);
    return request;
}

v1::ErrorCode code_of(const std::string& bytes)
{
    FrameReader reader;
    reader.append(bytes);
    try {
        reader.next();
    } catch (const ServiceError& e) {
        return e.code();
    }
    return v1::ERROR_CODE_UNSPECIFIED;
}

TEST(Framing, AnySplitOfTheBytesGivesTheSameMessages)
{
    std::string bytes;
    for (std::uint64_t id = 1; id <= 50; ++id) {
        v1::Request request = cancel_request(id * 1'000'003);
        request.mutable_hello()->set_client(std::string(id * 37, 'x'));
        bytes += frame(request);
    }
    std::mt19937 random(1);
    for (int round = 0; round < 20; ++round) {
        FrameReader reader;
        std::uint64_t id = 0;
        for (std::size_t at = 0; at < bytes.size();) {
            const std::size_t count = std::min<std::size_t>(1 + random() % 400, bytes.size() - at);
            reader.append(std::string_view(bytes).substr(at, count));
            at += count;
            while (const auto message = reader.next()) {
                v1::Request request;
                parse(*message, request);
                EXPECT_EQ(request.id(), ++id * 1'000'003);
                EXPECT_EQ(request.hello().client().size(), id * 37);
            }
        }
        EXPECT_EQ(id, 50u);
        EXPECT_FALSE(reader.half_sent());
    }
}

TEST(Framing, ALengthBeyondTheLimitIsRefusedBeforeItsBytesArrive)
{
    EXPECT_EQ(code_of(std::string("\x81\x80\x40", 3)), v1::ERROR_CODE_PROTOCOL);          // 1 MiB + 1
    EXPECT_EQ(code_of(std::string("\x80\x80\x40", 3)), v1::ERROR_CODE_UNSPECIFIED);       // 1 MiB
    EXPECT_EQ(code_of(std::string("\xff\xff\xff\xff\x0f", 5)), v1::ERROR_CODE_PROTOCOL);  // 4 GiB
    EXPECT_EQ(code_of(std::string(10, '\xff')), v1::ERROR_CODE_PROTOCOL);
    EXPECT_EQ(code_of(std::string(3, '\xff')), v1::ERROR_CODE_UNSPECIFIED) << "may still become a length";
}

TEST(Framing, AMessageThatWouldBeTooLargeIsNotSent)
{
    v1::Request request;
    request.mutable_blob_put()->set_data(std::string(kMaxMessage, 'x'));
    EXPECT_THROW(frame(request), ServiceError);
    request.mutable_blob_put()->set_data(std::string(kMaxChunk, 'x'));
    EXPECT_EQ(frame(request).size(), kMaxChunk + 11);
}

TEST(Framing, TruncatedAndNestedBytesAreNoMessage)
{
    const std::string whole = cancel_request(5).SerializeAsString();
    for (std::size_t size = 1; size < whole.size(); ++size) {
        v1::Request request;
        if (size == 2) continue;  // the id alone is a message
        EXPECT_THROW(parse(whole.substr(0, size), request), ServiceError) << size;
    }
    std::string nested;  // groups within groups, of a field that nobody knows
    for (int i = 0; i < 40; ++i) nested = std::string("\xa3\x06").append(nested).append("\xa4\x06");
    v1::Request request;
    EXPECT_THROW(parse(nested, request), ServiceError);
}

TEST(Framing, UnknownFieldsAreIgnored)
{
    v1::Request request;
    parse(cancel_request(9).SerializeAsString() + std::string("\xf8\x3f\x01", 3), request);  // field 1023
    EXPECT_EQ(request.id(), 9u);
    EXPECT_EQ(request.cancel().job(), 7u);
}

TEST(Framing, TheGreetingSaysWhichVersionIsSpoken)
{
    check_greeting(greeting());
    EXPECT_EQ(greeting(), std::string("RCSP\0\2\0\0", 8));
    const auto code = [](const std::string& bytes) {
        try {
            check_greeting(bytes);
        } catch (const ServiceError& e) {
            return e.code();
        }
        return v1::ERROR_CODE_UNSPECIFIED;
    };
    EXPECT_EQ(code(std::string("RCSP\0\1\0\0", 8)), v1::ERROR_CODE_VERSION);
    EXPECT_EQ(code("GET / HT"), v1::ERROR_CODE_PROTOCOL);
}

TEST(Framing, TakenBytesComeBeforeMessages)
{
    FrameReader reader;
    const std::string bytes = greeting() + frame(cancel_request(3));
    for (const char c : bytes.substr(0, 7)) {
        reader.append({&c, 1});
        EXPECT_FALSE(reader.take(kGreetingSize));
    }
    reader.append(bytes.substr(7));
    EXPECT_EQ(reader.take(kGreetingSize), greeting());
    EXPECT_TRUE(reader.next());
    EXPECT_FALSE(reader.next());
}

TEST(Sha256, GivesThePublishedDigests)  // FIPS 180-2, appendix B
{
    EXPECT_EQ(hex(sha256("abc")), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
    EXPECT_EQ(hex(sha256("")), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
}

TEST(Utf8Text, ReplacesWhatMessagesMayNotHold)
{
    EXPECT_EQ(utf8_text("sch\xc3\xb6n \xe2\x82\xac \xf0\x9f\x98\x80"), "sch\xc3\xb6n \xe2\x82\xac \xf0\x9f\x98\x80");
    EXPECT_EQ(utf8_text("a\xff\xc3z\xc0\x80\xed\xa0\x80"), "a??z?????");
}

}  // namespace
}  // namespace rcs::service
