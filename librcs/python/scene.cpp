// Scenes, cameras and sessions.

#include <cmath>
#include <cstring>
#include <numbers>

#include "binding.h"

namespace rcs::python {
namespace {

using Place = std::array<double, 3>;

glm::dvec3 vector_of(const Place& p) { return {p[0], p[1], p[2]}; }

EnvironmentChoice environment_of(const py::object& environment, double rotation)
{
    EnvironmentChoice choice;
    choice.rotation_degrees = rotation;
    if (environment.is_none()) return choice;
    if (py::isinstance<py::str>(environment)) {
        choice.image = environment.cast<std::string>();
        return choice;
    }
    const Place radiance = environment.cast<Place>();
    for (const double value : radiance)
        if (!(value >= 0.0) || !std::isfinite(value))
            refuse_value("environment", number_text(value), "three finite values of at least 0");
    choice.radiance = glm::vec3(vector_of(radiance));
    return choice;
}

py::array_t<double> matrix_of(const Camera& camera)
{
    py::array_t<double> matrix({4, 4});
    for (int row = 0; row < 4; ++row)
        for (int column = 0; column < 4; ++column) matrix.mutable_at(row, column) = camera.world_from_view[column][row];
    return matrix;
}

std::vector<std::string> camera_names(const Scene& scene)
{
    std::vector<std::string> names;
    for (const Camera& camera : scene.cameras) names.push_back(camera.name);
    return names;
}

std::size_t triangles_of(const Scene& scene)
{
    std::size_t triangles = 0;
    for (const Instance& instance : scene.instances)
        triangles += scene.meshes[static_cast<std::size_t>(instance.mesh)].triangles.size();
    return triangles;
}

}  // namespace

Camera camera_of(const Scene& scene, const py::object& camera)
{
    if (py::isinstance<Camera>(camera)) return camera.cast<Camera>();
    return find_camera(scene, camera.is_none() ? "" : py::str(camera).cast<std::string>());
}

Camera camera_of(const Session& session, const py::object& camera) { return camera_of(session.scene(), camera); }

void bind_scene(py::module_& module)
{
    py::class_<Scene>(module, "Scene", "What is rendered, as load_scene() makes it.")
        .def_property_readonly("name", [](const Scene& s) { return s.name; })
        .def_property_readonly("cameras", &camera_names)
        .def_property_readonly("triangles", &triangles_of);
    module.def(
        "load_scene",
        [](const std::string& source, std::optional<double> time, const py::object& environment, double rotation,
           const std::string& asset_root, const std::string& animation, const py::object& log) {
            const SceneChoice choice{source, time, environment_of(environment, rotation), asset_root, animation};
            Callbacks callbacks(log, py::none());
            return callbacks.run([&] { return load_scene(choice, callbacks.log()); });
        },
        py::arg("source"), py::kw_only(), py::arg("time") = py::none(), py::arg("environment") = py::none(),
        py::arg("environment_rotation") = 0.0, py::arg("asset_root") = "", py::arg("animation") = "",
        py::arg("log") = py::none());
    module.def("demo_scene_names", &demo_scene_names);

    py::class_<Camera>(module, "Camera", "A camera, in the space of its scene.")
        .def_static(
            "look_at",
            [](const Place& eye, const Place& target, double fov, const Place& up) {
                return look_at_camera("camera", vector_of(eye), vector_of(target), fov * std::numbers::pi / 180.0,
                                      vector_of(up));
            },
            py::arg("eye"), py::arg("target"), py::arg("fov") = 45.0, py::arg("up") = Place{0.0, 1.0, 0.0})
        .def_readwrite("name", &Camera::name)
        .def_property_readonly("fov", [](const Camera& c) { return c.yfov * 180.0 / std::numbers::pi; })
        .def_property_readonly("world_from_view", &matrix_of);

    py::class_<Session>(module, "Session", "What lasts from view to view: threads, OpenGL, a scene, its rays.")
        .def(py::init([](int threads, bool keep_records) {
                 return std::make_unique<Session>(SessionOptions{.threads = threads, .keep_records = keep_records});
             }),
             py::kw_only(), py::arg("threads") = 0, py::arg("keep_records") = false)
        .def(
            "show", [](Session& session, const Scene& scene) { session.show(scene); }, py::arg("scene"),
            py::call_guard<py::gil_scoped_release>())
        .def("clear", &Session::clear)
        .def("forget_light", &Session::forget_light)
        .def("camera", py::overload_cast<const Session&, const py::object&>(&camera_of), py::arg("camera") = py::none())
        .def_property_readonly("scene", &Session::scene, py::return_value_policy::reference_internal)
        .def_property_readonly("threads", [](Session& session) { return session.pool().size(); });
}

}  // namespace rcs::python
