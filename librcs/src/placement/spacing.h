#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "rcs/records.h"

namespace rcs {

/// Trusts the translation gradients of records whose spacing is set by no more than they allow now: later rays may have
/// found light much steeper than the first, as where one of them met a wall a hair's breadth away.
void trust_gradients(std::span<Record> records, const RecordSettings& options);

/// limit_spacing() for a set of records that only grows: what neighbours allow is kept from call to call.
class SpacingLimiter {
public:
    explicit SpacingLimiter(const RecordSettings& options);
    ~SpacingLimiter();

    /// Limits the records from `first` on by all there are; those before only if `first` is 0.
    /// @param records  those of the last call, unchanged but for what this sets, and new ones behind them
    void limit(std::vector<Record>& records, std::size_t first, ThreadPool& pool);

private:
    struct Trees;
    struct Known;

    /// Limits records that lie near each other by all that they have not seen yet.
    void limit_some(std::vector<Record>& records, std::span<const std::uint32_t> which);

    RecordSettings options_;
    std::unique_ptr<Trees> trees_;
    std::vector<std::uint32_t> order_;  // of the records, neighbours in space together, each call's for itself
    std::vector<Known> known_;          // per record
};

}  // namespace rcs
