#include "compose/contacts.h"

#include <cmath>
#include <numeric>
#include <random>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "rcs/gl_context.h"
#include "records/gather.h"
#include "support/effect_scenes.h"
#include "util/color.h"

namespace rcs {
namespace {

constexpr int kWidth = 120, kHeight = 90;

/// A wall with a shelf, seen from afar. Light comes from a spot on the floor alone, so that the shelf takes nearly all
/// of it from the wall just above. A post stands free before the wall.
Scene shelf_on_a_wall()
{
    Scene scene = test::room(0.5f);
    test::add_mesh(scene, test::box({-1.5f, 1.2f, -2.0f}, {1.5f, 1.3f, -1.75f}, 0, test::Facing::outwards));
    test::add_mesh(scene, test::box({0.55f, 0.0f, 0.0f}, {0.65f, 3.0f, 0.1f}, 0, test::Facing::outwards));
    PunctualLight spot = test::point_light({0.0, 2.5, -0.6}, glm::vec3(60.0f));
    spot.kind = LightKind::spot;
    spot.direction = {0.0, -1.0, 0.0};
    spot.inner_cone = 0.0f;
    spot.outer_cone = 0.3f;
    scene.lights = {spot};
    scene.cameras = {look_at_camera("camera", {0.0, 1.9, 1.9}, {0.0, 1.4, -2.0}, 0.9)};
    return scene;
}

/// Leaves about a pixel wide, every way, before the wall.
Scene leaves_before_a_wall()
{
    Scene scene = shelf_on_a_wall();
    std::mt19937 random(4);
    std::uniform_real_distribution<float> part(-1.0f, 1.0f);
    const auto any = [&] { return glm::normalize(glm::vec3(part(random), part(random), part(random))); };
    for (int i = 0; i < 600; ++i) {
        const glm::vec3 at(0.8f * part(random), 1.9f + 0.4f * part(random), -0.8f + 0.3f * part(random)), along = any();
        const glm::vec3 across = glm::normalize(glm::cross(along, any()));
        test::add_mesh(scene, test::quad(at, 0.04f * along, 0.04f * across, 0));
    }
    scene.materials[0].double_sided = true;
    return scene;
}

class Contacts : public testing::Test {
protected:
    explicit Contacts(Scene s = shelf_on_a_wall()) : scene(std::move(s)) {}

    Scene scene;
    ThreadPool pool{2};
    RayScene rays = build_ray_scene(scene, pool);
    View view = test::view_of(scene.cameras[0], kWidth, kHeight);
    GlContext gl;
    GBuffer gbuffer = render_gbuffer(gl, rays, view, 1.0f, pool);
    RecordSettings settings;
    std::vector<PixelAtContact> pixels = pixels_at_contacts(gbuffer, pool);
    std::vector<Record> known;

    std::vector<Sounding> gathered(int count, std::uint64_t sample)
    {
        std::vector<std::uint32_t> at;
        for (const PixelAtContact& p : pixels) at.push_back(p.pixel);
        return RecordGatherer({rays}, settings).sound(gbuffer, at, count, sample, pool);
    }

    /// Sums of records that all say this, and agree.
    SplatBuffer records(const std::vector<float>& light) const
    {
        SplatBuffer sums;
        sums.width = kWidth, sums.height = kHeight;
        sums.weight.assign(gbuffer.size(), 2.0f);
        sums.count = sums.weight;
        sums.luminance_unit = 0.5f;
        for (const float l : light) {
            for (auto* plane : {&sums.weighted_r, &sums.weighted_g, &sums.weighted_b}) plane->push_back(2.0f * l);
            sums.squares.push_back(2.0f * (l / 0.5f) * (l / 0.5f));
        }
        sums.variance.assign(gbuffer.size(), 0.0f);
        sums.variance_of_sum = sums.variance;
        return sums;
    }

    ContactStats ask(SplatBuffer& sums, ThreadPool& with, const ContactSettings& how = {}, bool gathers = true)
    {
        RecordSettings few = settings;
        few.rays = 16;
        const RecordGatherer gatherer({rays}, few);
        const ContactPixels at{gbuffer, view, pixels};
        const auto tell = [](float) {};
        std::uint64_t begun = 0;
        if (gathers) begun = gather_contacts(gatherer, at, with, known, tell);
        ContactStats stats = ask_contacts(gathers ? &gatherer : nullptr, at, how, with, known, {}, sums, tell);
        stats.rays += begun;
        return stats;
    }

