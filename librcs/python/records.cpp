// The halves of radiance cache splatting by themselves: points, records, splats.

#include "binding.h"

namespace rcs::python {
namespace {

constexpr py::ssize_t kRecord = sizeof(Record);

/// One member of all records, as an array that looks at them.
template <glm::vec3 Record::* Member>
py::array vectors(const py::object& self)
{
    const auto& records = self.cast<const PyRecords&>().records;
    if (records.empty()) return py::array_t<float>(std::vector<py::ssize_t>{0, 3});
    return view_of(&(records.front().*Member).x, {static_cast<py::ssize_t>(records.size()), 3},
                   {kRecord, sizeof(float)}, self);
}

template <float Record::* Member>
py::array numbers(const py::object& self)
{
    const auto& records = self.cast<const PyRecords&>().records;
    if (records.empty()) return py::array_t<float>(std::vector<py::ssize_t>{0});
    return view_of(&(records.front().*Member), {static_cast<py::ssize_t>(records.size())}, {kRecord}, self);
}

RecordSettings settings_of(const py::kwargs& given)
{
    RecordSettings settings;
    for (const auto& [name, value] : given) {
        const auto key = name.cast<std::string>();
        if (key == "error_tolerance")
            settings.error_tolerance = value.cast<float>();
        else if (key == "rays")
            settings.rays = value.cast<int>();
        else if (key == "noise_target")
            settings.noise_target = value.cast<float>();
        else if (key == "refinement")
            settings.refinement = value.cast<int>();
        else if (key == "seed")
            settings.seed = value.cast<std::uint64_t>();
        else
            throw Error(ErrorCode::bad_argument,
                        "there is no setting '" + key + "'" +
                            did_you_mean(key, {"error_tolerance", "rays", "noise_target", "refinement", "seed"}));
    }
    validate(settings);
    return settings;
}

std::vector<std::uint32_t> checked_pixels(const PyGBuffer& g,
                                          const py::array_t<std::int64_t, py::array::forcecast>& asked)
{
    std::vector<std::uint32_t> pixels;
    const auto flat = asked.attr("ravel")().cast<py::array_t<std::int64_t>>();
    for (py::ssize_t i = 0; i < flat.size(); ++i) {
        const std::int64_t pixel = flat.at(i);
        if (pixel < 0 || static_cast<std::size_t>(pixel) >= g.gbuffer.size() ||
            !g.gbuffer.covered(static_cast<std::size_t>(pixel)))
            refuse_value("pixels", std::to_string(pixel), "the number of a pixel that sees a surface");
        pixels.push_back(static_cast<std::uint32_t>(pixel));
    }
    return pixels;
}

PySplats splatted(Session& session, const PyRecords& records, const PyGBuffer& g, float error_tolerance, float overlap,
                  const std::string& method)
{
    if (method != "tiles" && method != "quads" && method != "gpu-tiles")
        refuse_value("method", method, "one of tiles, quads, gpu-tiles");
    const SplatSettings settings{error_tolerance, overlap, false};
    PySplats splats;
    const py::gil_scoped_release released;
    if (method == "tiles")
        splats.sums = splat_tiles(records.records, g.gbuffer, g.view, settings, session.pool(), splats.stats);
    else
        splats.sums = (method == "quads" ? splat_quads : splat_gpu_tiles)(
            session.gl(), records.records, g.gbuffer, g.view, settings, session.pool(), splats.stats, nullptr);
    return splats;
}

/// sum w E / sum w, 0 where no record reaches.
py::array irradiance_of(const PySplats& splats)
{
    const SplatBuffer& s = splats.sums;
    py::array_t<float> result({s.height, s.width, 3});
    float* out = result.mutable_data();
    for (std::size_t i = 0; i < s.weight.size(); ++i) {
        const float scale = s.weight[i] > 0.0f ? 1.0f / s.weight[i] : 0.0f;
        out[3 * i] = s.weighted_r[i] * scale;
        out[3 * i + 1] = s.weighted_g[i] * scale;
        out[3 * i + 2] = s.weighted_b[i] * scale;
    }
    return result;
}

template <std::vector<float> GBuffer::* Plane>
py::array plane(const py::object& self)
{
    const auto& g = self.cast<const PyGBuffer&>().gbuffer;
    return view_of(g.*Plane, g.width, g.height, self);
}

template <std::vector<float> SplatBuffer::* Plane>
py::array sums(const py::object& self)
{
    const auto& s = self.cast<const PySplats&>().sums;
    return view_of(s.*Plane, s.width, s.height, self);
}

void bind_gbuffer(py::module_& module)
{
    py::class_<PyGBuffer>(module, "GBuffer", "The points that pixels see, relative to the camera [m].")
        .def_property_readonly("position_x", &plane<&GBuffer::position_x>)
        .def_property_readonly("position_y", &plane<&GBuffer::position_y>)
        .def_property_readonly("position_z", &plane<&GBuffer::position_z>)
        .def_property_readonly("normal_x", &plane<&GBuffer::normal_x>)
        .def_property_readonly("normal_y", &plane<&GBuffer::normal_y>)
        .def_property_readonly("normal_z", &plane<&GBuffer::normal_z>)
        .def_property_readonly("footprint", &plane<&GBuffer::footprint>)
        .def_property_readonly("albedo",
                               [](const py::object& self) {
                                   const auto& g = self.cast<const PyGBuffer&>().gbuffer;
                                   constexpr py::ssize_t kFloat = sizeof(float);
                                   return view_of(&g.albedo.front().x, {g.height, g.width, 3},
                                                  {g.width * 3 * kFloat, 3 * kFloat, kFloat}, self);
                               })
        .def_property_readonly("covered", [](const PyGBuffer& g) {
            py::array_t<bool> covered({g.gbuffer.height, g.gbuffer.width});
            for (std::size_t i = 0; i < g.gbuffer.size(); ++i) covered.mutable_data()[i] = g.gbuffer.covered(i);
            return covered;
        });
    module.def(
        "render_gbuffer",
        [](Session& session, const py::object& camera, int width, int height) {
            const View view{camera_of(session, camera), width, height};
            const py::gil_scoped_release released;
            return PyGBuffer{view, render_gbuffer(session.gl(), session.rays(), view, 1.0f, session.pool())};
        },
        py::arg("session"), py::arg("camera") = py::none(), py::arg("width") = 640, py::arg("height") = 360);
}

}  // namespace

void bind_records(py::module_& module)
{
    bind_gbuffer(module);
    py::class_<PyRecords>(module, "Records", "Irradiance records; the arrays look at them, a row a record.")
        .def("__len__", [](const PyRecords& r) { return r.records.size(); })
        .def_property_readonly("position", &vectors<&Record::position>)
        .def_property_readonly("normal", &vectors<&Record::normal>)
        .def_property_readonly("irradiance", &vectors<&Record::irradiance>)
        .def_property_readonly("harmonic_mean_distance", &numbers<&Record::harmonic_mean_distance>)
        .def_property_readonly("spacing_radius", &numbers<&Record::spacing_radius>)
        .def_property_readonly("noise", &numbers<&Record::noise>);
    module.def(
        "gather_records",
        [](Session& session, const PyGBuffer& g, const py::array_t<std::int64_t, py::array::forcecast>& asked,
           const py::kwargs& given) {
            const RecordSettings settings = settings_of(given);
            const std::vector<std::uint32_t> pixels = checked_pixels(g, asked);
            RecordStats stats;
            const py::gil_scoped_release released;
            PyRecords gathered{gather_records(session.rays(), g.gbuffer, pixels, settings, session.pool(), stats)};
            limit_spacing(gathered.records, settings, session.pool());
            return gathered;
        },
        py::arg("session"), py::arg("gbuffer"), py::arg("pixels"));
    module.def(
        "place_records",
        [](Session& session, const PyGBuffer& g, const py::kwargs& given) {
            const RecordSettings settings = settings_of(given);
            RecordStats stats;
            PyRecords placed;
            Callbacks callbacks{py::none(), py::none()};
            callbacks.run([&] {
                place_records(session.rays(), g.gbuffer, g.view, settings, session.pool(), placed.records, stats,
                              callbacks.progress());
            });
            return placed;
        },
        py::arg("session"), py::arg("gbuffer"));
    py::class_<PySplats>(module, "Splats", "Sums of the records over the pixels.")
        .def_property_readonly("weight", &sums<&SplatBuffer::weight>)
        .def_property_readonly("count", &sums<&SplatBuffer::count>)
        .def_property_readonly("weighted_r", &sums<&SplatBuffer::weighted_r>)
        .def_property_readonly("weighted_g", &sums<&SplatBuffer::weighted_g>)
        .def_property_readonly("weighted_b", &sums<&SplatBuffer::weighted_b>)
        .def_property_readonly("splats", [](const PySplats& s) { return s.stats.splats; })
        .def("irradiance", &irradiance_of);
    module.def("splat", &splatted, py::arg("session"), py::arg("records"), py::arg("gbuffer"), py::kw_only(),
               py::arg("error_tolerance") = 0.2f, py::arg("overlap") = 1.0f, py::arg("method") = "tiles");
}

}  // namespace rcs::python
