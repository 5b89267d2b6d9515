#include "records/record_bytes.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "radiance/harmonics.h"
#include "rcs/error.h"

namespace rcs {
namespace {

constexpr std::string_view kMagic = "rcs records\n";
constexpr std::uint32_t kVersion = 3;
constexpr std::uint32_t kLongestKey = 4096;        // [bytes] of each of its texts
constexpr std::size_t kRadiance = 3 * kHarmonics;  // values of a record that has radiance
constexpr std::size_t kRecordBytes = 4 * 50;       // without radiance
constexpr float kFarthest = 1e18f;                 // as for meshes: their product stays a float
constexpr float kLeastFootprint = 1e-30f;          // below, one over a radius is no float
constexpr float kSlightlyMore = 1.001f;            // by rounding, than all of it
constexpr float kUnitLength = 1e-3f;               // a normal may be off by

/// Shows `visit` every field of a record in turn. A record that gets a new member fails to compile here.
template <typename AnyRecord, typename Visit>
void visit_fields(AnyRecord& record, const Visit& visit)
{
    auto& [position, normal, irradiance, of_lamps, rotation_gradient, translation_gradient, harmonic_mean_distance,
           minimum_distance, gradient_reach, rays, footprint, noise, spacing_radius, gradient_scale, closeness,
           correction, breadth, gathered_lamps, radiance, radiance_of_lamps, watch] = record;
    const auto vector = [&](auto& v) {
        for (int i = 0; i < 3; ++i) visit(v[i]);
    };
    vector(position);
    vector(normal);
    vector(irradiance);
    vector(of_lamps);
    for (auto& gradient : rotation_gradient) vector(gradient);
    for (auto& gradient : translation_gradient) vector(gradient);
    visit(harmonic_mean_distance);
    visit(minimum_distance);
    visit(gradient_reach);
    visit(rays);
    visit(footprint);
    visit(noise);
    visit(spacing_radius);
    visit(gradient_scale);
    visit(closeness);
    visit(breadth);
    visit(gathered_lamps);
    // Where it was born: who knows that can watch it again. The rest is of a session, whose scenes it counts.
    vector(watch.origin);
    vector(watch.geometric_normal);
    visit(watch.instance);
}

void put(std::string& bytes, std::uint32_t value)
{
    for (int shift = 0; shift < 32; shift += 8) bytes.push_back(static_cast<char>(value >> shift & 0xffu));
}

void put(std::string& bytes, std::string_view text)
{
    put(bytes, static_cast<std::uint32_t>(text.size()));
    bytes.append(text);
}

class Reader {
public:
    Reader(std::string_view bytes, const std::string& path) : bytes_(bytes), path_(path) {}

    [[noreturn]] void fail(ErrorCode code, const std::string& why) const
    {
        throw Error(code, "record file " + path_ + " " + why);
    }
    [[noreturn]] void damaged(const std::string& why) const { fail(ErrorCode::bad_file, "is damaged: " + why); }

    std::size_t left() const { return bytes_.size(); }

    std::string_view take(std::size_t size)
    {
        if (size > bytes_.size()) damaged("it ends too early");
        const std::string_view part = bytes_.substr(0, size);
        bytes_.remove_prefix(size);
        return part;
    }

    std::uint32_t number()
    {
        const std::string_view part = take(4);
        std::uint32_t value = 0;
        for (std::size_t i = 0; i < 4; ++i) value |= std::uint32_t{static_cast<unsigned char>(part[i])} << 8 * i;
        return value;
    }

