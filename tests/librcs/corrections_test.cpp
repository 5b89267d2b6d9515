// What records say beyond their own irradiance, so that curved light comes out as it is.
#include "splat/corrections.h"

#include <cmath>
#include <functional>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "shared/weight.h"
#include "splat/gpu_records.h"

namespace rcs {
namespace {

constexpr SplatSettings kSplat{0.2f, 3.5f, true};
constexpr int kSide = 30;  // records, one metre apart

/// Light on the plane z = 0 [W m^-2], by place.
using Field = std::function<double(double x, double y)>;

/// Records of that light and its gradient, a little beside the corners of a grid.
std::vector<Record> records_of(const Field& light, double noise = 0.0, unsigned seed = 5)
{
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> beside(-0.3, 0.3);
    std::normal_distribution<double> error(0.0, noise);
    std::vector<Record> records;
    for (int i = 0; i < kSide * kSide; ++i) {
        const double x = i % kSide + beside(random), y = i / kSide + beside(random), h = 1e-4;
        const double e = light(x, y);
        Record r;
        r.position = {x, y, 0.0};
        r.normal = {0.0f, 0.0f, 1.0f};
        r.irradiance = glm::vec3(e * (1.0 + error(random)));
        r.translation_gradient.fill(
            {(light(x + h, y) - light(x - h, y)) / (2.0 * h), (light(x, y + h) - light(x, y - h)) / (2.0 * h), 0.0});
        r.noise = static_cast<float>(noise);
        r.spacing_radius = 0.8f;
        records.push_back(r);
    }
    return records;
}

/// What a splat of them says there, in red.
double splatted(const std::vector<Record>& records, double x, double y)
{
    double light = 0.0, weights = 0.0;
    for (const Record& r : records) {
        const glm::vec3 d = glm::vec3(x, y, 0.0) - r.position, g = r.translation_gradient[0];
        const float weight = gpu::rcs_interpolation_weight({d.x, d.y, d.z}, {0.0f, 0.0f, 1.0f}, {0.0f, 0.0f, 1.0f},
                                                           1.0f / influence_radius(r, kSplat.overlap), 1.0f);
        light += static_cast<double>(weight) * static_cast<double>(r.irradiance.r + r.correction.r + glm::dot(d, g));
        weights += static_cast<double>(weight);
    }
    return light / weights;
}

/// Errors of the splat over the middle of the plane.
struct Errors {
    double mean = 0.0, square = 0.0;
};
Errors errors_of(const std::vector<Record>& records, const Field& light)
{
    Errors sums;
    int count = 0;
    for (double x = 6.0; x < kSide - 6.0; x += 0.37)
        for (double y = 6.0; y < kSide - 6.0; y += 0.37, ++count) {
            const double off = splatted(records, x, y) - light(x, y);
            sums.mean += off;
            sums.square += off * off;
        }
    return {sums.mean / count, sums.square / count};
}

double bulge(double x, double y)
{
    return 2.0 + 8.0 * std::exp(-0.5 * (std::pow(x - 15.0, 2) + std::pow(y - 14.0, 2)) / 16.0);
}

TEST(Corrections, BringCurvedLightNearerToWhatItIs)
{
    ThreadPool pool(2);
    std::vector<Record> records = records_of(bulge);
    const Errors before = errors_of(records, bulge);
    set_corrections(records, kSplat, pool);
    const Errors after = errors_of(records, bulge);
    EXPECT_LT(after.square, 0.1 * before.square);
    EXPECT_LT(std::abs(after.mean), 0.25 * std::abs(before.mean));
}

TEST(Corrections, LeaveLightThatIsEvenOrRisesEvenly)
{
    ThreadPool pool(2);
    std::vector<Record> records = records_of([](double x, double y) { return 3.0 + 0.2 * x - 0.05 * y; });
    set_corrections(records, kSplat, pool);
    for (const Record& r : records) EXPECT_LT(std::abs(r.correction.g), 1e-5f * r.irradiance.g);
}

TEST(Corrections, AddHardlyAnyNoise)
{
    ThreadPool pool(2);
    const auto even = [](double, double) { return 5.0; };
    std::vector<Record> records = records_of(even, 0.1);
    const Errors before = errors_of(records, even);
    set_corrections(records, kSplat, pool);
    const Errors after = errors_of(records, even);
    EXPECT_GT(before.square, 0.0);
    EXPECT_LT(after.square, 1.15 * before.square);
}

TEST(Corrections, FollowABendThatTheNoiseOfEachRecordHides)
{
    ThreadPool pool(2);
    double before = 0.0, after = 0.0;  // at the top of the bulge, over many draws
    for (unsigned seed = 1; seed <= 64; ++seed) {
        std::vector<Record> records = records_of(bulge, 0.1, seed);
        before += splatted(records, 15.0, 14.0) - bulge(15.0, 14.0);
        set_corrections(records, kSplat, pool);
        after += splatted(records, 15.0, 14.0) - bulge(15.0, 14.0);
    }
    EXPECT_GT(before, 0.0);
    EXPECT_LT(std::abs(after), 0.42 * before);
}

TEST(Corrections, AreEachColoursOwnAndLeaveNoneNegative)
{
    ThreadPool pool(2);
    // A spot on black: between the two, tangents lie far from the light.
    std::vector<Record> records =
        records_of([](double x, double y) { return std::hypot(x - 15.0, y - 15.0) < 3.0 ? 9.0 : 0.0; });
    for (Record& r : records) r.irradiance.b = 1.0f, r.translation_gradient[2] = glm::vec3(0.0f);
    set_corrections(records, kSplat, pool);
    float largest = 0.0f;
    for (const Record& r : records) {
        for (int c = 0; c < 3; ++c) EXPECT_GE(r.irradiance[c] + r.correction[c], 0.0f);
        EXPECT_LT(std::abs(r.correction.b), 1e-5f);
        largest = std::max(largest, std::abs(r.correction.r));
    }
    EXPECT_GT(largest, 0.1f);
}

TEST(Corrections, AreTheSameBitsForAnyNumberOfThreadsAndSetAnewEachTime)
{
    ThreadPool one(1), three(3);
    std::vector<Record> records = records_of(bulge, 0.05), again = records;
    set_corrections(records, kSplat, one);
    set_corrections(again, kSplat, three);
    set_corrections(again, kSplat, three);
    for (std::size_t i = 0; i < records.size(); ++i) EXPECT_EQ(records[i].correction, again[i].correction);
}

TEST(Corrections, OfRecordsThatNothingReachesAreNone)
{
    ThreadPool pool(1);
    std::vector<Record> none;
    set_corrections(none, kSplat, pool);
    std::vector<Record> records(2);
    records[0].irradiance = records[1].irradiance = glm::vec3(1.0f);
    records[0].spacing_radius = 0.5f;
    records[1].position = {3.0f, 0.0f, 0.0f};  // of no influence
    set_corrections(records, kSplat, pool);
    for (const Record& r : records) EXPECT_EQ(r.correction, glm::vec3(0.0f));
}

}  // namespace
}  // namespace rcs
