#include "placement/view_fit.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <optional>
#include <utility>

#include "gbuffer/views.h"
#include "records/known_record.h"

namespace rcs {
namespace {

// A visible point this near is on the record's surface [footprints]: the next sample lies within that on all but
// grazing ones.
constexpr float kNear = 2.0f;
// A record's footprint differs from the pixel's by so many times at the most: it keeps its reach while the camera moves
// a little, and follows by little steps as it goes on, so that what it shows does not flicker (measured:
// docs/method.md, Views to come). In pictures of another size, and from a file, it has to fit, but for what samples of
// a pixel differ by: without that, a picture from its own records' file finds more holes.
constexpr float kSame = 1.25f, kSameInOtherPicture = 1.1f;
// Footprints of a surface that faces the viewer; of one that does not they are larger, here by as much at the most.
constexpr double kOblique = 2.0;

}  // namespace

double reach_in_pixels(const View& view, const Record& record, double length)
{
    const double pixel = image_plane(view).pixel;
    const bool perspective = view.camera.projection == Projection::perspective;
    const double distance = glm::length(glm::dvec3(record.position) - camera_position(view.camera));
    return length / std::min(static_cast<double>(record.footprint), perspective ? pixel * distance : pixel);
}

namespace {

/// Where what records' splats cover shows, and so do their neighbours'.
class ReachInImage {
public:
    explicit ReachInImage(const View& view) : view_(view), projection_(view), eye_(camera_position(view.camera)) {}

    /// @param shows  of the corners of a box in the image [px], whether anything that counts lies there
    template <typename Shows>
    bool is_near(const Record& r, const Shows& shows) const
    {
        // The widest overlap, and a little more.
        constexpr float kReach = 4.0f;
        const glm::dvec3 relative = glm::dvec3(r.position) - eye_;
        const auto reach = static_cast<double>(kReach * r.spacing_radius);
        const std::optional<glm::dvec2> at = projection_.position(relative);
        if (!at) return glm::length(relative) <= reach;
        const glm::dvec2 pixels(1.0 + reach_in_pixels(view_, r, reach));
        return shows(*at - pixels, *at + pixels);
    }

private:
    const View& view_;
    ImageProjection projection_;
    glm::dvec3 eye_;
};

/// In which squares of the image something is seen.
class CoveredSquares {
public:
    explicit CoveredSquares(const GBuffer& g)
        : columns_((g.width + kSide - 1) / kSide),
          rows_((g.height + kSide - 1) / kSide),
          before_(static_cast<std::size_t>((columns_ + 1) * (rows_ + 1)), 0)
    {
        for (std::size_t i = 0; i < g.size(); ++i) {
            const auto width = static_cast<std::size_t>(g.width);
            if (g.covered(i))
                before(static_cast<int>(i % width) / kSide + 1, static_cast<int>(i / width) / kSide + 1) = 1;
        }
        for (int y = 1; y <= rows_; ++y)
            for (int x = 1; x <= columns_; ++x)
                before(x, y) += before(x - 1, y) + before(x, y - 1) - before(x - 1, y - 1);
    }
    bool any(glm::dvec2 low, glm::dvec2 high) const
    {
        if (!(low.x <= high.x && low.y <= high.y)) return true;  // they are not numbers
        const glm::dvec2 end(columns_, rows_);
        const glm::ivec2 first(glm::clamp(glm::floor(low / double{kSide}), glm::dvec2(0.0), end));
        const glm::ivec2 last(glm::clamp(glm::floor(high / double{kSide}) + 1.0, glm::dvec2(0.0), end));
        if (!(first.x < last.x && first.y < last.y)) return false;
        return before(last.x, last.y) - before(first.x, last.y) - before(last.x, first.y) + before(first.x, first.y) >
               0;
    }

private:
    static constexpr int kSide = 8;  // [px]

    int& before(int x, int y) { return before_[static_cast<std::size_t>(y * (columns_ + 1) + x)]; }
    int before(int x, int y) const { return before_[static_cast<std::size_t>(y * (columns_ + 1) + x)]; }

