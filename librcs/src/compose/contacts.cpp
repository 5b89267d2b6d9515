#include "compose/contacts.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <span>
#include <utility>

#include "accuracy/error_estimate.h"
#include "gbuffer/views.h"
#include "splat/mean_of.h"
#include "util/color.h"

namespace rcs {
namespace {

// Those around a pixel whose errors say how far to trust its records [px], on surfaces that lie like its own.
constexpr int kAround = 4;
constexpr float kAlike = 0.9f;      // cosine
constexpr float kSamePlane = 0.5f;  // sine of the angle that they rise by
// So many footprints from a pixel a gather is its own where records are right, and where they are off or nobody knows:
// there light may be steep, and a gap that is narrower than a pixel is dark where its edge is bright.
constexpr float kSamePlace = 0.5f, kSamePlaceOff = 0.33f;
constexpr float kSameNormal = 0.98f;  // cosine
// Rounds of more rays, for those that are too noisy.
constexpr int kRounds = 2;
// What records may be off by, relative to their light: where they are about right nothing is to change, since what a
// pixel finds by itself is noisier.
constexpr float kAllowed = 0.1f;
// Times that and noise together, squared, a difference may be by chance: of many gathers, and of each by itself.
constexpr float kSurely = 4.0f, kLikely = 1.0f;
// Of a colour, relative to luminance: less tells nothing of by how much it is off.
constexpr float kDarkest = 1e-3f;
// Relative to the picture's mean light: what is darker need not be known as well.
constexpr float kDarkLight = 0.02f;

constexpr std::uint32_t kNone = ~0u;

/// What is known of contacts by the pixels that show their places.
class KnownPlaces {
public:
    /// @param stale  those that know another state of the scene, too
    KnownPlaces(const ContactPixels& at, std::span<const Record> known, bool stale = false)
        : gbuffer_(at.gbuffer), known_(known), first_(at.gbuffer.size(), kNone), next_(known.size(), kNone)
    {
        const ImageProjection projection(at.view);
        for (std::size_t k = known.size(); k-- > 0;) {
            if (!stale && known[k].watch.state != at.scene) continue;
            const auto pixel = pixel_at(at.view, projection, glm::dvec3(known[k].position) - gbuffer_.camera_position);
            if (!pixel) continue;
            next_[k] = std::exchange(first_[*pixel], static_cast<std::uint32_t>(k));
        }
    }

    /// The gather nearest to where a pixel is, of those that hold there; kNone: there is none.
    std::uint32_t at(std::size_t pixel) const
    {
        const glm::vec3 p = gbuffer_.position(pixel), n = gbuffer_.normal(pixel);
        float nearest = std::numeric_limits<float>::infinity();
        std::uint32_t found = kNone;
        for_each_around(gbuffer_, pixel, 1, [&](std::size_t j, int, int) {
            for (std::uint32_t k = first_[j]; k != kNone; k = next_[k]) {
                const auto place = glm::vec3(glm::dvec3(known_[k].position) - gbuffer_.camera_position);
                const float distance = glm::distance(place, p);
                const float holds = gbuffer_.footprint[pixel] * (is_sure(known_[k]) ? kSamePlace : kSamePlaceOff);
                if (!(distance < std::min(nearest, holds) && glm::dot(known_[k].normal, n) > kSameNormal)) continue;
                nearest = distance;
                found = k;
            }
        });
        return found;
    }

private:
    /// Whether records are right there.
    static bool is_sure(const Record& known) { return known.watch.is_shown && !known.watch.records_off; }

    const GBuffer& gbuffer_;
    std::span<const Record> known_;
    std::vector<std::uint32_t> first_, next_;  // per pixel, per gather: the next one there
};

/// What a pixel's own gather found, and the records say.
struct Contact {
    std::uint32_t pixel;
    glm::ivec2 to;
    glm::vec3 recorded;   // without gathered lamps [W m^-2]
    std::uint32_t known;  // number of its gather
    glm::vec3 own{0.0f};  // as recorded [W m^-2]
    float error = 0.0f;   // standard one of `own`, on luminance
    float usual = 0.0f;   // the same as gathers of so many rays have it in the mean, relative to their light

