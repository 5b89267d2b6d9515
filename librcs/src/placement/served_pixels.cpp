#include "placement/served_pixels.h"

#include <algorithm>
#include <cstdint>

#include "splat/gpu_records.h"

namespace rcs {

ServedPixels::ServedPixels(const TiledSurfaces& surfaces, const View& view, float error_tolerance, ThreadPool& pool)
    : surfaces_(surfaces),
      view_(view),
      reach_{error_tolerance, 1.0f},
      pool_(pool),
      weight_(static_cast<std::size_t>(surfaces.width) * static_cast<std::size_t>(surfaces.height), 0.0f)
{
}

void ServedPixels::look_at(std::size_t k, const Record& record)
{
    records_[k] = make_gpu_record(record, surfaces_.camera_position, view_, reach_);
    radius_[k] = influence_radius(record, reach_.overlap);
}

void ServedPixels::add(std::span<const Record> records)
{
    const std::size_t known = records_.size();
    records_.resize(records.size());
    radius_.resize(records.size());
    pool_.parallel_for(records.size() - known, 1024, [&](std::size_t begin, std::size_t end, int) {
        for (std::size_t k = known + begin; k < known + end; ++k) look_at(k, records[k]);
    });
    add_weights(std::span(records_).subspan(known), surfaces_, surfaces_.rows, pool_, weight_);
}

void ServedPixels::follow(std::span<const Record> records)
{
    constexpr std::size_t kPart = 2048;
    std::vector<std::vector<std::uint32_t>> parts((records_.size() + kPart - 1) / kPart);
    pool_.parallel_for(records_.size(), kPart, [&](std::size_t begin, std::size_t end, int) {
        for (std::size_t k = begin; k < end; ++k)
            if (influence_radius(records[k], reach_.overlap) != radius_[k])
                parts[begin / kPart].push_back(static_cast<std::uint32_t>(k));
    });
    std::vector<std::uint16_t> rows(surfaces_.rows.size(), 0);
    bool any = false;
    const auto add_rows_of_changed = [&] {
        for (const std::vector<std::uint32_t>& changed : parts)
            for (const std::uint32_t k : changed) add_rows(records_[k], surfaces_, rows), any = true;
    };
    add_rows_of_changed();
    if (!any) return;
    pool_.parallel_for(parts.size(), 1, [&](std::size_t part, std::size_t, int) {
        for (const std::uint32_t k : parts[part]) look_at(k, records[k]);
    });
    add_rows_of_changed();
    clear_rows(surfaces_, rows, weight_);
    add_weights(records_, surfaces_, rows, pool_, weight_);
}

}  // namespace rcs
