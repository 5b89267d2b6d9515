#pragma once

#include <array>
#include <exception>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "rcs/rcs.h"
#include "rcs/suggestion.h"

/// librcs in Python: objects stay in C++, arrays of numpy look at their memory.
namespace rcs::python {

namespace py = pybind11;

/// Points with the view that they are seen in.
struct PyGBuffer {
    View view;
    GBuffer gbuffer;
};
struct PyRecords {
    std::vector<Record> records;
};
struct PyResult {
    LayeredImage picture;
    PyRecords records;
    RenderStats stats;
};
struct PySplats {
    SplatBuffer sums;
    SplatStats stats;
};

/// An array that looks at memory which `owner` keeps. Strides in bytes.
py::array view_of(const float* data, std::vector<py::ssize_t> shape, std::vector<py::ssize_t> strides,
                  const py::object& owner);
/// A plane or interleaved values, row by row.
py::array view_of(const Image& image, const py::object& owner);
py::array view_of(const std::vector<float>& plane, int width, int height, const py::object& owner);

/// Python's functions as the library calls them, from a thread that has let go of the interpreter. What they raise, and
/// Ctrl-C, stops the library and is raised again by run().
class Callbacks {
public:
    Callbacks(py::object log, py::object progress) : log_(std::move(log)), progress_(std::move(progress)) {}
    LogFunction log();
    ProgressFunction progress();
    /// A function of a part of the time: a camera, or a scene and a camera. @param function  outlives what is returned
    MomentFunction moments(const py::object& function, const Session& session);

    /// Calls `work` without the interpreter's lock.
    template <typename Work>
    auto run(const Work& work)
    {
        try {
            const py::gil_scoped_release released;
            return work();
        } catch (const Error&) {
            if (raised_) std::rethrow_exception(raised_);
            throw;
        }
    }

private:
    py::object log_, progress_;
    std::exception_ptr raised_;
};

/// Options by their keys in the option table, as numbers or texts. @throws Error bad_argument
RenderOptions render_options(const py::kwargs& given);
/// A name, a number, a Camera, or None for the first one.
Camera camera_of(const Scene& scene, const py::object& camera);
Camera camera_of(const Session& session, const py::object& camera);

void bind_scene(py::module_& module);
void bind_render(py::module_& module);
void bind_records(py::module_& module);

}  // namespace rcs::python
