#include "wire/options.h"

#include <cmath>
#include <limits>
#include <set>
#include <string>

#include <google/protobuf/descriptor.h>
#include <gtest/gtest.h>

#include "rcs/error.h"
#include "rcs/option_table.h"
#include "wire/outputs.h"
#include "wire/scene.h"

namespace rcs::service {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;

/// The names of all plain fields, those within messages too.
std::set<std::string> field_names(const Descriptor& type)
{
    std::set<std::string> names;
    for (int i = 0; i < type.field_count(); ++i) {
        const FieldDescriptor& field = *type.field(i);
        if (field.cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE)
            names.merge(field_names(*field.message_type()));
        else
            names.insert(field.name());
    }
    return names;
}

const FieldDescriptor& field_of(const OptionInfo& option)
{
    const FieldDescriptor* field = v1::RenderOptions::descriptor()->FindFieldByName(std::string(option.key));
    if (field == nullptr) field = v1::QualitySettings::descriptor()->FindFieldByName(std::string(option.key));
    if (field == nullptr) throw std::runtime_error("options.proto has no field " + std::string(option.key));
    return *field;
}

FieldDescriptor::CppType wire_type(const int*) { return FieldDescriptor::CPPTYPE_INT32; }
FieldDescriptor::CppType wire_type(const float*) { return FieldDescriptor::CPPTYPE_FLOAT; }
FieldDescriptor::CppType wire_type(const double*) { return FieldDescriptor::CPPTYPE_DOUBLE; }
FieldDescriptor::CppType wire_type(const std::uint64_t*) { return FieldDescriptor::CPPTYPE_UINT64; }
FieldDescriptor::CppType wire_type(const SplatMethod*) { return FieldDescriptor::CPPTYPE_ENUM; }
FieldDescriptor::CppType wire_type(const GatherMethod*) { return FieldDescriptor::CPPTYPE_ENUM; }
FieldDescriptor::CppType wire_type(const Denoiser*) { return FieldDescriptor::CPPTYPE_ENUM; }
FieldDescriptor::CppType wire_type(const std::optional<double>*) { return FieldDescriptor::CPPTYPE_DOUBLE; }
FieldDescriptor::CppType wire_type(const std::optional<Crop>*) { return FieldDescriptor::CPPTYPE_INT32; }
FieldDescriptor::CppType wire_type(const EffectSet*) { return FieldDescriptor::CPPTYPE_STRING; }

TEST(WireOptions, HaveTheFieldsAndTypesOfTheTable)
{
    std::set<std::string> keys;
    for (const OptionInfo& option : option_table()) {
        keys.emplace(option.key);
        const FieldDescriptor& field = field_of(option);
        RenderOptions options;
        change_value(option, options,
                     [&](const auto& value) { EXPECT_EQ(field.cpp_type(), wire_type(&value)) << option.key; });
        EXPECT_EQ(field.containing_type() == v1::QualitySettings::descriptor(),
                  quality_of(option) == Quality(QualitySettings{}).index())
            << option.key;
        EXPECT_EQ(field.real_containing_oneof() != nullptr,
                  quality_of(option) != kAnyQuality && field.containing_type() == v1::RenderOptions::descriptor())
            << option.key;
    }
    EXPECT_EQ(field_names(*v1::RenderOptions::descriptor()), keys);
    const auto& quality = *v1::RenderOptions::descriptor()->FindOneofByName("quality");
    ASSERT_EQ(static_cast<std::size_t>(quality.field_count()), std::size(kQualities));
    for (std::size_t i = 0; i < std::size(kQualities); ++i)
        EXPECT_EQ(quality.field(static_cast<int>(i))->name(), kQualities[i]);
}

TEST(WireOptions, ChoicesAreNumberedAsTheLibraryDoes)
{
    for (const OptionInfo& option : option_table()) {
        if (option.choices.empty()) continue;
        const auto& values = *field_of(option).enum_type();
        ASSERT_EQ(static_cast<std::size_t>(values.value_count()), option.choices.size()) << option.key;
        for (int i = 0; i < values.value_count(); ++i) {
            EXPECT_EQ(values.value(i)->number(), i);
            std::string name(option.choices[static_cast<std::size_t>(i)]);
            for (char& c : name) c = c == '-' ? '_' : static_cast<char>(std::toupper(c));
            EXPECT_NE(values.value(i)->name().find("_" + name), std::string::npos) << values.value(i)->name();
        }
    }
}

/// A value that is no default, for every option.
RenderOptions unusual_options()
{
    RenderOptions o;
    o.crop = Crop{1, 2, 30, 40};
    o.f_stop = 2.8, o.focus = 3.5;
    o.width = 321, o.height = 123, o.aa = 7, o.bounces = 3, o.lobe_rays = 5, o.overlap = 2.5f;
    o.quality = QualitySettings{.error_tolerance = 0.15f, .rays = 77, .noise_target = 0.07f, .refinement = 5};
    o.min_reach = 9.0f, o.max_reach = 44.0f, o.gradient_limit = 2.0f;
    o.area_samples = 11, o.penumbra_samples = 22, o.lamp_picks = 33;
    o.splat = SplatMethod::quads;
    o.gather = GatherMethod::device, o.device = 2;
    o.denoise = Denoiser::oidn;
    o.seed = std::numeric_limits<std::uint64_t>::max();
    o.effects.with.set(Effect::normal_maps);
    o.effects.without.set(Effect::traced_lobes);
    return o;
}

TEST(WireOptions, EveryFieldThereAndBackIsTheSame)
{
    const RenderOptions options = unusual_options(), back = from_message(to_message(options));
    for (const OptionInfo& option : option_table()) {
        EXPECT_EQ(text_of(option, back), text_of(option, options)) << option.key;
        if (quality_of(option) == kAnyQuality || quality_of(option) == 0) {
            EXPECT_NE(text_of(option, back), text_of(option, RenderOptions{})) << option.key << " is not unusual here";
        }
    }
    RenderOptions aimed;
    aimed.quality = TargetError{0.03};
    EXPECT_EQ(target_error(from_message(to_message(aimed))), 0.03);
    EXPECT_TRUE(aims_at_picture(from_message(to_message(aimed))));
    aimed.quality = TargetIndirectError{0.04};
    EXPECT_EQ(target_error(from_message(to_message(aimed))), 0.04);
    EXPECT_FALSE(aims_at_picture(from_message(to_message(aimed))));
    aimed.quality = Budget{12.5};
    EXPECT_EQ(budget_seconds(from_message(to_message(aimed))), 12.5);
}

TEST(WireOptions, AQualityIsOfOneKind)
{
    v1::RenderOptions message = to_message(RenderOptions{});
    EXPECT_TRUE(message.has_settings());
    message.set_budget_seconds(5.0);
    EXPECT_FALSE(message.has_settings()) << "one takes the place of the other";
    EXPECT_EQ(budget_seconds(from_message(message)), 5.0);
    message.mutable_settings()->set_rays(64);
    EXPECT_FALSE(has_goal(from_message(message)));
    EXPECT_EQ(settings_or_default(from_message(message)).rays, 64);
    EXPECT_EQ(settings_or_default(from_message(message)).noise_target, QualitySettings{}.noise_target);
}

std::string refusal(const v1::RenderOptions& message)
{
    try {
        from_message(message);
    } catch (const Error& e) {
        EXPECT_EQ(e.code(), ErrorCode::bad_argument);
        return e.what();
    }
    return "";
}

/// Options of a job as version 1 wrote it: accuracy 0.25 in `records`, area samples in `direct`, a target beside them.
TEST(WireOptions, WhatVersion1StoredIsRefusedInsteadOfMisread)
{
    const std::string stored(
        "\x08\x40\x10\x20\x18\x02\x20\x08\x2a\x05\x0d\x00\x00\x80\x3e\x32\x02\x08\x08\x48\x02\x51\x9a\x99\x99\x99\x99"
        "\x99\xa9\x3f",
        30);
    v1::RenderOptions message;
    ASSERT_TRUE(message.ParseFromString(stored));
    EXPECT_EQ(refusal(message), "options has field 5, which only protocol version 1 had; ask for the picture anew");
    ASSERT_TRUE(message.ParseFromString(stored.substr(0, 8)));
    EXPECT_EQ(from_message(message).width, 64) << "what both versions have means the same";
    message.GetReflection()->MutableUnknownFields(&message)->AddVarint(4000, 1);
    EXPECT_EQ(refusal(message), "") << "fields of later versions are ignored, as ever";
}

TEST(WireOptions, AbsentFieldsAreTheLibrarysDefaults)
{
    EXPECT_EQ(to_message(from_message(v1::RenderOptions())).SerializeAsString(),
              to_message(RenderOptions{}).SerializeAsString());
    EXPECT_EQ(to_message(from_message(v1::Output())).SerializeAsString(), to_message(OutputFile{}).SerializeAsString());
    EXPECT_EQ(to_message(from_message(v1::Camera())).SerializeAsString(), to_message(Camera{}).SerializeAsString());
    EXPECT_FALSE(from_message(v1::ToneMap()).exposure);
}

TEST(WireOptions, ValuesOutsideTheirRangeAreRefusedByName)
{
    v1::RenderOptions message;
    message.set_splat(static_cast<v1::SplatMethod>(9));
    EXPECT_EQ(refusal(message), "splat is 9, expected one of auto, quads, tiles, gpu-tiles");
    v1::ToneMap tone_map;
    tone_map.set_exposure(std::numeric_limits<float>::quiet_NaN());
    EXPECT_THROW(from_message(tone_map), Error);
}

TEST(WireOptions, ACameraTravelsExactly)
{
    Camera camera = look_at_camera("eye", {1.1, 2.2, 3.3}, {-4, 5, 0.3}, 0.7);
    camera.lens_shift = {0.25, -1.5};
    const Camera back = from_message(to_message(camera));
    EXPECT_EQ(back.world_from_view, camera.world_from_view);
    EXPECT_EQ(back.yfov, camera.yfov);
    EXPECT_EQ(back.lens_shift, camera.lens_shift);
    v1::Camera broken = to_message(camera);
    broken.mutable_world_from_view()->RemoveLast();
    EXPECT_THROW(from_message(broken), Error);
    for (const double shift : {10.5, -11.0, std::numeric_limits<double>::quiet_NaN()}) {
        broken = to_message(camera);
        broken.mutable_lens_shift()->set_up(shift);
        EXPECT_THROW(from_message(broken), Error) << shift;
    }
}

TEST(WireOptions, ACameraPathTravelsAndFramesThatNameNoneLookThroughIt)
{
    CameraPath path{{CameraKey{}, CameraKey{}, CameraKey{}}};
    path.keys[0].eye = {1.5, 2.25, 0.1};
    path.keys[0].up = {0, 0, 1};
    path.keys[1] = {.time = 1.0, .eye = {3, 1, 1}, .target = {0, 1, 0}, .yfov = 0.5};
    path.keys[2] = {.time = 2.0, .camera = "door", .cut = true};
    const v1::CameraPath sent = to_message(path);
    v1::Frame frame;
    frame.mutable_lens_shift()->set_up(0.5);
    const CameraChoice between = camera_choice(frame, sent, 0.3);
    EXPECT_EQ(between.given->world_from_view, camera_at(path, 0.3).given->world_from_view);
    EXPECT_EQ(between.given->yfov, camera_at(path, 0.3).given->yfov);
    EXPECT_EQ(between.lens_shift, glm::dvec2(0.0, 0.5));
    EXPECT_EQ(camera_choice(frame, sent, 2.5).name, "door");
    frame.set_time(2.5);
    EXPECT_EQ(camera_choice(frame, sent).name, "door") << "at its own time";
    frame.set_camera_name("window");
    EXPECT_EQ(camera_choice(frame, sent).name, "window") << "it names one";

    const auto refused = [&](const auto& change, const std::string& name) {
        v1::CameraPath broken = sent;
        change(broken);
        try {
            from_message(broken);
            ADD_FAILURE() << name << " was taken";
        } catch (const Error& e) {
            EXPECT_NE(std::string(e.what()).find(name), std::string::npos) << e.what();
        }
    };
    refused([](auto& p) { p.mutable_keys(1)->mutable_eye()->RemoveLast(); }, "camera_path.keys[1].eye has 2 values");
    refused([](auto& p) { p.mutable_keys(1)->set_time(0.0); }, "camera_path.keys[1].time is 0");
    refused([](auto& p) { p.mutable_keys(0)->set_yfov(4.0); }, "camera_path.keys[0].fov");
}

TEST(WireOptions, WhatMotionIsToldByTravels)
{
    v1::Frame frame;
    frame.mutable_lens_shift()->set_up(0.5);
    MotionChoice choice;
    choice.time = 0.25;
    *frame.mutable_motion() = to_message(choice);
    EXPECT_EQ(motion_choice(frame).time, 0.25);
    EXPECT_FALSE(motion_choice(frame).camera) << "the picture's";
    choice.camera = CameraChoice{"door", {}, {}};
    *frame.mutable_motion() = to_message(choice);
    EXPECT_EQ(motion_choice(frame).camera->name, "door");
    EXPECT_EQ(motion_choice(frame).camera->lens_shift, glm::dvec2(0.0, 0.5)) << "as the picture's camera";
    choice.camera->given = look_at_camera("eye", {1, 2, 3}, {0, 0, 0}, 0.7);
    *frame.mutable_motion() = to_message(choice);
    EXPECT_EQ(motion_choice(frame).camera->given->world_from_view, choice.camera->given->world_from_view);
    frame.mutable_motion()->set_time(std::numeric_limits<double>::infinity());
    EXPECT_THROW(motion_choice(frame), Error);
}

}  // namespace
}  // namespace rcs::service