    std::string text()
    {
        const std::uint32_t size = number();
        if (size > kLongestKey) damaged("a text of " + std::to_string(size) + " bytes");
        return std::string(take(size));
    }

private:
    std::string_view bytes_;
    const std::string& path_;
};

bool is_finite(const glm::vec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }
bool is_distance(float value) { return value >= 0.0f; }  // infinity is one, NaN is none
bool is_part(float value) { return value > 0.0f && value <= 1.0f; }

}  // namespace

std::string_view defect_of(const Record& r)
{
    if (!is_finite(r.position) || glm::length(r.position) > kFarthest) return "a position";
    if (!is_finite(r.normal) || !(std::abs(glm::length(r.normal) - 1.0f) <= kUnitLength)) return "a normal";
    if (!is_finite(r.irradiance) || !(std::min({r.irradiance.r, r.irradiance.g, r.irradiance.b}) >= 0.0f))
        return "an irradiance";
    if (!is_finite(r.of_lamps) || !(std::min({r.of_lamps.r, r.of_lamps.g, r.of_lamps.b}) >= 0.0f) ||
        glm::any(glm::greaterThan(r.of_lamps, r.irradiance * kSlightlyMore)))
        return "a part of lamps";
    const auto finite = [](const glm::vec3& gradient) { return is_finite(gradient); };
    if (!std::all_of(r.rotation_gradient.begin(), r.rotation_gradient.end(), finite) ||
        !std::all_of(r.translation_gradient.begin(), r.translation_gradient.end(), finite))
        return "a gradient";
    if (!is_distance(r.harmonic_mean_distance) || !is_distance(r.minimum_distance) || !is_distance(r.gradient_reach) ||
        !is_distance(r.spacing_radius) || std::isinf(r.spacing_radius))
        return "a distance";
    if (r.rays < 1) return "a number of rays";
    if (!(r.footprint >= kLeastFootprint) || std::isinf(r.footprint)) return "a footprint";
    if (!is_distance(r.noise) || std::isinf(r.noise)) return "a noise";
    if (!(r.gradient_scale >= 0.0f && r.gradient_scale <= 1.0f) || !is_part(r.closeness) || !is_part(r.breadth))
        return "a scale";
    const RecordWatch& w = r.watch;
    const bool is_born = w.geometric_normal != glm::vec3(0.0f);
    if (!is_finite(w.origin) || glm::length(w.origin) > kFarthest || !is_finite(w.geometric_normal) ||
        (is_born && !(std::abs(glm::length(w.geometric_normal) - 1.0f) <= kUnitLength)))
        return "a birth";
    for (const std::vector<float>* radiance : {&r.radiance, &r.radiance_of_lamps})
        if (!std::all_of(radiance->begin(), radiance->end(), [](float value) { return std::isfinite(value); }))
            return "a radiance";
    return {};
}

namespace {

Record read_record(Reader& reader)
{
    Record record;
    visit_fields(record, [&](auto& value) { value = std::bit_cast<std::decay_t<decltype(value)>>(reader.number()); });
    for (std::vector<float>* radiance : {&record.radiance, &record.radiance_of_lamps}) {
        const std::uint32_t values = reader.number();
        if (values != 0 && values != kRadiance) reader.damaged("a radiance of " + std::to_string(values) + " values");
        radiance->reserve(values);
        for (std::uint32_t i = 0; i < values; ++i) radiance->push_back(std::bit_cast<float>(reader.number()));
    }
    return record;
}

}  // namespace

std::string to_bytes(const RecordKey& key, const std::vector<Record>& records)
{
    std::string bytes(kMagic);
    put(bytes, kVersion);
    put(bytes, key.scene);
    put(bytes, key.settings);
    put(bytes, static_cast<std::uint32_t>(records.size()));
    std::size_t size = bytes.size();
    for (const Record& record : records)
        size += kRecordBytes + 4 * (record.radiance.size() + record.radiance_of_lamps.size());
    bytes.reserve(size);
    for (const Record& record : records) {
        visit_fields(record, [&](const auto& value) { put(bytes, std::bit_cast<std::uint32_t>(value)); });
        for (const std::vector<float>* radiance : {&record.radiance, &record.radiance_of_lamps}) {
            put(bytes, static_cast<std::uint32_t>(radiance->size()));
            for (const float value : *radiance) put(bytes, std::bit_cast<std::uint32_t>(value));
        }
    }
    return bytes;
}

KeyedRecords parse_records(std::string_view bytes, const std::string& path)
{
    Reader reader(bytes, path);
    if (!bytes.starts_with(kMagic)) throw Error(ErrorCode::bad_file, path + " is no record file");
    reader.take(kMagic.size());
    if (const std::uint32_t version = reader.number(); version != kVersion)
        reader.fail(ErrorCode::unsupported, "is of version " + std::to_string(version) + ", this build reads version " +
                                                std::to_string(kVersion));
    KeyedRecords file;
    file.key.scene = reader.text();
    file.key.settings = reader.text();
    const std::uint32_t count = reader.number();
    if (count > reader.left() / kRecordBytes)
        reader.damaged("it is too short for " + std::to_string(count) + " records");
    file.records.reserve(count);
    for (std::uint32_t k = 0; k < count; ++k) {
        file.records.push_back(read_record(reader));
        if (const std::string_view defect = defect_of(file.records.back()); !defect.empty())
            reader.damaged("record " + std::to_string(k) + " has " + std::string(defect) + " out of range");
    }
    if (reader.left() > 0) reader.damaged("there are bytes after its records");
    return file;
}

}  // namespace rcs
