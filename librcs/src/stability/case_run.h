#pragma once

#include <functional>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "rcs/splat.h"
#include "rcs/stability.h"
#include "stability/measures.h"

namespace rcs::stability {

inline constexpr double kPi = std::numbers::pi;

/// What a case works with: renders, and a note of what was measured and what was wrong.
class CaseRun {
public:
    CaseRun(const StabilityMachine& machine, const StabilityCase& says);

    GlContext& gl() const { return machine_.gl; }
    ThreadPool& pool() const { return machine_.pool; }
    const std::string& program() const { return machine_.program; }
    GatherMethod gather() const { return machine_.gather; }

    /// Renders the scene's first camera. Whatever is not finite or negative in any layer, and any pixel that no record
    /// serves, is noted as wrong. The picture is kept for the reproducer. @param label  of it
    RenderResult render(const Scene& scene, const RenderOptions& options, const std::string& label = "picture");
    RenderResult render(const Scene& scene, const Camera& camera, const RenderOptions& options,
                        const std::string& label, ThreadPool& pool, std::vector<Record> cache = {});

    /// Notes a deviation; the worst one is the case's figure. NaN is worse than anything.
    void figure(double value, const std::string& words);
    /// Notes what does not hold.
    void require(bool holds, const std::string& words);
    void skip(const std::string& why);
    /// Adds to the words, whatever the outcome.
    void note(const std::string& words);

    /// A folder of its own, removed at the end.
    const std::string& folder();

    StabilityOutcome finish();

private:
    struct Kept {
        std::string label;
        LayeredImage image;
    };
    void check_layers(const RenderResult& result, const std::string& label);
    std::string save() const;

    const StabilityMachine& machine_;
    const StabilityCase& says_;
    double figure_ = 0.0;
    std::string worst_, notes_, skipped_;
    std::vector<std::string> wrong_;
    std::vector<Kept> pictures_;
    std::optional<Scene> scene_;
    std::optional<Camera> camera_;
    struct Folder;
    std::shared_ptr<Folder> folder_;
};

/// A row of the catalogue with what runs it.
struct SuiteCase {
    StabilityCase says;
    std::function<void(CaseRun&)> run;
};
// One a file of this folder.
std::vector<SuiteCase> light_transport_cases();
std::vector<SuiteCase> record_cases();
std::vector<SuiteCase> record_scene_cases();
std::vector<SuiteCase> view_cases();
std::vector<SuiteCase> geometry_cases();
std::vector<SuiteCase> geometry_file_cases();
std::vector<SuiteCase> light_and_material_cases();
std::vector<SuiteCase> time_cases();
std::vector<SuiteCase> machine_cases();

/// Small pictures at pixel centres with the options' defaults otherwise.
RenderOptions small_options(int size, SplatMethod method = SplatMethod::tiles);

inline constexpr SplatMethod kSplatMethods[] = {SplatMethod::tiles, SplatMethod::quads, SplatMethod::gpu_tiles};
/// Sums records by that method.
SplatBuffer splat_by(CaseRun& run, SplatMethod method, const std::vector<Record>& records, const GBuffer& gbuffer,
                     const View& view, const SplatSettings& options);
/// "0.00123", three digits.
std::string text_of(double value);

}  // namespace rcs::stability
