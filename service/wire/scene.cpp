#include "wire/scene.h"

#include <cmath>
#include <numbers>
#include <string>

#include "rcs/error.h"
#include "wire/limits.h"

namespace rcs::service {
namespace {

[[noreturn]] void refuse_scene(const std::string& what) { throw Error(ErrorCode::bad_argument, what); }

glm::dvec3 place(const std::string& field, const google::protobuf::RepeatedField<double>& values)
{
    if (values.size() != 3) refuse_scene(field + " has " + std::to_string(values.size()) + " values, expected 3");
    return {values[0], values[1], values[2]};
}

}  // namespace

v1::LensShift to_message(const glm::dvec2& lens_shift)
{
    v1::LensShift m;
    m.set_right(lens_shift.x);
    m.set_up(lens_shift.y);
    return m;
}

glm::dvec2 from_message(const v1::LensShift& m)
{
    for (const double part : {m.right(), m.up()}) check_number("lens_shift", part, kLensShifts);
    return {m.right(), m.up()};
}

v1::Camera to_message(const Camera& camera)
{
    const auto& [name, projection, world_from_view, yfov, ymag, lens_shift] = camera;
    v1::Camera m;
    m.set_name(name);
    m.set_projection(projection == Projection::perspective ? v1::Camera::PROJECTION_PERSPECTIVE
                                                           : v1::Camera::PROJECTION_ORTHOGRAPHIC);
    for (int column = 0; column < 4; ++column) {
        for (int row = 0; row < 4; ++row) m.add_world_from_view(world_from_view[column][row]);
    }
    m.set_yfov(yfov);
    m.set_ymag(ymag);
    *m.mutable_lens_shift() = to_message(lens_shift);
    return m;
}

Camera from_message(const v1::Camera& m)
{
    Camera camera;
    camera.name = m.name();
    camera.projection =
        m.projection() == v1::Camera::PROJECTION_ORTHOGRAPHIC ? Projection::orthographic : Projection::perspective;
    if (m.world_from_view_size() != 0 && m.world_from_view_size() != 16) {
        refuse_scene("world_from_view has " + std::to_string(m.world_from_view_size()) + " values, expected 16");
    }
    for (int i = 0; i < m.world_from_view_size(); ++i) {
        if (!(std::abs(m.world_from_view(i)) <= kLargestCoordinate))
            refuse_scene("world_from_view has the value " + std::to_string(m.world_from_view(i)) +
                         ", expected one in [-1e18, 1e18]");
        camera.world_from_view[i / 4][i % 4] = m.world_from_view(i);
    }
    if (m.has_yfov()) camera.yfov = m.yfov();
    if (m.has_ymag()) camera.ymag = m.ymag();
    if (!(camera.yfov > 0.0 && camera.yfov < std::numbers::pi)) {
        refuse_scene("yfov is " + std::to_string(camera.yfov) + ", expected a value in (0, pi)");
    }
    if (!(camera.ymag > 0.0 && camera.ymag <= kLargestCoordinate)) {
        refuse_scene("ymag is " + std::to_string(camera.ymag) + ", expected a value in (0, 1e18]");
    }
    camera.lens_shift = from_message(m.lens_shift());
    return camera;
}

v1::Environment to_message(const EnvironmentChoice& choice, const std::string& label)
{
    v1::Environment m;
    m.set_label(label);
    m.set_rotation_degrees(choice.rotation_degrees);
    if (choice.radiance) {
        m.mutable_constant()->set_red(choice.radiance->x);
        m.mutable_constant()->set_green(choice.radiance->y);
        m.mutable_constant()->set_blue(choice.radiance->z);
    }
    return m;
}

EnvironmentChoice from_message(const v1::Environment& m, const std::string& image_file)
{
    EnvironmentChoice choice;
    const auto& c = m.constant();
    if (m.has_constant()) choice.radiance = glm::vec3(c.red(), c.green(), c.blue());
    if (m.has_image()) choice.image = image_file;
    choice.rotation_degrees = m.rotation_degrees();
    return choice;
}

v1::CameraPath to_message(const CameraPath& path)
{
    v1::CameraPath m;
    for (const CameraKey& key : path.keys) {
        const auto& [time, camera, eye, target, up, yfov, cut] = key;
        v1::CameraKey& to = *m.add_keys();
        to.set_time(time);
        to.set_camera(camera);
        to.set_yfov(yfov);
        to.set_cut(cut);
        for (int i = 0; i < 3; ++i) to.add_eye(eye[i]), to.add_target(target[i]), to.add_up(up[i]);
    }
    return m;
}

CameraPath from_message(const v1::CameraPath& m)
{
    CameraPath path;
    for (const v1::CameraKey& from : m.keys()) {
        const std::string name = "camera_path.keys[" + std::to_string(path.keys.size()) + "].";
        CameraKey& key = path.keys.emplace_back();
        key.time = from.time();
        key.camera = from.camera();
        key.cut = from.cut();
        if (from.has_yfov()) key.yfov = from.yfov();
        if (!key.camera.empty()) continue;
        key.eye = place(name + "eye", from.eye());
        key.target = place(name + "target", from.target());
        if (from.up_size() > 0) key.up = place(name + "up", from.up());
    }
    try {
        validate(path);
    } catch (const Error& e) {
        refuse_scene(std::string("camera_path.") + e.what());
    }
    return path;
}

CameraChoice camera_choice(const v1::Frame& frame, const v1::CameraPath& path, double time)
{
    CameraChoice choice{frame.camera_name(), {}, {}};
    if (frame.has_camera_given())
        choice.given = from_message(frame.camera_given());
    else if (!frame.has_camera_name() && path.keys_size() > 0)
        choice = camera_at(from_message(path), time);
    if (frame.has_lens_shift()) choice.lens_shift = from_message(frame.lens_shift());
    return choice;
}

CameraChoice camera_choice(const v1::Frame& frame, const v1::CameraPath& path)
{
    return camera_choice(frame, path, frame.time());
}

v1::Motion to_message(const MotionChoice& choice)
{
    v1::Motion m;
    if (choice.time) m.set_time(*choice.time);
    if (choice.camera && choice.camera->given) *m.mutable_camera_given() = to_message(*choice.camera->given);
    if (choice.camera && !choice.camera->given) m.set_camera_name(choice.camera->name);
    return m;
}

MotionChoice motion_choice(const v1::Frame& frame)
{
    const v1::Motion& m = frame.motion();
    MotionChoice choice;
    if (m.has_time()) {
        if (!std::isfinite(m.time())) refuse_scene("motion.time is not finite");
        choice.time = m.time();
    }
    if (m.has_camera_name() || m.has_camera_given()) {
        choice.camera = camera_choice(frame, {});
        choice.camera->name = m.camera_name();
        choice.camera->given.reset();
        if (m.has_camera_given()) choice.camera->given = from_message(m.camera_given());
    }
    return choice;
}

}  // namespace rcs::service