    /// Sees from elsewhere.
    void look(const Camera& camera)
    {
        view = test::view_of(camera, kWidth, kHeight);
        gbuffer = render_gbuffer(gl, rays, view, 1.0f, pool);
        pixels = pixels_at_contacts(gbuffer, pool);
    }

    /// From so far to the side and to the back [m].
    static Camera seen_from(double aside)
    {
        return look_at_camera("camera", {aside, 1.9, 1.9 + aside}, {aside, 1.4, -2.0}, 0.9);
    }

    SplatBuffer bright() const { return records(std::vector<float>(gbuffer.size(), 1.0f)); }

    static float light_at(const SplatBuffer& sums, std::uint32_t i) { return sums.weighted_g[i] / sums.weight[i]; }
};

/// Where the nearest other surface rises, pixel by pixel.
glm::ivec2 rises_beside(const GBuffer& g, std::size_t i)
{
    constexpr float kTouching = 3.0f, kRises = 0.5f;
    glm::ivec2 nearest(0);
    for_each_around(g, i, 2, [&](std::size_t j, int columns, int rows) {
        const glm::vec3 d = g.position(j) - g.position(i);
        const float height = glm::dot(d, g.geometric_normal[i]), far = kTouching * g.footprint[i];
        const bool rises = g.covered(j) && height > 0.0f && height * height > kRises * kRises * glm::dot(d, d) &&
                           glm::dot(d, d) < far * far * static_cast<float>(columns * columns + rows * rows);
        const glm::ivec2 to(columns, rows);
        if (rises && (nearest == glm::ivec2(0) || pixels_away(to) < pixels_away(nearest))) nearest = to;
    });
    return nearest;
}

TEST_F(Contacts, AreThePixelsBesideWhichAnotherSurfaceRises)
{
    for (std::size_t i = 0; i < gbuffer.size() / 5; ++i) gbuffer.instance[3 * i] = GBuffer::kNone;
    std::size_t met = 0;
    std::vector<glm::ivec2> found(gbuffer.size(), glm::ivec2(0));
    for (const PixelAtContact& p : pixels_at_contacts(gbuffer, pool)) found[p.pixel] = p.to;
    for (std::size_t i = 0; i < gbuffer.size(); ++i) {
        ASSERT_EQ(found[i], gbuffer.covered(i) ? rises_beside(gbuffer, i) : glm::ivec2(0)) << i;
        met += found[i] != glm::ivec2(0) ? 1 : 0;
    }
    EXPECT_GT(met, gbuffer.size() / 100);
}

TEST_F(Contacts, LieWithinTwoPixelsOfASurfaceThatRisesAndNowhereElse)
{
    std::vector<int> away(gbuffer.size(), 0);
    for (const PixelAtContact& p : pixels) away[p.pixel] = std::max(std::abs(p.to.x), std::abs(p.to.y));
    EXPECT_GT(pixels.size(), 2u * static_cast<unsigned>(kWidth)) << "shelf and corners";
    EXPECT_LT(pixels.size(), gbuffer.size() / 5);
    int above_shelf = 0;
    for (int y = 2; y + 2 < kHeight; ++y) {
        for (int x = 2; x + 2 < kWidth; ++x) {
            const int i = y * kWidth + x;
            bool is_alone = true;
            for (int dy = -2; dy <= 2; ++dy)
                for (int dx = -2; dx <= 2; ++dx)
                    is_alone &= glm::distance(gbuffer.normal(static_cast<std::size_t>(i + dy * kWidth + dx)),
                                              gbuffer.normal(static_cast<std::size_t>(i))) < 1e-3f;
            const glm::vec3 p = gbuffer.scene_position(static_cast<std::size_t>(i));
            if (is_alone && std::abs(p.z + 2.0f) < 1e-3f && std::abs(p.x) < 1.4f && std::abs(p.y - 1.25f) > 0.2f) {
                EXPECT_EQ(away[static_cast<std::size_t>(i)], 0) << "open wall: " << x << ", " << y;
            }
            above_shelf +=
                away[static_cast<std::size_t>(i)] != 0 && std::abs(p.z + 2.0f) < 1e-3f && p.y > 1.3f && p.y < 1.36f;
        }
    }
    EXPECT_GT(above_shelf, 30);
}

class Leaves : public Contacts {
protected:
    Leaves() : Contacts(leaves_before_a_wall()) {}

