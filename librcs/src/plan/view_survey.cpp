#include "plan/view_survey.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

#include "rays/ray_scene_impl.h"
#include "rays/surface.h"
#include "util/text.h"

namespace rcs {
namespace {

constexpr int kPilotSide = 32;
constexpr int kMostLayers = 16;  // as render() peels

/// Rays for what the pilot has not met: so many, and so many for each sample of the picture.
constexpr double kLeastRays = 16384.0, kRaysPerSample = 1.0 / 256.0;

struct Rectangle {
    double x0 = std::numeric_limits<double>::infinity(), y0 = x0, x1 = -x0, y1 = -x0;  // [px]

    bool empty() const { return !(x0 < x1 && y0 < y1); }
    void add(double x, double y)
    {
        x0 = std::min(x0, x);
        y0 = std::min(y0, y);
        x1 = std::max(x1, x);
        y1 = std::max(y1, y);
    }
    void add(const Rectangle& other)
    {
        if (other.empty()) return;
        add(other.x0, other.y0);
        add(other.x1, other.y1);
    }
};

/// Part of the image that an instance's bounds can cover; empty outside the view. Corners behind the camera's plane
/// make it the whole image.
Rectangle covered_part(const View& view, const glm::dmat4& view_from_object, const Bounds& bounds)
{
    if (!(bounds.min.x <= bounds.max.x)) return {};
    const bool perspective = view.camera.projection == Projection::perspective;
    const ImagePlane plane = image_plane(view);
    Rectangle part;
    int behind = 0;
    for (int corner = 0; corner < 8; ++corner) {
        const glm::dvec3 p(view_from_object * glm::dvec4((corner & 1) != 0 ? bounds.max.x : bounds.min.x,
                                                         (corner & 2) != 0 ? bounds.max.y : bounds.min.y,
                                                         (corner & 4) != 0 ? bounds.max.z : bounds.min.z, 1.0));
        if (!(p.z < -1e-12 * glm::length(p))) {
            ++behind;
            continue;
        }
        const double pixel = perspective ? plane.pixel * -p.z : plane.pixel;
        part.add(plane.axis.x + p.x / pixel, plane.axis.y - p.y / pixel);
    }
    if (behind == 8) return {};
    const double width = view.width, height = view.height;
    if (behind > 0) return {0.0, 0.0, width, height};
    // A pixel's breadth covers all samples of its passes, and the rounding of corners.
    part = {std::max(0.0, std::floor(part.x0) - 1.0), std::max(0.0, std::floor(part.y0) - 1.0),
            std::min(width, std::ceil(part.x1) + 1.0), std::min(height, std::ceil(part.y1) + 1.0)};
    return part.empty() ? Rectangle{} : part;
}

class Surveyor {
public:
    Surveyor(const RayScene& rays, const std::vector<View>& views) : rays_(rays), views_(views)
    {
        const std::vector<Instance>& instances = rays.scene().instances;
        parts_.resize(instances.size());
        for (const View& view : views) {
            if (&view != views.data() && view.camera == views[0].camera) continue;
            const glm::dmat4 view_from_world = glm::inverse(view.camera.world_from_view);
            for (std::size_t i = 0; i < instances.size(); ++i) {
                const std::size_t mesh = static_cast<std::size_t>(instances[i].mesh);
                parts_[i].add(
                    covered_part(view, view_from_world * instances[i].world_from_object, rays.impl().bounds[mesh]));
            }
        }
    }

    Survey run();

private:
    std::uint32_t bits_of(std::size_t instance) const
    {
        return rays_.impl().traits[static_cast<std::size_t>(rays_.scene().instances[instance].mesh)].bits;
    }
    /// Traits of all that a sample meets, behind what it sees through. @param sky  set if it ends there
    std::uint32_t look(const CameraRay& ray, bool& sky);
    void run_pilot(Survey& result);
    void settle(Survey& result);

