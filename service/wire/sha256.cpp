#include "wire/sha256.h"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <new>
#include <vector>

#include <sys/random.h>

#include <openssl/evp.h>

#include "rcs/error.h"

namespace rcs::service {

Sha256::Sha256() : context_(EVP_MD_CTX_new())
{
    if (context_ == nullptr || EVP_DigestInit_ex(context_, EVP_sha256(), nullptr) != 1) {
        EVP_MD_CTX_free(context_);
        throw std::bad_alloc();
    }
}

Sha256::~Sha256() { EVP_MD_CTX_free(context_); }

void Sha256::add(std::string_view bytes)
{
    if (EVP_DigestUpdate(context_, bytes.data(), bytes.size()) != 1) {
        throw Error(ErrorCode::internal, "SHA-256 failed");
    }
}

std::string Sha256::digest()
{
    std::string bytes(kDigestSize, '\0');
    if (EVP_DigestFinal_ex(context_, reinterpret_cast<unsigned char*>(bytes.data()), nullptr) != 1) {
        throw Error(ErrorCode::internal, "SHA-256 failed");
    }
    return bytes;
}

std::string sha256(std::string_view bytes)
{
    Sha256 sum;
    sum.add(bytes);
    return sum.digest();
}

FileDigest sha256_of_file(const std::string& path)
{
    const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "rbe"), std::fclose);
    if (!file) {
        throw Error(errno == ENOENT ? ErrorCode::not_found : ErrorCode::io,
                    "cannot read " + path + ": " + std::strerror(errno));
    }
    Sha256 sum;
    FileDigest result;
    std::vector<char> block(1 << 20);
    while (const std::size_t count = std::fread(block.data(), 1, block.size(), file.get())) {
        sum.add({block.data(), count});
        result.size += count;
    }
    if (std::ferror(file.get()) != 0) {
        throw Error(ErrorCode::io, "cannot read " + path + " to its end");
    }
    result.digest = sum.digest();
    return result;
}

std::string hex(std::string_view bytes)
{
    constexpr char kDigits[] = "0123456789abcdef";
    std::string text;
    for (const char c : bytes) {
        text += kDigits[static_cast<unsigned char>(c) >> 4];
        text += kDigits[static_cast<unsigned char>(c) & 15];
    }
    return text;
}

std::string random_id()
{
    std::string bytes(16, '\0');
    if (::getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size()))
        throw Error(ErrorCode::internal, "no random numbers");
    return hex(bytes);
}

}  // namespace rcs::service
