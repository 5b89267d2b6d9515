#include "service/drills/drill_jobs.h"

#include "output/output_files.h"
#include "rcs/rcs.h"
#include "rcs/scene.h"
#include "stability/export_glb.h"
#include "wire/files.h"
#include "wire/options.h"
#include "wire/outputs.h"
#include "wire/scene.h"
#include "wire/sha256.h"

namespace rcs::test {
namespace {

constexpr const char* kBuiltIn = "demo:cornell";

int side(std::uint64_t number) { return static_cast<int>(10 + number % 7); }

/// Some of the room is always seen: beside it all pictures are alike.
double shift_right(std::uint64_t number) { return 5e-4 * static_cast<double>(number % 997); }

}  // namespace

DrillJobs::DrillJobs(const std::string& folder)
    : folder_(folder), scene_file_(folder + "/cornell.glb"), session_({.threads = 1})
{
    stability::export_glb(load_scene(kBuiltIn), scene_file_);
}

v1::Job DrillJobs::job(std::uint64_t number) const
{
    v1::Job job;
    if (number % 3 == 0) {
        v1::SceneFile& file = *job.mutable_scene()->mutable_files()->add_files();
        file.set_path("cornell.glb");
        const service::FileDigest digest = service::sha256_of_file(scene_file_);
        file.mutable_content()->set_sha256(digest.digest);
        file.mutable_content()->set_size(digest.size);
        job.mutable_scene()->set_label("cornell.glb");
    } else {
        job.mutable_scene()->set_builtin(kBuiltIn);
        job.mutable_scene()->set_label(kBuiltIn);
    }
    job.mutable_environment()->set_label("scene");
    job.mutable_options()->set_width(side(number));
    job.mutable_options()->set_height(side(number));
    job.mutable_options()->set_aa(1);
    job.mutable_options()->set_seed(number + 1);
    job.mutable_tone_map()->set_exposure(0.0f);
    job.add_outputs()->set_name("a.png");
    for (int i = 0; i < (number % 5 == 0 ? 3 : 1); ++i) {
        v1::Frame& frame = *job.add_frames();
        frame.set_number(i);
        frame.mutable_lens_shift()->set_right(shift_right(number));
        frame.mutable_lens_shift()->set_up(0.1 * i);
    }
    job.set_idempotency_key("drill-" + std::to_string(number));
    constexpr double kLongest = 15.0;  // [s]
    job.set_time_limit_seconds(kLongest);
    return job;
}

std::vector<std::string> DrillJobs::submit_words(std::uint64_t number, const std::string& output)
{
    const std::string size = std::to_string(side(number));
    return {"submit",       kBuiltIn, "--size",       size + "x" + size,
            "--aa",         "1",      "--seed",       std::to_string(number + 1),
            "--exposure",   "0",      "--lens-shift", std::to_string(shift_right(number)) + ",0",
            "--time-limit", "15",     "--key",        "drill-" + std::to_string(number),
            "-q",           "-o",     output};
}

std::vector<std::string> DrillJobs::expected(std::uint64_t number)
{
    const v1::Job job = this->job(number);
    if (shown_ != job.scene().label()) {
        session_.show(load_scene(job.scene().has_files() ? scene_file_ : kBuiltIn));
        shown_ = job.scene().label();
    }
    std::vector<std::string> digests;
    for (const v1::Frame& frame : job.frames()) digests.push_back(render_frame(job, frame));
    return digests;
}

std::string DrillJobs::render_frame(const v1::Job& job, const v1::Frame& frame)
{
    std::vector<service::OutputFile> files{service::from_message(job.outputs(0))};
    files.front().path = folder_ + "/expected.png";
    RenderOptions options = service::from_message(job.options());
    service::render_for(files, options);
    const service::OutputFiles outputs(files, service::from_message(job.tone_map()), {});
    const Camera camera = choose_camera(session_.scene(), service::camera_choice(frame, {}));
    RenderResult result = render(session_, camera, options, {});
    result.image.metadata["rcs:scene"] = job.scene().label();
    result.image.metadata["rcs:environment"] = job.environment().label();
    service::RunReport report;
    outputs.write(result.image, session_.pool(), [](std::string_view, float) { return true; }, report);
    return service::sha256_of_file(files.front().path).digest;
}

}  // namespace rcs::test