    const RayScene& rays_;
    const std::vector<View>& views_;
    std::vector<Rectangle> parts_;  // per instance
    std::uint64_t ray_count_ = 0;
};

std::uint32_t Surveyor::look(const CameraRay& ray, bool& sky)
{
    std::uint32_t bits = 0;
    float after = 0.0f;
    for (int layer = 0; layer < kMostLayers; ++layer) {
        ++ray_count_;
        const std::optional<Hit> hit = find_visible(rays_, ray, after);
        sky = !hit;
        if (!hit) return bits;
        const std::uint32_t here = bits_of(hit->instance);
        bits |= here;
        if ((here & kSeeThrough) == 0u) return bits;
        after = hit->t;
    }
    return bits;
}

void Surveyor::run_pilot(Survey& result)
{
    // An even grid, moved by the R2 sequence within its cells so that no row of texels or tiles is met alike.
    const View& view = views_[0];
    std::array<int, kTraits> met{};
    int skies = 0;
    const auto wrap = [](double x) { return x - std::floor(x); };
    for (int i = 0; i < kPilotSide * kPilotSide; ++i) {
        const double x = (i % kPilotSide + wrap(0.7548776662466927 * i)) / kPilotSide;
        const double y = (i / kPilotSide + wrap(0.5698402909980532 * i)) / kPilotSide;
        bool sky = false;
        const std::uint32_t bits = look(camera_ray(view, x * view.width, y * view.height), sky);
        skies += sky ? 1 : 0;
        for (std::size_t bit = 0; bit < kTraits; ++bit) met[bit] += (bits >> bit & 1u) != 0u ? 1 : 0;
    }
    constexpr double n = kPilotSide * kPilotSide;
    result.sky_share = skies / n;
    for (std::size_t bit = 0; bit < kTraits; ++bit) {
        Sighting& s = result.of[bit];
        if (!s.possible()) continue;
        // Wilson's interval: right also near 0 and 1.
        constexpr double z2 = 1.96 * 1.96;
        const double share = met[bit] / n, centre = (share + 0.5 * z2 / n) / (1.0 + z2 / n);
        const double half = 1.96 * std::sqrt(share * (1.0 - share) / n + 0.25 * z2 / (n * n)) / (1.0 + z2 / n);
        s.share = share;
        s.low = std::max(0.0, centre - half);
        s.high = std::min(1.0, centre + half);
        s.samples = static_cast<std::uint64_t>(n);
        if (met[bit] > 0) s.how = Sighting::How::seen;
    }
}

/// Looks along the picture's own samples for what may be there and was not met.
void Surveyor::settle(Survey& result)
{
    const double samples = static_cast<double>(views_[0].width) * views_[0].height * static_cast<double>(views_.size());
    const std::uint64_t most = ray_count_ + static_cast<std::uint64_t>(kLeastRays + kRaysPerSample * samples);
    std::uint32_t wanted = 0;
    for (std::size_t bit = 0; bit < kTraits; ++bit)
        if (result.of[bit].how == Sighting::How::unsettled) wanted |= 1u << bit;
    std::array<std::uint64_t, kTraits> looked{};
    const auto note = [&](std::uint32_t bits) {
        for (std::size_t bit = 0; bit < kTraits; ++bit)
            if ((bits & wanted) >> bit & 1u) result.of[bit].how = Sighting::How::seen;
        wanted &= ~bits;
    };
    bool complete = true;
    for (std::size_t i = 0; i < parts_.size() && wanted != 0u; ++i) {
        if (parts_[i].empty() || (bits_of(i) & wanted) == 0u) continue;
        const int x0 = static_cast<int>(parts_[i].x0), y0 = static_cast<int>(parts_[i].y0);
        const int width = static_cast<int>(parts_[i].x1) - x0, height = static_cast<int>(parts_[i].y1) - y0;
        const std::uint64_t count = static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height);
        // A stride that shares no factor with the number of pixels: all of them, early ones spread over the rectangle.
        std::uint64_t stride = static_cast<std::uint64_t>(0.6180339887498949 * static_cast<double>(count)) | 1u;
        while (std::gcd(stride, count) != 1u) stride += 2;
        for (const View& view : views_) {
            std::uint64_t at = 0;
            for (std::uint64_t n = 0; n < count && (bits_of(i) & wanted) != 0u; ++n, at = (at + stride) % count) {
                if (ray_count_ >= most) {
                    complete = false;
                    break;
                }
                const double x = x0 + static_cast<double>(at % static_cast<std::uint64_t>(width)) + view.pixel_offset.x;
                const double y = y0 + static_cast<double>(at / static_cast<std::uint64_t>(width)) + view.pixel_offset.y;
                for (std::size_t bit = 0; bit < kTraits; ++bit) looked[bit] += (bits_of(i) & wanted) >> bit & 1u;
                bool sky = false;
                note(look(camera_ray(view, x, y), sky));
            }
        }
    }
    for (std::size_t bit = 0; bit < kTraits; ++bit) {
        Sighting& s = result.of[bit];
        if ((wanted >> bit & 1u) == 0u) continue;
        s.samples += looked[bit];
        if (complete) {
            s.how = Sighting::How::hidden;
            s.share = s.low = s.high = 0.0;
        }
    }
}

Survey Surveyor::run()
{
    Survey result;
    for (std::size_t i = 0; i < parts_.size(); ++i) {
        const bool in_view = !parts_[i].empty();
        result.any_in_view = result.any_in_view || in_view;
        for (std::size_t bit = 0; bit < kTraits; ++bit) {
            Sighting& s = result.of[bit];
            if ((bits_of(i) >> bit & 1u) == 0u) continue;
            s.how = std::max(s.how, in_view ? Sighting::How::unsettled : Sighting::How::outside);
        }
    }
    run_pilot(result);
    settle(result);
    result.rays = ray_count_;
    return result;
}

}  // namespace

std::string words(const Sighting& s, const char* what)
{
    switch (s.how) {
        case Sighting::How::nowhere:
            return text("the scene has no %s", what);
        case Sighting::How::outside:
            return text("no %s lies in the view", what);
        case Sighting::How::hidden:
            return text("none of the picture's samples meets a %s (%llu looked)", what,
                        static_cast<unsigned long long>(s.samples));
        case Sighting::How::unsettled:
            return text("a %s may be seen: %llu samples did not meet it and do not rule it out", what,
                        static_cast<unsigned long long>(s.samples));
        case Sighting::How::seen:
            break;
    }
    if (s.share == 0.0) return text("a sample of the picture meets a %s", what);
    return text("%.3g %% of the picture shows a %s", 100.0 * s.share, what);
}

const Sighting& Survey::operator[](Trait trait) const
{
    return of[static_cast<std::size_t>(std::countr_zero(static_cast<std::uint32_t>(trait)))];
}

Survey survey(const RayScene& rays, const std::vector<View>& views) { return Surveyor(rays, views).run(); }

}  // namespace rcs
