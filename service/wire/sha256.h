#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

struct evp_md_ctx_st;

namespace rcs::service {

inline constexpr std::size_t kDigestSize = 32;  ///< [bytes]

/// SHA-256 of bytes that come in pieces.
class Sha256 {
public:
    Sha256();
    ~Sha256();
    Sha256(const Sha256&) = delete;
    Sha256& operator=(const Sha256&) = delete;

    void add(std::string_view bytes);
    std::string digest();  ///< 32 bytes; nothing can be added after it

private:
    evp_md_ctx_st* context_;
};

std::string sha256(std::string_view bytes);

struct FileDigest {
    std::string digest;  ///< 32 bytes
    std::uint64_t size = 0;
};
/// @throws rcs::Error not_found, io
FileDigest sha256_of_file(const std::string& path);

/// "00ff..", two characters a byte.
std::string hex(std::string_view bytes);
/// 16 random bytes in hexadecimal.
std::string random_id();

}  // namespace rcs::service
