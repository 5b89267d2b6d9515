#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <type_traits>

#include "rcs/api.h"
#include "rcs/camera.h"
#include "rcs/scene.h"

namespace rcs {

/// A 64-bit hash of values in the order in which they are added: tells whether a saved result belongs to what is asked
/// for now. The same on every machine of the same byte order; no protection against intent.
class RCS_API Fingerprint {
public:
    /// @param size  [bytes]; what does not fill the last 8 counts as if zeros followed
    void add_bytes(const void* data, std::size_t size);
    /// Length and bytes, so that "ab", "c" differs from "a", "bc".
    void add(std::string_view text);
    /// A number, by its bytes.
    template <typename Number>
        requires std::is_arithmetic_v<Number> || std::is_enum_v<Number>
    void add(Number value)
    {
        add_bytes(&value, sizeof value);
    }

    std::uint64_t value() const { return state_; }  ///< of all that was added so far
    std::string text() const;                       ///< the same as 16 hexadecimal digits

private:
    std::uint64_t state_ = 0x9e3779b97f4a7c15u;
};

/// Everything of the scene that light depends on; names do not count.
RCS_API void add(Fingerprint& fingerprint, const Scene& scene);
/// Projection and pose; the name does not count.
RCS_API void add(Fingerprint& fingerprint, const Camera& camera);

}  // namespace rcs
