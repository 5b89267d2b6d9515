#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "rcs/records.h"
#include "splat/tiles.h"

namespace rcs {

/// Which pixels records serve: those within the spacing radius of one. Kept as records come and as others reach less
/// far.
class ServedPixels {
public:
    /// Keeps references. @param error_tolerance  Ward's a
    ServedPixels(const TiledSurfaces& surfaces, const View& view, float error_tolerance, ThreadPool& pool);

    /// Takes in records behind those that it knows.
    void add(std::span<const Record> records);
    /// Looks anew where records that it knows reach another way than they did.
    void follow(std::span<const Record> records);

    /// Per pixel, > 0 where one serves.
    const std::vector<float>& weight() const { return weight_; }

private:
    /// Notes where the record reaches now.
    void look_at(std::size_t k, const Record& record);

    const TiledSurfaces& surfaces_;
    const View& view_;
    SplatSettings reach_;
    ThreadPool& pool_;
    std::vector<gpu::GpuRecord> records_;
    std::vector<float> radius_;  // per record, as records_ say
    std::vector<float> weight_;
};

}  // namespace rcs
