#include "stability/case_run.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <limits>

#include "rcs/error.h"
#include "rcs/image_io.h"
#include "rcs/ray_scene.h"
#include "stability/export_glb.h"

namespace rcs::stability {

struct CaseRun::Folder {
    std::string path;
    Folder()
    {
        path = (std::filesystem::temp_directory_path() / "rcs-stability-XXXXXX").string();
        if (::mkdtemp(path.data()) == nullptr) throw Error(ErrorCode::io, "cannot make a temporary folder " + path);
    }
    ~Folder()
    {
        std::error_code ignored;
        std::filesystem::remove_all(path, ignored);
    }
    Folder(const Folder&) = delete;
    Folder& operator=(const Folder&) = delete;
};

CaseRun::CaseRun(const StabilityMachine& machine, const StabilityCase& says) : machine_(machine), says_(says) {}

const std::string& CaseRun::folder()
{
    if (!folder_) folder_ = std::make_shared<Folder>();
    return folder_->path;
}

RenderResult CaseRun::render(const Scene& scene, const RenderOptions& options, const std::string& label)
{
    return render(scene, scene.cameras.at(0), options, label, machine_.pool);
}

RenderResult CaseRun::render(const Scene& scene, const Camera& camera, const RenderOptions& options,
                             const std::string& label, ThreadPool& pool, std::vector<Record> cache)
{
    Session session(machine_.gl, pool);
    session.show(scene);
    if (!cache.empty()) session.begin_with(std::move(cache));
    if (!machine_.save_folder.empty() && !scene_) {
        scene_ = scene;
        camera_ = camera;
    }
    RenderOptions with = options;
    with.gather = machine_.gather;
    RenderResult result = rcs::render(session, camera, with);
    check_layers(result, label);
    if (!machine_.save_folder.empty()) pictures_.push_back({label, result.image});
    return result;
}

void CaseRun::check_layers(const RenderResult& result, const std::string& label)
{
    for (const auto& [name, layer] : result.image.layers) {
        std::size_t bad = 0;
        for (const float value : layer.pixels) {
            const bool far = name == "depth" && value == std::numeric_limits<float>::infinity();
            bad += !((std::isfinite(value) || far) && (value >= 0.0f || name == "normal"));
        }
        require(bad == 0,
                label + ": " + std::to_string(bad) + " values of layer " + name + " are negative or not finite");
    }
    require(result.stats.unserved_pixels == 0,
            label + ": " + std::to_string(result.stats.unserved_pixels) + " pixels that no record serves");
}

void CaseRun::figure(double value, const std::string& words)
{
    if (value > figure_ || std::isnan(value) || worst_.empty()) {
        figure_ = std::isnan(value) ? std::numeric_limits<double>::infinity() : value;
        worst_ = words;
    }
}

void CaseRun::require(bool holds, const std::string& words)
{
    if (!holds) wrong_.push_back(words);
}

void CaseRun::skip(const std::string& why) { skipped_ = why; }

void CaseRun::note(const std::string& words) { notes_ += (notes_.empty() ? "" : "; ") + words; }

StabilityOutcome CaseRun::finish()
{
    StabilityOutcome outcome;
    outcome.figure = figure_;
    outcome.measured = worst_;
    if (!notes_.empty()) outcome.measured += (outcome.measured.empty() ? "" : "; ") + notes_;
    for (const std::string& words : wrong_) outcome.measured += (outcome.measured.empty() ? "" : "; ") + words;
    if (!skipped_.empty()) {
        outcome.verdict = StabilityVerdict::skipped;
        outcome.measured = skipped_;
        return outcome;
    }
    const bool passed = wrong_.empty() && figure_ <= says_.tolerance;
    outcome.verdict = passed ? StabilityVerdict::passed : StabilityVerdict::failed;
    if (!passed && !machine_.save_folder.empty()) outcome.saved = save();
    return outcome;
}

/// The scene, the pictures and a page that says what was expected: enough for someone who has not this machine.
std::string CaseRun::save() const
{
    const std::filesystem::path folder = std::filesystem::path(machine_.save_folder) / says_.id;
    std::filesystem::create_directories(folder);
    std::ofstream page(folder / "README.md");
    page << "# " << says_.id << ": " << says_.name << "\n\nExpected: " << says_.expectation << ", to "
         << text_of(says_.tolerance) << " (" << says_.reason << ").\n\nMeasured: " << text_of(figure_) << ". " << worst_
         << "\n";
    for (const std::string& words : wrong_) page << "\n- " << words << "\n";
    page << "\nOpenGL: " << machine_.gl.renderer() << ", " << machine_.gl.version() << "\n";
    if (scene_) {
        const std::string left_out = export_glb(*scene_, (folder / "scene.glb").string());
        page << "\nThe first scene rendered, and its first picture again:\n\n    rcsplat render scene.glb --camera '"
             << camera_->name << "'";
        if (!pictures_.empty()) {
            const Image& beauty = pictures_.front().image.layers.at("beauty");
            page << " --size " << beauty.width << "x" << beauty.height;
        }
        if (camera_->lens_shift != glm::dvec2(0.0))
            page << std::setprecision(17) << " --lens-shift " << camera_->lens_shift.x << "," << camera_->lens_shift.y;
        page << " --aa 1 -o again.exr\n";
        if (!left_out.empty()) page << "\nscene.glb lacks " << left_out << ".\n";
    }
    page << "\nThe case again:\n\n    rcsplat doctor --case " << says_.id << "\n";
    int number = 0;
    for (const Kept& kept : pictures_) {
        const std::string file = std::to_string(number++) + ".exr";
        ImageFileOptions exact;
        exact.format = PixelFormat::full_float;
        write_exr((folder / file).string(), kept.image, exact);
        page << "\n" << file << ": " << kept.label << "\n";
    }
    if (!page.flush()) throw Error(ErrorCode::io, "cannot write to " + folder.string());
    return folder.string();
}

RenderOptions small_options(int size, SplatMethod method)
{
    RenderOptions options;
    options.width = options.height = size;
    options.aa = 1;
    options.splat = method;
    return options;
}

SplatBuffer splat_by(CaseRun& run, SplatMethod method, const std::vector<Record>& records, const GBuffer& gbuffer,
                     const View& view, const SplatSettings& options)
{
    SplatStats ignored;
    if (method == SplatMethod::tiles) return splat_tiles(records, gbuffer, view, options, run.pool(), ignored);
    return (method == SplatMethod::quads ? splat_quads : splat_gpu_tiles)(run.gl(), records, gbuffer, view, options,
                                                                          run.pool(), ignored, nullptr);
}

std::string text_of(double value)
{
    char text[32];
    std::snprintf(text, sizeof text, "%.3g", value);
    return text;
}

}  // namespace rcs::stability