    /// Squared standard error of its gather if there is so much light: one that happened to meet little says that it
    /// has little noise.
    float variance(float light) const
    {
        const float noise = std::max(error, usual * light);
        return noise * noise;
    }
};

std::vector<Contact> find_contacts(const ContactPixels& at, std::span<const Record> known, const SplatBuffer& of_lamps,
                                   const SplatBuffer& all)
{
    const KnownPlaces places(at, known);
    std::vector<Contact> contacts;
    for (const auto& [pixel, to] : at.pixels) {
        const std::uint32_t own = all.weight[pixel] > 0.0f ? places.at(pixel) : kNone;
        if (own == kNone) continue;
        const bool has_lamps = of_lamps.width > 0 && of_lamps.weight[pixel] > 0.0f;
        const glm::vec3 lamps = has_lamps ? mean_of(of_lamps, pixel) : glm::vec3(0.0f);
        contacts.push_back({pixel, to, glm::max(mean_of(all, pixel) - lamps, 0.0f), own});
    }
    return contacts;
}

/// Takes what is known for what they found.
void hear(std::span<const Record> known, std::span<Contact> contacts)
{
    double noise = 0.0;  // of one ray, relative
    std::size_t lit = 0;
    for (Contact& c : contacts) {
        const Record& r = known[c.known];
        c.own = glm::max(r.irradiance - r.of_lamps, 0.0f);
        c.error = std::min(r.noise * luminance(r.irradiance), luminance(c.own));  // some of it may be lamps'
        c.usual = 1.0f / std::sqrt(static_cast<float>(r.rays));
        if (!(luminance(c.own) > 0.0f)) continue;
        noise += static_cast<double>(c.error / (luminance(c.own) * c.usual));
        ++lit;
    }
    const float usual = lit > 0 ? static_cast<float>(noise / static_cast<double>(lit)) : 0.0f;
    for (Contact& c : contacts) c.usual *= usual;
}

/// What records may be off by, squared.
float allowed2(float light) { return kAllowed * kAllowed * light * light; }

/// Which contact each pixel is.
std::vector<std::uint32_t> numbers_of(const GBuffer& gbuffer, std::span<const Contact> contacts)
{
    std::vector<std::uint32_t> numbers(gbuffer.size(), kNone);
    for (std::size_t k = 0; k < contacts.size(); ++k) numbers[contacts[k].pixel] = static_cast<std::uint32_t>(k);
    return numbers;
}

/// Whether another contact, of a pixel close by, lies as one does.
bool lie_alike(const GBuffer& g, const Contact& own, const Contact& other)
{
    if (pixels_away(other.to) != pixels_away(own.to) || glm::dot(glm::vec2(other.to), glm::vec2(own.to)) < 0.0f)
        return false;
    const glm::vec3 apart = g.position(other.pixel) - g.position(own.pixel);
    const float height = glm::dot(apart, g.geometric_normal[own.pixel]);
    return glm::dot(g.normal(own.pixel), g.normal(other.pixel)) > kAlike &&
           height * height <= kSamePlane * kSamePlane * glm::dot(apart, apart);
}

/// The contacts around each, itself too, that lie as it does.
class AlikeContacts {
public:
    AlikeContacts(const GBuffer& g, std::span<const Contact> contacts, ThreadPool& pool)
        : begin_(contacts.size()), parts_((contacts.size() + kPart - 1) / kPart)
    {
        const std::vector<std::uint32_t> numbers = numbers_of(g, contacts);
        pool.parallel_for(parts_.size(), 1, [&](std::size_t first, std::size_t last, int) {
            for (std::size_t k = first * kPart; k < std::min(contacts.size(), last * kPart); ++k) {
                std::vector<std::uint32_t>& found = parts_[k / kPart];
                begin_[k] = static_cast<std::uint32_t>(found.size());
                for_each_around(g, contacts[k].pixel, kAround, [&](std::size_t j, int, int) {
                    if (numbers[j] != kNone && lie_alike(g, contacts[k], contacts[numbers[j]]))
                        found.push_back(numbers[j]);
                });
            }
        });
    }

    std::span<const std::uint32_t> of(std::size_t k) const
    {
        const std::span<const std::uint32_t> part = parts_[k / kPart];
        const bool is_last = (k + 1) % kPart == 0 || k + 1 == begin_.size();
        return part.subspan(begin_[k], (is_last ? part.size() : begin_[k + 1]) - begin_[k]);
    }

private:
    static constexpr std::size_t kPart = 256;  // contacts that share a list

