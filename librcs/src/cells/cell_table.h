#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "util/random.h"

namespace rcs {

/// Numbers of cells by key: open addressing, at most half full.
class CellTable {
public:
    static constexpr std::uint32_t kNone = 0xffffffffu;

    void reserve(std::size_t count)
    {
        const std::size_t size = std::bit_ceil(2 * count + 2);
        if (size <= slots_.size()) return;
        const std::vector<Slot> old = std::exchange(slots_, std::vector<Slot>(size));
        for (const Slot& slot : old)
            if (slot.number != kNone) place(slot);
    }

    /// @param key  not in the table yet
    void insert(std::uint64_t key, std::uint32_t number)
    {
        reserve(++size_);
        place({key, number});
    }

    std::size_t size() const { return size_; }

    std::uint32_t find(std::uint64_t key) const
    {
        const std::size_t mask = slots_.size() - 1;
        for (std::size_t i = mix64(key) & mask;; i = (i + 1) & mask) {
            const Slot& slot = slots_[i];
            if (slot.number == kNone || slot.key == key) return slot.number;
        }
    }

    /// Asks for the memory that find() will read.
    void prefetch(std::uint64_t key) const { __builtin_prefetch(&slots_[mix64(key) & (slots_.size() - 1)]); }

    /// The number of a key; one that is not in the table yet gets `next`.
    std::uint32_t find_or_insert(std::uint64_t key, std::uint32_t next)
    {
        const std::uint32_t number = find(key);
        if (number != kNone) return number;
        insert(key, next);
        return next;
    }

    std::size_t bytes() const { return slots_.size() * sizeof(Slot); }

private:
    struct Slot {
        std::uint64_t key = 0;
        std::uint32_t number = kNone;
    };

    void place(const Slot& slot)
    {
        std::size_t i = mix64(slot.key);
        while (slots_[i & (slots_.size() - 1)].number != kNone) ++i;
        slots_[i & (slots_.size() - 1)] = slot;
    }

    std::size_t size_ = 0;
    std::vector<Slot> slots_{2};
};

}  // namespace rcs