    bool is_leaf(std::size_t i) const
    {
        const glm::vec3 p = gbuffer.scene_position(i);
        return gbuffer.covered(i) && std::abs(p.x) < 0.85f && std::abs(p.y - 1.9f) < 0.45f && p.z > -1.15f &&
               p.z < -0.4f;
    }
};

TEST_F(Leaves, GatherThemselves)
{
    std::vector<bool> gathers(gbuffer.size(), false);
    std::size_t alone = 0;
    for (const PixelAtContact& p : pixels) {
        gathers[p.pixel] = true;
        alone += p.to == glm::ivec2(0);
    }
    EXPECT_GT(alone, 150u);
    std::size_t leaves = 0, of_those = 0;
    for (std::size_t i = 0; i < gbuffer.size(); ++i) {
        if (!is_leaf(i)) continue;
        ++leaves;
        of_those += gathers[i];
    }
    ASSERT_GT(leaves, 400u);
    EXPECT_GT(of_those, leaves / 2);
}

/// Where light of leaves is that of those around in the mean, each finds its own, and what is left is told.
TEST_F(Leaves, FindTheirOwnLight)
{
    std::erase_if(pixels, [](const PixelAtContact& p) { return p.to != glm::ivec2(0); });
    const std::vector<Sounding> truth = gathered(8192, 77);
    double mean = 0.0;
    for (const Sounding& s : truth) mean += s.light / static_cast<double>(truth.size());
    SplatBuffer sums = records(std::vector<float>(gbuffer.size(), static_cast<float>(mean)));
    ask(sums, pool, {.noise = 0.03f, .most_rays = 4096});
    double before = 0.0, after = 0.0, mean_after = 0.0;
    for (std::size_t k = 0; k < pixels.size(); ++k) {
        const auto light = static_cast<double>(light_at(sums, pixels[k].pixel));
        before += std::abs(mean - truth[k].light);
        after += std::abs(light - truth[k].light);
        mean_after += light / static_cast<double>(pixels.size());
    }
    EXPECT_LT(after, before / 3.0);
    EXPECT_NEAR(mean_after, mean, 0.1 * mean);
}

/// Records that reach over the shelf say what the open wall gets: by their own gathers pixels come within a third of
/// the error, and what is left is told.
TEST_F(Contacts, FindTheLightThatRecordsReachOver)
{
    const std::vector<Sounding> truth = gathered(8192, 77);
    double open = 0.0;
    for (const Sounding& s : truth) open = std::max(open, s.light);
    SplatBuffer sums = records(std::vector<float>(gbuffer.size(), static_cast<float>(open)));
    const ContactStats stats = ask(sums, pool);
    EXPECT_EQ(stats.pixels, pixels.size());
    EXPECT_GE(stats.rays, 16 * pixels.size());
    EXPECT_EQ(known.size(), pixels.size());
    double before = 0.0, after = 0.0, mean = 0.0, mean_after = 0.0, told = 0.0;
    for (std::size_t k = 0; k < pixels.size(); ++k) {
        const std::uint32_t i = pixels[k].pixel;
        const auto light = static_cast<double>(light_at(sums, i));
        before += std::abs(open - truth[k].light);
        after += std::abs(light - truth[k].light);
        mean += truth[k].light;
        mean_after += light;
        told += 0.5 * std::sqrt(static_cast<double>(sums.variance_of_sum[i])) / static_cast<double>(sums.weight[i]);
    }
    EXPECT_GT(before, 0.3 * mean) << "the case that matters occurs";
    EXPECT_LT(after, before / 3.0);
    EXPECT_NEAR(mean_after, mean, 0.2 * mean);
    EXPECT_GT(told, 0.4 * after);
}

TEST_F(Contacts, LeaveRecordsThatAreRight)
{
    const std::vector<Sounding> truth = gathered(8192, 77);
    std::vector<float> light(gbuffer.size(), 1.0f);
    for (std::size_t k = 0; k < pixels.size(); ++k) light[pixels[k].pixel] = static_cast<float>(truth[k].light);
    SplatBuffer sums = records(light);
    ask(sums, pool);
    const std::vector<Sounding> once = gathered(32, 78);
    double changed = 0.0, mean = 0.0, noise = 0.0;
    for (std::size_t k = 0; k < pixels.size(); ++k) {
        noise += std::abs(once[k].light - truth[k].light);
        changed += std::abs(static_cast<double>(light_at(sums, pixels[k].pixel)) - truth[k].light);
        mean += truth[k].light;
    }
    EXPECT_LT(changed, 0.1 * mean);
    EXPECT_LT(changed, 0.2 * noise) << "what one gather is off by";
    for (std::size_t i = 0; i < gbuffer.size(); ++i)
        if (std::none_of(pixels.begin(), pixels.end(), [&](const PixelAtContact& p) { return p.pixel == i; })) {
            ASSERT_EQ(light_at(sums, static_cast<std::uint32_t>(i)), light[i]) << "not at a contact";
        }
}

TEST_F(Contacts, AreTheSameBitsForAnyNumberOfThreads)
{
    ThreadPool one(1), three(3);
    SplatBuffer a = bright(), b = a;
    ask(a, one);
    known.clear();
    ask(b, three);
    EXPECT_EQ(a.weighted_r, b.weighted_r);
    EXPECT_EQ(a.squares, b.squares);
    EXPECT_NE(a.weighted_r, bright().weighted_r);
}

TEST_F(Contacts, AreFoundAgainByTheirPlaces)
{
    SplatBuffer first = bright(), second = first;
    const ContactStats made = ask(first, pool);
    const std::size_t gathers = known.size();
    EXPECT_EQ(ask(second, pool, {.now = 2}).rays, 0u);
    EXPECT_EQ(second.weighted_r, first.weighted_r);
    EXPECT_EQ(known.size(), gathers);
    EXPECT_TRUE(std::all_of(known.begin(), known.end(), [](const Record& r) { return r.watch.view == 2; }));

    // From an eighth of a pixel to the side and to the back most places have one, though records are off.
    look(seen_from(0.005));
    SplatBuffer third = bright();
    const ContactStats more = ask(third, pool, {.now = 3});
    EXPECT_LT(known.size() - gathers, pixels.size() / 2);
    EXPECT_LT(more.rays, made.rays / 2);
    known.clear();
    SplatBuffer afresh = bright();
    ask(afresh, pool);
    const std::vector<Sounding> truth = gathered(8192, 77);
    double off = 0.0, off_afresh = 0.0;
    for (std::size_t k = 0; k < pixels.size(); ++k) {
        off += std::abs(static_cast<double>(light_at(third, pixels[k].pixel)) - truth[k].light);
        off_afresh += std::abs(static_cast<double>(light_at(afresh, pixels[k].pixel)) - truth[k].light);
    }
    EXPECT_LT(off, 1.25 * off_afresh);
}

/// Those of another state of the scene wait until a pixel shows them; one of each place is enough.
TEST_F(Contacts, ThatKnowAnotherSceneAreLeftOutUntilTheyAreTaken)
{
    SplatBuffer sums = bright();
    ask(sums, pool);
    const std::size_t made = known.size();
    const std::vector<Record> twice = known;
    known.insert(known.end(), twice.begin(), twice.end());
    for (Record& r : known) r.watch.state = 1;
    const ContactPixels now{gbuffer, view, pixels, 2};
    EXPECT_EQ(take_shown(now, known).size(), made);
    EXPECT_EQ(known.size(), made);
    EXPECT_EQ(ask(sums, pool, {}, false).pixels, 0u) << "the others are of another scene";
    for (Record& r : known) r.watch.state = 0;
    EXPECT_EQ(ask(sums, pool, {}, false).pixels, made);
}

TEST_F(Contacts, HoldFartherWhereRecordsAreRight)
{
    const auto gathered_anew = [&](bool are_right, bool have_changed) {
        known.clear();
        look(scene.cameras[0]);
        std::vector<float> light(gbuffer.size(), 1.0f);
        if (are_right) {
            const std::vector<Sounding> truth = gathered(2048, 77);
            for (std::size_t k = 0; k < pixels.size(); ++k) light[pixels[k].pixel] = static_cast<float>(truth[k].light);
        }
        SplatBuffer sums = records(light);
        ask(sums, pool);
        const std::size_t before = known.size();
        if (have_changed)
            for (Record& r : known) r.watch.is_shown = false;
        look(seen_from(0.02));
        ask(sums, pool, {.now = 2});
        return static_cast<double>(known.size() - before) / static_cast<double>(pixels.size());
    };
    const double right = gathered_anew(true, false);
    EXPECT_LT(right, 0.5) << "from half a pixel to the side most places have one";
    EXPECT_GT(gathered_anew(false, false), 1.4 * right);
    EXPECT_GT(gathered_anew(true, true), 1.4 * right) << "of light that no view has shown nobody knows";
}

TEST_F(Contacts, GatherNothingInHaste)
{
    SplatBuffer sums = bright();
    EXPECT_EQ(ask(sums, pool, {}, false).pixels, 0u);
    EXPECT_EQ(sums.weighted_r, bright().weighted_r);
    SplatBuffer known_light = bright();
    ask(known_light, pool);
    const ContactStats stats = ask(sums, pool, {}, false);
    EXPECT_EQ(stats.pixels, pixels.size());
    EXPECT_EQ(stats.rays, 0u);
    EXPECT_EQ(sums.weighted_r, known_light.weighted_r);
}

}  // namespace
}  // namespace rcs