    int columns_, rows_;
    std::vector<int> before_;  // squares in which something is seen, of those to the left and above
};

}  // namespace

std::vector<Record> take_unseen(const View& view, std::vector<Record>& records)
{
    const ReachInImage reach(view);
    const auto is_in_view = [&](glm::dvec2 low, glm::dvec2 high) {
        return high.x >= 0.0 && high.y >= 0.0 && low.x <= view.width && low.y <= view.height;
    };
    const auto unseen = std::stable_partition(records.begin(), records.end(),
                                              [&](const Record& r) { return reach.is_near(r, is_in_view); });
    std::vector<Record> taken(std::make_move_iterator(unseen), std::make_move_iterator(records.end()));
    records.erase(unseen, records.end());
    return taken;
}

TakenOut take_elsewhere(const GBuffer& g, const View& view, ThreadPool& pool, std::vector<Record>& records)
{
    const ReachInImage reach(view);
    const CoveredSquares covered(g);
    TakenOut taken{{}, std::vector<std::uint8_t>(records.size(), 0)};
    pool.parallel_for(records.size(), 1024, [&](std::size_t begin, std::size_t end, int) {
        for (std::size_t k = begin; k < end; ++k)
            taken.is_left[k] =
                reach.is_near(records[k], [&](glm::dvec2 low, glm::dvec2 high) { return covered.any(low, high); });
    });
    std::vector<Record> left;
    for (std::size_t k = 0; k < records.size(); ++k)
        (taken.is_left[k] != 0 ? left : taken.records).push_back(std::move(records[k]));
    records = std::move(left);
    return taken;
}

void put_between(TakenOut taken, std::vector<Record>& records)
{
    std::vector<Record> all;
    all.reserve(records.size() + taken.records.size());
    auto left = records.begin(), elsewhere = taken.records.begin();
    for (const std::uint8_t is_left : taken.is_left) all.push_back(std::move(is_left != 0 ? *left++ : *elsewhere++));
    std::move(left, records.end(), std::back_inserter(all));
    records = std::move(all);
}

namespace {

/// The pixel that shows a record's place; none where nothing, or something else, is seen there.
std::optional<std::size_t> pixel_of(const GBuffer& gbuffer, const View& view, const ImageProjection& projection,
                                    const Record& record)
{
    const glm::dvec3 relative = glm::dvec3(record.position) - gbuffer.camera_position;
    const std::optional<std::size_t> i = pixel_at(view, projection, relative);
    if (!i || !gbuffer.covered(*i)) return std::nullopt;
    const bool is_near = glm::distance(glm::vec3(relative), gbuffer.position(*i)) <= kNear * gbuffer.footprint[*i];
    return is_near ? i : std::nullopt;
}

}  // namespace

void fit_to_view(const GBuffer& gbuffer, const View& view, bool of_such_pictures, std::span<Record> records)
{
    const float same = of_such_pictures ? kSame : kSameInOtherPicture;
    const bool perspective = view.camera.projection == Projection::perspective;
    const double pixel = image_plane(view).pixel;
    const ImageProjection projection(view);
    for (Record& r : records) {
        if (const std::optional<std::size_t> i = pixel_of(gbuffer, view, projection, r)) {
            const float now = gbuffer.footprint[*i];
            r.footprint = std::clamp(r.footprint, now / same, now * same);
            continue;
        }
        const double distance = glm::length(glm::dvec3(r.position) - gbuffer.camera_position);
        const double facing = perspective ? pixel * std::max(distance, static_cast<double>(r.footprint)) : pixel;
        r.footprint = std::min(r.footprint, static_cast<float>(kOblique * facing));
    }
}

std::vector<std::uint32_t> bring_seen_last(const GBuffer& gbuffer, const View& view, bool with_radiance,
                                           std::vector<Record>& records)
{
    std::vector<std::uint32_t> pixels;
    const ImageProjection projection(view);
    std::vector<Record> seen;
    std::size_t others = 0;
    for (std::size_t k = 0; k < records.size(); ++k) {
        Record& r = records[k];
        const std::optional<std::size_t> i = pixel_of(gbuffer, view, projection, r);
        if (i && is_born(r) && r.radiance.empty() != with_radiance) {
            pixels.push_back(static_cast<std::uint32_t>(*i));
            seen.push_back(std::move(r));
        } else {
            if (others != k) records[others] = std::move(r);
            ++others;
        }
    }
    records.resize(others);
    records.insert(records.end(), std::make_move_iterator(seen.begin()), std::make_move_iterator(seen.end()));
    return pixels;
}

}  // namespace rcs