    std::vector<std::uint32_t> begin_;  // per contact, in the list of its part
    std::vector<std::vector<std::uint32_t>> parts_;
};

/// What the records say, times by how much those around are off: the noise of one gather is spread along the contact.
glm::vec3 expected_light(std::span<const Contact> contacts, std::span<const std::uint32_t> alike, const Contact& own)
{
    glm::vec3 recorded(0.0f), found(0.0f);
    float as_recorded = 0.0f, as_found = 0.0f;  // variances
    for (const std::uint32_t k : alike) {
        const Contact& c = contacts[k];
        recorded += c.recorded;
        found += c.own;
        as_recorded += c.variance(luminance(c.recorded));
        as_found += c.variance(luminance(c.own));
    }
    const float off = luminance(found) - luminance(recorded), off2 = off * off;
    const bool are_off = off2 > kSurely * (as_recorded + allowed2(luminance(recorded)));
    const float sure = are_off ? std::max(0.0f, 1.0f - (as_found + allowed2(luminance(found))) / off2) : 0.0f;
    const glm::vec3 factor = (found + kDarkest * luminance(recorded)) / (recorded + kDarkest * luminance(recorded));
    return luminance(recorded) > 0.0f ? own.recorded * glm::mix(glm::vec3(1.0f), factor, sure)
                                      : glm::mix(own.recorded, own.own, sure);
}

/// Light of a contact as far as it is known, and the noise that is left in it.
struct Agreed {
    glm::vec3 light;
    float error;  ///< standard one, on luminance
    bool is_off;  ///< the records are, there or around
};

/// Of each contact what is expected there, and its own gather, by how much those around differ from what was expected
/// there beyond their noise. Along a rim, a spot brighter than all that around found, and than is expected, is chance.
std::vector<Agreed> agree(std::span<const Contact> contacts, const AlikeContacts& alike, ThreadPool& pool)
{
    std::vector<glm::vec3> expected(contacts.size());
    pool.parallel_for(contacts.size(), 64, [&](std::size_t begin, std::size_t end, int) {
        for (std::size_t k = begin; k < end; ++k) expected[k] = expected_light(contacts, alike.of(k), contacts[k]);
    });
    std::vector<Agreed> agreed(contacts.size());
    pool.parallel_for(contacts.size(), 64, [&](std::size_t begin, std::size_t end, int) {
        for (std::size_t k = begin; k < end; ++k) {
            float off2 = 0.0f, noise2 = 0.0f, count = 0.0f, most = luminance(expected[k]);
            for (const std::uint32_t j : alike.of(k)) {
                const float off = luminance(contacts[j].own) - luminance(expected[j]);
                off2 += off * off;
                noise2 += contacts[j].variance(luminance(expected[j]));
                count += 1.0f;
                if (j != k) most = std::max(most, luminance(contacts[j].own));
            }
            const float least = noise2 + count * allowed2(luminance(expected[k]));
            const bool is_alone = contacts[k].to == glm::ivec2(0);
            const float belief = off2 > (is_alone ? kSurely : kLikely) * least ? 1.0f - least / off2 : 0.0f;
            const float error = std::sqrt(noise2 / count * (belief * belief + (1.0f - belief * belief) / count));
            glm::vec3 light = glm::mix(expected[k], contacts[k].own, belief);
            if (!is_alone && luminance(light) > most) light *= most / luminance(light);
            agreed[k] = {light, error, belief > 0.0f || expected[k] != contacts[k].recorded};
        }
    });
    return agreed;
}

std::uint64_t all_rays(const RecordStats& stats) { return stats.hemisphere_rays + stats.shadow_rays + stats.looks; }

/// Contacts and what was agreed on of each.
struct Heard {
    std::span<const Contact> contacts;
    std::span<const Agreed> agreed;
    float dark;  ///< light that need not be known better [W m^-2]
};

/// New ones that are too noisy gather more, as much as that takes. @return rays
std::uint64_t gather_noisy(const RecordGatherer& gatherer, const GBuffer& gbuffer, const Heard& heard,
                           const ContactSettings& settings, ThreadPool& pool, std::vector<Record>& known,
                           const std::function<void(float)>& report)
{
    std::vector<std::uint32_t> pixels(known.size(), 0);
    std::vector<int> extra(known.size(), 0);
    for (std::size_t k = 0; k < heard.contacts.size(); ++k) {
        const Contact& c = heard.contacts[k];
        const Record& r = known[c.known];
        if (r.watch.is_shown) continue;
        const float allowed = settings.noise * (luminance(heard.agreed[k].light) + heard.dark);
        const float times = heard.agreed[k].error / allowed;
        if (!(times > 1.0f)) continue;
        const float rays = std::min(static_cast<float>(r.rays) * times * times, static_cast<float>(settings.most_rays));
        const int missing = static_cast<int>(rays) - r.rays;
        if (missing <= 0) continue;
        pixels[c.known] = c.pixel;
        extra[c.known] = std::max(extra[c.known], (missing + gatherer.rays() - 1) / gatherer.rays());
    }
    RecordStats stats;
    gatherer.gather_more(gbuffer, pixels, extra, known, pool, stats, report);
    return all_rays(stats);
}

/// Puts the light that was agreed on in the place of what the records say. Lobes see as much less as the surface does.
void put(const Contact& c, const Agreed& agreed, const SplatBuffer& of_lamps, SplatBuffer& all)
{
    const std::size_t i = c.pixel;
    const float weight = all.weight[i];
    const auto change = [&](std::vector<float> SplatBuffer::* channel, std::vector<float> SplatBuffer::* glossy,
                            int color) {
        const float more = agreed.light[color] - c.recorded[color];
        (all.*channel)[i] = std::max(0.0f, (all.*channel)[i] + weight * more);
        if (all.glossy_r.empty() || !(more < 0.0f)) return;
        const float lamps = of_lamps.glossy_r.empty() ? 0.0f : (of_lamps.*glossy)[i];
        (all.*glossy)[i] = lamps + ((all.*glossy)[i] - lamps) * agreed.light[color] / c.recorded[color];
    };
    change(&SplatBuffer::weighted_r, &SplatBuffer::glossy_r, 0);
    change(&SplatBuffer::weighted_g, &SplatBuffer::glossy_g, 1);
    change(&SplatBuffer::weighted_b, &SplatBuffer::glossy_b, 2);
    if (all.squares.empty()) return;
    // The records' spread told what they were off by no better than they told the light: what is left is noise, theirs
    // or the pixel's own.
    const float mean = luminance(mean_of(all, i)) / all.luminance_unit, own = agreed.error / all.luminance_unit;
    const float variance = std::max(own * own, all.variance_of_sum[i] / (weight * weight));
    all.variance[i] = weight * variance;
    all.variance_of_sum[i] = weight * weight * variance;
    all.squares[i] = weight * mean * mean;
}

}  // namespace

std::vector<Record> take_shown(const ContactPixels& at, std::vector<Record>& known)
{
    std::vector<char> is_shown(known.size(), 0);
    const KnownPlaces places(at, known, true);
    for (const PixelAtContact& p : at.pixels)
        if (const std::uint32_t k = places.at(p.pixel); k != kNone) is_shown[k] = 1;
    std::vector<Record> shown, others;
    for (std::size_t k = 0; k < known.size(); ++k) (is_shown[k] != 0 ? shown : others).push_back(std::move(known[k]));
    known = std::move(others);
    return shown;
}

std::uint64_t gather_contacts(const RecordGatherer& gatherer, const ContactPixels& at, ThreadPool& pool,
                              std::vector<Record>& known, const std::function<void(float)>& report)
{
    constexpr std::size_t kBatch = 8192;
    std::vector<std::uint32_t> unknown;
    {
        const KnownPlaces places(at, known);
        for (const PixelAtContact& p : at.pixels)
            if (places.at(p.pixel) == kNone) unknown.push_back(p.pixel);
    }
    RecordStats stats;
    for (std::size_t done = 0; done < unknown.size(); done += kBatch) {
        report(static_cast<float>(done) / static_cast<float>(unknown.size()));
        const auto begin = unknown.begin() + static_cast<std::ptrdiff_t>(done);
        const auto count = static_cast<std::ptrdiff_t>(std::min(kBatch, unknown.size() - done));
        std::vector<Record> found = gatherer.gather(at.gbuffer, {begin, begin + count}, pool, stats);
        for (Record& r : found) r.spacing_radius = r.footprint, r.watch.state = at.scene;
        known.insert(known.end(), std::make_move_iterator(found.begin()), std::make_move_iterator(found.end()));
    }
    return all_rays(stats);
}

ContactStats ask_contacts(const RecordGatherer* gatherer, const ContactPixels& at, const ContactSettings& settings,
                          ThreadPool& pool, std::vector<Record>& known, const SplatBuffer& of_lamps, SplatBuffer& all,
                          const std::function<void(float)>& report)
{
    std::vector<Contact> contacts = find_contacts(at, known, of_lamps, all);
    const AlikeContacts alike(at.gbuffer, contacts, pool);
    ContactStats stats{contacts.size(), 0};
    const auto hear_all = [&] {
        hear(known, contacts);
        return agree(contacts, alike, pool);
    };
    const float dark = kDarkLight * static_cast<float>(mean_light(all, pool));
    std::vector<Agreed> agreed = hear_all();
    for (int round = 0; gatherer && round < kRounds; ++round) {
        const std::uint64_t more =
            gather_noisy(*gatherer, at.gbuffer, {contacts, agreed, dark}, settings, pool, known, report);
        if (more == 0) break;
        stats.rays += more;
        agreed = hear_all();
    }
    for (std::size_t k = 0; k < contacts.size(); ++k) {
        RecordWatch& watch = known[contacts[k].known].watch;
        const bool is_asked_again = watch.is_shown && watch.view == settings.now;
        watch.records_off = agreed[k].is_off || (is_asked_again && watch.records_off);
        watch.is_shown = true;
        watch.view = settings.now;
        if (agreed[k].is_off) put(contacts[k], agreed[k], of_lamps, all);
    }
    return stats;
}

}  // namespace rcs
