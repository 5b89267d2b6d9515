#include "wire/options.h"
#include "wire/scene.h"

#include <fstream>
#include <regex>
#include <sstream>

#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>
#include <gtest/gtest.h>

#include "rcs/error.h"

namespace rcs::service {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

/// "MESSAGE.FIELD" -> what its comment says after "Default".
std::map<std::string, std::string> documented_defaults()
{
    std::ifstream file(RCS_TESTS_DIR "/../proto/rcs/v1/options.proto");
    const std::regex message_line(R"(^message (\w+) \{)"),
        field_line(R"(^    optional [\w.]+ (\w+) = \d+;.*Default ([^ ]+)\.$)");
    std::map<std::string, std::string> defaults;
    std::string message;
    std::smatch found;
    for (std::string line; std::getline(file, line);) {
        if (std::regex_search(line, found, message_line)) message = found[1];
        if (std::regex_search(line, found, field_line)) defaults[message + "." + found[1].str()] = found[2];
    }
    return defaults;
}

std::string text_of(const Message& message, const FieldDescriptor& field)
{
    const auto& reflection = *message.GetReflection();
    std::ostringstream text;
    switch (field.cpp_type()) {
        case FieldDescriptor::CPPTYPE_INT32:
            text << reflection.GetInt32(message, &field);
            break;
        case FieldDescriptor::CPPTYPE_UINT64:
            text << reflection.GetUInt64(message, &field);
            break;
        case FieldDescriptor::CPPTYPE_FLOAT:
            text << reflection.GetFloat(message, &field);
            break;
        case FieldDescriptor::CPPTYPE_DOUBLE:
            text << reflection.GetDouble(message, &field);
            break;
        case FieldDescriptor::CPPTYPE_ENUM:
            text << reflection.GetEnum(message, &field)->name();
            break;
        default:
            ADD_FAILURE() << field.full_name() << " has a type that this test does not know";
    }
    return text.str();
}

/// What takes the place of settings.
bool is_goal(const FieldDescriptor& field)
{
    return field.name() == "target_error" || field.name() == "budget_seconds";
}

int check_defaults(const Message& message, const std::map<std::string, std::string>& documented)
{
    int checked = 0;
    const auto& type = *message.GetDescriptor();
    for (int i = 0; i < type.field_count(); ++i) {
        const FieldDescriptor& field = *type.field(i);
        if (field.is_repeated() || is_goal(field)) continue;
        if (field.cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE) {
            checked += check_defaults(message.GetReflection()->GetMessage(message, &field), documented);
            continue;
        }
        EXPECT_TRUE(message.GetReflection()->HasField(message, &field))
            << field.full_name() << " is not set by the mapping";
        const auto found = documented.find(type.name() + "." + field.name());
        if (found == documented.end()) {
            ADD_FAILURE() << field.full_name() << " has no documented default";
            continue;
        }
        EXPECT_EQ(text_of(message, field), found->second) << field.full_name();
        ++checked;
    }
    return checked;
}

TEST(WireOptions, DefaultsOfTheLibraryAreThoseThatTheProtoDocuments)
{
    EXPECT_EQ(check_defaults(to_message(RenderOptions{}), documented_defaults()), 19);
}

/// Values that no default has, within every range.
RenderOptions unusual_options()
{
    RenderOptions o;
    o.width = 321, o.height = 123, o.aa = 7, o.bounces = 3, o.lobe_rays = 5, o.overlap = 2.5f;
    o.quality = QualitySettings{.error_tolerance = 0.15f, .rays = 77, .noise_target = 0.07f};
    o.min_reach = 9.0f, o.max_reach = 44.0f, o.gradient_limit = 2.0f;
    o.area_samples = 11, o.penumbra_samples = 22, o.lamp_picks = 33;
    o.splat = SplatMethod::quads;
    o.seed = 99;
    o.effects.with.set(Effect::normal_maps);
    o.effects.without.set(Effect::traced_lobes);
    return o;
}

TEST(WireOptions, EveryFieldThereAndBackIsTheSame)
{
    const v1::RenderOptions message = to_message(unusual_options());
    const v1::RenderOptions plain = to_message(RenderOptions{});
    const auto& type = *message.GetDescriptor();
    for (int i = 0; i < type.field_count(); ++i) {
        const FieldDescriptor& field = *type.field(i);
        if (is_goal(field)) continue;
        if (field.is_repeated()) {
            EXPECT_EQ(message.GetReflection()->FieldSize(message, &field), 1) << field.name();
        } else if (field.cpp_type() != FieldDescriptor::CPPTYPE_MESSAGE) {
            EXPECT_NE(text_of(message, field), text_of(plain, field)) << field.name() << " is not mapped";
        }
    }
    const RenderOptions back = from_message(message);
    EXPECT_EQ(to_message(back).SerializeAsString(), message.SerializeAsString());
    EXPECT_EQ(back.gradient_limit, 2.0f);
    EXPECT_EQ(back.effects.with, unusual_options().effects.with);
}

TEST(WireOptions, QualityIsOneOfSettingsTargetAndBudget)
{
    RenderOptions o;
    o.quality = TargetError{0.03};
    EXPECT_EQ(target_error(from_message(to_message(o))), 0.03);
    o.quality = Budget{12.5};
    v1::RenderOptions message = to_message(o);
    EXPECT_EQ(budget_seconds(from_message(message)), 12.5);
    message.mutable_records()->set_rays(64);
    EXPECT_THROW(from_message(message), Error);
    message.clear_budget_seconds();
    message.set_target_error(0.1);
    EXPECT_THROW(from_message(message), Error);
    message.clear_records();
    EXPECT_EQ(target_error(from_message(message)), 0.1);
    message.set_budget_seconds(1.0);
    EXPECT_THROW(from_message(message), Error);
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
    const auto message_of = [](auto change) {
        v1::RenderOptions options;
        change(options);
        try {
            from_message(options);
        } catch (const Error& e) {
            return std::string(e.what());
        }
        return std::string("accepted");
    };
    EXPECT_NE(message_of([](auto& o) { o.set_width(0); }).find("width is 0"), std::string::npos);
    EXPECT_NE(message_of([](auto& o) { o.set_overlap(std::numeric_limits<float>::quiet_NaN()); }).find("overlap"),
              std::string::npos);
    EXPECT_NE(message_of([](auto& o) { o.mutable_records()->set_rays(1 << 30); }).find("rays"), std::string::npos);
    EXPECT_NE(message_of([](auto& o) { o.set_splat(static_cast<v1::SplatMethod>(9)); }).find("splat is 9"),
              std::string::npos);
    EXPECT_NE(message_of([](auto& o) { o.add_with_effects("magic"); }).find("magic"), std::string::npos);
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
