// What a plan makes of options and of what the user says about effects.
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "rcs/effect_plan.h"
#include "rcs/error.h"
#include "support/effect_scenes.h"
#include "support/plans.h"

namespace rcs {
namespace {

using test::add_mesh;
using test::add_surface;
using test::lit_room;
using test::metal;
using test::panel;
using test::plan_of;
using test::small;
using test::switched_on;
using test::with;

TEST(EffectPlan, LeavesOutBouncesByAStatedBound)
{
    RenderOptions options = with(small(), 64);
    const EffectPlan plan = plan_of(lit_room(0.1f), options);
    EXPECT_EQ(plan.bounces, 4);
    // What is missing after n bounces, of the first one's power: 0.1^4 + 0.1^5 + ...
    EXPECT_NEAR(plan[Effect::more_bounces].loss, 1e-4 / 0.9, 1e-9);
    EXPECT_EQ(plan_of(lit_room(0.5f), options).bounces, 11);
    EXPECT_EQ(plan_of(lit_room(1.0f), options).bounces, 64);
    options.quality = TargetError{0.5};
    EXPECT_EQ(plan_of(lit_room(0.1f), options).bounces, 2);
}

TEST(EffectPlan, MeasuresTheShareOfThePicture)
{
    Scene scene = lit_room();
    // An orthographic view of 4 m x 4 m onto a panel of 1 m x 1 m.
    add_mesh(scene, panel(add_surface(scene, metal(0.0f))));
    scene.cameras[0].projection = Projection::orthographic;
    scene.cameras[0].ymag = 2.0;
    const PlannedEffect e = plan_of(scene, small())[Effect::traced_lobes];
    EXPECT_EQ(e.basis, PlannedEffect::Basis::measured);
    EXPECT_NEAR(e.share, 1.0 / 16.0, 0.01);
    EXPECT_LT(e.low, 1.0 / 16.0);
    EXPECT_GT(e.high, 1.0 / 16.0);
}

TEST(EffectPlan, FindsWhatThePilotMisses)
{
    // A mirror of one pixel's size in a view of 1,024 pixels' side: 1,024 pilot rays go past it.
    Scene scene = lit_room();
    add_mesh(scene,
             test::quad({0.311f, 1.713f, -1.0f}, {0.004f, 0, 0}, {0, 0.004f, 0}, add_surface(scene, metal(0.0f))));
    RenderOptions options = small();
    options.width = options.height = 1024;
    const PlannedEffect e = plan_of(scene, options)[Effect::traced_lobes];
    EXPECT_TRUE(e.needed);
    EXPECT_EQ(e.share, 0.0);
    EXPECT_NE(e.reason.find("a sample of the picture meets"), std::string::npos) << e.reason;
}

TEST(EffectPlan, DoesAsItIsTold)
{
    RenderOptions options = small();
    options.effects = parse_effects("all");
    const Scene scene = lit_room();
    const EffectPlan all = plan_of(scene, options, options.effects);
    for (const Effect e : {Effect::environment, Effect::glossy_records, Effect::traced_lobes, Effect::highlights})
        EXPECT_TRUE(all.needs(e) && all[e].chosen) << name_of(e);

    options.effects = parse_effects("punctual-light,anti-aliasing");
    EXPECT_EQ(switched_on(plan_of(scene, options, options.effects)),
              (std::set<std::string>{"punctual-light", "anti-aliasing"}));

    options.effects = {};
    options.effects.without.set(Effect::indirect_diffuse);
    const EffectPlan without = plan_of(scene, options);
    EXPECT_FALSE(without.needs(Effect::indirect_diffuse));
    EXPECT_TRUE(without[Effect::indirect_diffuse].chosen);
    EXPECT_EQ(without.bounces, 0);
    EXPECT_EQ(without[Effect::indirect_diffuse].loss, 1.0);
}

TEST(EffectPlan, RefusesWhatIsNoEffect)
{
    EXPECT_THROW(parse_effects("reflections"), Error);
    EXPECT_THROW(parse_effects("emission,"), Error);
    EXPECT_THROW(parse_effects("motion"), Error);
    EXPECT_THROW(parse_effects("auto-exposure"), Error);
    EXPECT_THROW(parse_effects("layer-depth"), Error);
    for (std::size_t i = 0; i < kEffects; ++i)
        EXPECT_EQ(find_effect(name_of(static_cast<Effect>(i))), static_cast<Effect>(i));
}

}  // namespace
}  // namespace rcs
