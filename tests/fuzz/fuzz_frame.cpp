// Whatever bytes arrive, the frame parser gives messages or a ServiceError, holds no more than it was given, and how
// the bytes were split does not matter. Run as: fuzz_frame -max_total_time=1200 -max_len=4096

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <vector>

#include "rcs/v1/service.pb.h"
#include "wire/errors.h"
#include "wire/framing.h"

namespace {

using namespace rcs::service;

struct Read {
    std::vector<std::string> messages;
    bool refused = false;
    bool operator==(const Read&) const = default;
};

Read read_in_pieces(std::string_view bytes, std::size_t piece)
{
    FrameReader reader;
    Read read;
    try {
        for (std::size_t at = 0; at < bytes.size(); at += piece) {
            reader.append(bytes.substr(at, piece));
            while (const auto message = reader.next()) read.messages.emplace_back(*message);
            if (reader.held() > bytes.size()) std::abort();
        }
    } catch (const ServiceError&) {
        read.refused = true;
    }
    return read;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
    const std::string_view bytes(reinterpret_cast<const char*>(data), size);
    const Read whole = read_in_pieces(bytes, size + 1);
    if (!(read_in_pieces(bytes, 1) == whole) || !(read_in_pieces(bytes, 7) == whole)) std::abort();
    for (const std::string& message : whole.messages) {
        try {
            rcs::v1::Request request;
            parse(message, request);
            rcs::v1::Request again;
            const std::string written = frame(request);
            FrameReader reader;
            reader.append(written);
            parse(reader.next().value(), again);
            if (again.ByteSizeLong() != request.ByteSizeLong()) std::abort();
        } catch (const ServiceError&) {
        }
    }
    return 0;
}
