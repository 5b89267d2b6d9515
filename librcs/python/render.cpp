// Pictures: rendered, traced, compared, read and written.

#include <cstring>
#include <utility>

#include "binding.h"

namespace rcs::python {
namespace {

/// What the library's option table takes: 0.05, "5%", "tiles", ["traced-lobes"].
std::string text_of_argument(const py::handle& value)
{
    if (!py::isinstance<py::list>(value) && !py::isinstance<py::tuple>(value)) return py::str(value);
    std::string text;
    for (const py::handle each : value) text.append(text.empty() ? "" : ",").append(py::str(each).cast<std::string>());
    return text;
}

const OptionInfo& option_of(const std::string& key)
{
    std::vector<std::string> keys;
    for (const OptionInfo& option : option_table()) {
        if (option.key == key) return option;
        keys.emplace_back(option.key);
    }
    throw Error(ErrorCode::bad_argument, "there is no option '" + key + "'" + did_you_mean(key, keys));
}

py::dict stats_of(const RenderStats& stats)
{
    py::dict stages, result;
    for (const auto& [stage, seconds] : stats.stage_seconds)
        stages[py::str(stage)] = seconds + (stages.contains(stage) ? stages[py::str(stage)].cast<double>() : 0.0);
    const auto error = [](const ErrorEstimate& e) {
        py::dict errors;
        errors["mean_relative"] = e.mean_relative;
        errors["median_relative"] = e.median_relative;
        errors["p95_relative"] = e.p95_relative;
        return errors;
    };
    result["stage_seconds"] = stages;
    result["records"] = stats.records.records;
    result["hemisphere_rays"] = stats.records.hemisphere_rays;
    result["splats"] = stats.splats.splats;
    result["splat_method"] = stats.splat_method;
    result["gather_method"] = stats.gather_method;
    result["gl_renderer"] = stats.gl_renderer;
    result["threads"] = stats.threads;
    result["unserved_pixels"] = stats.unserved_pixels;
    result["image_error"] = error(stats.errors.image);
    result["indirect_error"] = error(stats.errors.indirect);
    return result;
}

py::dict layers_of(const py::object& picture)
{
    py::dict layers;
    for (const auto& [name, layer] : picture.cast<const LayeredImage&>().layers)
        layers[py::str(name)] = view_of(layer, picture);
    return layers;
}

/// A copy of an array of height x width x channels, or height x width.
Image image_of(const py::array_t<float, py::array::c_style | py::array::forcecast>& array)
{
    if (array.ndim() != 2 && array.ndim() != 3)
        refuse_value("image", std::to_string(array.ndim()) + " dimensions",
                     "height x width, or height x width x channels");
    const auto channels = array.ndim() == 3 ? array.shape(2) : 1;
    if (channels != 1 && channels != 3 && channels != 4)
        refuse_value("image", std::to_string(channels) + " channels", "1, 3 or 4");
    Image image(static_cast<int>(array.shape(1)), static_cast<int>(array.shape(0)), static_cast<int>(channels));
    std::memcpy(image.pixels.data(), array.data(), image.pixels.size() * sizeof(float));
    return image;
}

LayeredImage picture_of(const py::object& from, const std::string& layer)
{
    if (py::isinstance<LayeredImage>(from)) return from.cast<LayeredImage>();
    LayeredImage picture;
    picture.layers[layer] = image_of(from.cast<py::array>());
    return picture;
}

py::dict compared(const py::object& image, const py::object& reference, const std::string& layer)
{
    const LayeredImage a = picture_of(image, layer), b = picture_of(reference, layer);
    const ErrorMetrics metrics = [&] {
        const py::gil_scoped_release released;
        return compare_images(a, b, layer);
    }();
    py::dict result;
    for (const MetricRow& row : metric_table()) result[row.name] = metrics.*row.value;
    result["pixels"] = metrics.pixels;
    result["not_finite"] = metrics.not_finite;
    return result;
}

void write(const std::string& path, const py::object& picture, Session* session)
{
    const LayeredImage image = picture_of(picture, "beauty");
    check_output_path(path, {});
    const py::gil_scoped_release released;
    if (path.ends_with(".exr")) return write_exr(path, image);
    ThreadPool alone(1);
    const ToneMapper mapper(ToneMapOptions{});
    write_display_image(path, mapper.apply(image.layers.at("beauty"), session != nullptr ? session->pool() : alone));
}

struct ReferenceArguments {
    ReferenceOptions options;
    int width, height;
    std::optional<std::array<int, 4>> crop;
    std::optional<double> f_stop, focus;
};

View view_of(const ReferenceArguments& given)
{
    RenderOptions asked;  // whose rules a window and a lens have to keep
    asked.width = given.width, asked.height = given.height, asked.aa = given.options.aa;
    asked.f_stop = given.f_stop, asked.focus = given.focus;
    if (given.crop) asked.crop = Crop{(*given.crop)[0], (*given.crop)[1], (*given.crop)[2], (*given.crop)[3]};
    validate(asked);
    View view{Camera{}, given.width, given.height};
    if (!asked.crop) return view;
    view.width = asked.crop->width, view.height = asked.crop->height;
    view.corner = {asked.crop->x, asked.crop->y}, view.whole = {given.width, given.height};
    return view;
}

LayeredImage reference(Session& session, const py::object& camera, const ReferenceArguments& given,
                       const py::object& moments, const py::object& progress)
{
    View view = view_of(given);
    view.camera = camera_of(session, camera);
    Callbacks callbacks(py::none(), progress);
    std::function<Lens(const Camera&)> lens;
    if (given.f_stop) lens = [&](const Camera& c) { return lens_of(c, *given.f_stop, *given.focus); };
    return callbacks.run([&] {
        if (moments.ptr() != Py_None)
            return render_reference(session, callbacks.moments(moments, session), view, given.options, lens,
                                    callbacks.progress());
        ReferenceOptions own = given.options;
        if (lens) own.lens = lens(view.camera);
        return render_reference(session.rays(), view, own, session.pool(), callbacks.progress());
    });
}

}  // namespace

RenderOptions render_options(const py::kwargs& given)
{
    RenderOptions options;
    std::vector<const OptionInfo*> named;
    for (const auto& [key, value] : given) {
        if (key.cast<std::string>() == "layers") continue;
        named.push_back(&option_of(key.cast<std::string>()));
    }
    check_quality(named);
    for (const OptionInfo* option : named)
        set_from_text(*option, options, text_of_argument(given[std::string(option->key).c_str()]));
    if (given.contains("layers")) {
        options.layers.emplace();
        for (const py::handle name : given["layers"])
            options.layers->emplace_back(find_layer(py::str(name).cast<std::string>()).name);
    }
    validate(options);
    return options;
}

void bind_render(py::module_& module)
{
    py::class_<LayeredImage>(module, "Picture", "Layers of one view, scene-linear.")
        .def_property_readonly("layers", &layers_of)
        .def("__getitem__",
             [](const py::object& self, const std::string& name) {
                 const auto& layers = self.cast<const LayeredImage&>().layers;
                 const auto found = layers.find(name);
                 if (found == layers.end()) throw py::key_error("the picture has no layer '" + name + "'");
                 return view_of(found->second, self);
             })
        .def_property_readonly("metadata", [](const LayeredImage& image) { return image.metadata; });
    py::class_<PyResult>(module, "RenderResult", "A picture, the records it was made from, and what it took.")
        .def_readonly("picture", &PyResult::picture)
        .def_readonly("records", &PyResult::records)
        .def_property_readonly("stats", [](const PyResult& r) { return stats_of(r.stats); });
    module.def(
        "render",
        [](Session& session, const py::object& camera, const py::object& moments, const py::object& log,
           const py::object& progress, const py::kwargs& given) {
            const RenderOptions options = render_options(given);
            const Camera view = camera_of(session, camera);
            Callbacks callbacks(log, progress);
            return callbacks.run([&] {
                const RenderHooks hooks{.log = callbacks.log(), .progress = callbacks.progress()};
                RenderResult result = moments.ptr() == Py_None
                                          ? render(session, view, options, hooks)
                                          : render(session, callbacks.moments(moments, session), options, hooks);
                return PyResult{std::move(result.image), {std::move(result.records)}, std::move(result.stats)};
            });
        },
        py::arg("session"), py::arg("camera") = py::none(), py::kw_only(), py::arg("moments") = py::none(),
        py::arg("log") = py::none(), py::arg("progress") = py::none());
    module.def(
        "render_reference",
        [](Session& session, const py::object& camera, int width, int height, int samples, int bounces, int aa,
           int stride, std::uint64_t seed, std::optional<std::array<int, 4>> crop, std::optional<double> f_stop,
           std::optional<double> focus, const py::object& moments, const py::object& progress) {
            const ReferenceOptions options{
                .samples = samples, .bounces = bounces, .aa = aa, .stride = stride, .seed = seed};
            return reference(session, camera, {options, width, height, crop, f_stop, focus}, moments, progress);
        },
        py::arg("session"), py::arg("camera") = py::none(), py::kw_only(), py::arg("width") = 1000,
        py::arg("height") = 1000, py::arg("samples") = 1024, py::arg("bounces") = 1, py::arg("aa") = 1,
        py::arg("stride") = 1, py::arg("seed") = 1, py::arg("crop") = py::none(), py::arg("f_stop") = py::none(),
        py::arg("focus") = py::none(), py::arg("moments") = py::none(), py::arg("progress") = py::none());
    module.def("compare", &compared, py::arg("image"), py::arg("reference"), py::arg("layer") = "beauty");
    module.def("write", &write, py::arg("path"), py::arg("picture"), py::arg("session") = py::none());
    module.def("read", &read_image, py::arg("path"), py::call_guard<py::gil_scoped_release>());
    module.def("option_keys", [] {
        std::vector<std::string> keys;
        for (const OptionInfo& option : option_table()) keys.emplace_back(option.key);
        return keys;
    });
}

}  // namespace rcs::python
