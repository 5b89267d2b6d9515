#include "binding.h"

namespace rcs::python {

py::array view_of(const float* data, std::vector<py::ssize_t> shape, std::vector<py::ssize_t> strides,
                  const py::object& owner)
{
    py::array array(py::dtype::of<float>(), std::move(shape), std::move(strides), data, owner);
    array.attr("flags").attr("writeable") = false;
    return array;
}

py::array view_of(const Image& image, const py::object& owner)
{
    constexpr py::ssize_t kFloat = sizeof(float);
    const py::ssize_t width = image.width, height = image.height, channels = image.channels;
    if (channels == 1) return view_of(image.pixels.data(), {height, width}, {width * kFloat, kFloat}, owner);
    return view_of(image.pixels.data(), {height, width, channels},
                   {width * channels * kFloat, channels * kFloat, kFloat}, owner);
}

py::array view_of(const std::vector<float>& plane, int width, int height, const py::object& owner)
{
    constexpr py::ssize_t kFloat = sizeof(float);
    if (plane.empty()) return py::array_t<float>(std::vector<py::ssize_t>{0, 0});
    return view_of(plane.data(), {height, width}, {width * kFloat, kFloat}, owner);
}

LogFunction Callbacks::log()
{
    if (log_.is_none()) return {};
    return [this](LogLevel level, std::string_view line) {
        const py::gil_scoped_acquire held;
        const char* const names[] = {"debug", "info", "warning"};
        try {
            log_(names[static_cast<std::size_t>(level)], std::string(line));
        } catch (const py::error_already_set&) {
            raised_ = std::current_exception();
        }
    };
}

ProgressFunction Callbacks::progress()
{
    return [this](std::string_view stage, float fraction) {
        const py::gil_scoped_acquire held;
        try {
            if (PyErr_CheckSignals() != 0) throw py::error_already_set();
            if (!progress_.is_none()) progress_(std::string(stage), fraction);
        } catch (const py::error_already_set&) {
            raised_ = std::current_exception();
        }
        return raised_ == nullptr;
    };
}

MomentFunction Callbacks::moments(const py::object& function, const Session& session)
{
    return [this, &function, &session](double part) {
        const py::gil_scoped_acquire held;
        try {
            py::object seen = function(part);
            Moment moment;
            if (py::isinstance<py::tuple>(seen)) {
                const auto both = seen.cast<py::tuple>();
                if (both.size() != 2 || !py::isinstance<Scene>(both[0]))
                    refuse_value("moments(part)", py::repr(seen).cast<std::string>(),
                                 "a camera, or a scene and a camera");
                moment.scene = both[0].cast<const Scene&>();
                seen = both[1];
            }
            moment.camera = camera_of(moment.scene ? *moment.scene : session.scene(), seen);
            return moment;
        } catch (const py::error_already_set&) {
            raised_ = std::current_exception();
        }
        throw Error(ErrorCode::cancelled, "moments() raised an error");
    };
}

namespace {

const char* name_of(ErrorCode code)
{
    switch (code) {
        case ErrorCode::bad_argument:
            return "bad_argument";
        case ErrorCode::not_found:
            return "not_found";
        case ErrorCode::bad_file:
            return "bad_file";
        case ErrorCode::unsupported:
            return "unsupported";
        case ErrorCode::gl_unavailable:
            return "gl_unavailable";
        case ErrorCode::io:
            return "io";
        case ErrorCode::out_of_memory:
            return "out_of_memory";
        case ErrorCode::cancelled:
            return "cancelled";
        case ErrorCode::internal:
            return "internal";
    }
    return "internal";
}

/// rcs.Error, with the code of the library's as its attribute `code`.
void bind_error(py::module_& module)
{
    static const py::object type = py::reinterpret_steal<py::object>(PyErr_NewExceptionWithDoc(
        "rcs.Error", "What librcs refuses or fails at, in one sentence; `code` says of which kind it is.",
        PyExc_RuntimeError, nullptr));
    module.attr("Error") = type;
    py::register_exception_translator([](std::exception_ptr thrown) {
        try {
            std::rethrow_exception(std::move(thrown));
        } catch (const Error& e) {
            py::object error = type(e.what());
            error.attr("code") = name_of(e.code());
            PyErr_SetObject(type.ptr(), error.ptr());
        }
    });
}

}  // namespace
}  // namespace rcs::python

PYBIND11_MODULE(_rcs, module)
{
    module.attr("__version__") = rcs::kVersion;
    rcs::python::bind_error(module);
    rcs::python::bind_scene(module);
    rcs::python::bind_render(module);
    rcs::python::bind_records(module);
}
