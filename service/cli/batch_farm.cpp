#include <algorithm>
#include <cctype>
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include <unistd.h>

#include "batch/farm.h"
#include "batch/frames.h"
#include "cli/batch_frame.h"
#include "cli/batch_run.h"
#include "output/stats_json.h"
#include "process/program.h"
#include "rcs/error.h"

namespace rcs::service {
namespace {

namespace fs = std::filesystem;

/// The words but for the options that say how a batch is parted.
std::vector<std::string> words_of_tasks(const std::vector<std::string>& words)
{
    const std::vector<std::string> with_value{"--engine", "--chunk", "--job-folder"};
    std::vector<std::string> kept;
    for (std::size_t i = 0; i < words.size(); ++i) {
        const std::string name = words[i].substr(0, words[i].find('='));
        if (name == "--no-submit") continue;
        if (std::find(with_value.begin(), with_value.end(), name) == with_value.end())
            kept.push_back(words[i]);
        else if (name == words[i])
            ++i;
    }
    return kept;
}

/// Letters, digits and dashes: a name that every engine takes.
std::string job_name(const std::string& scene)
{
    std::string name = "rcsplat-" + fs::path(scene).stem().string();
    for (char& c : name)
        if (std::isalnum(static_cast<unsigned char>(c)) == 0) c = '-';
    return name.substr(0, 64);
}

FarmJob job_of(const BatchArguments& arguments)
{
    const fs::path first = fs::path(arguments.render.output.files.front()).parent_path();
    const fs::path report = arguments.report_folder.empty() ? first : fs::path(arguments.report_folder);
    FarmJob job;
    job.engine = arguments.engine;
    job.name = job_name(arguments.render.scene.scene);
    job.folder = fs::absolute(arguments.job_folder.empty() ? report / "job" : fs::path(arguments.job_folder))
                     .lexically_normal()
                     .string();
    job.directory = fs::current_path().string();
    job.words = {fs::read_symlink("/proc/self/exe").string(), "batch"};
    const std::vector<std::string> words = words_of_tasks(arguments.words);
    job.words.insert(job.words.end(), words.begin(), words.end());
    job.overture = !arguments.independent;
    if (job.overture)
        job.words.insert(job.words.end(), {"--records", (fs::path(job.folder) / "shot.records").string()});
    job.parts = count_parts(parse_frames(arguments.frames).size(), arguments.chunk);
    job.threads = arguments.render.scene.threads;
    return job;
}

void write_folder(const FarmJob& job)
{
    const auto files = farm_files(job);
    std::error_code failed;
    fs::create_directories(fs::path(job.folder) / "logs", failed);
    if (failed) throw Error(ErrorCode::io, job.folder + ": cannot be made: " + failed.message());
    for (const auto& [name, text] : files) {
        const fs::path file = fs::path(job.folder) / name;
        write_text_file(file.string(), text);
        if (text.starts_with("#!")) fs::permissions(file, fs::perms(0755), failed);
    }
}

}  // namespace

void run_farm(const BatchArguments& arguments)
{
    if (arguments.engine == Engine::slurm && arguments.submits && find_program("sbatch").empty())
        throw Error(ErrorCode::not_found,
                    "--engine slurm: there is no sbatch on this machine; --no-submit writes the job's folder alone");
    ProgressBar bar(parse_log_level(arguments.render.report.log_level), arguments.render.report.quiet);
    const FrameMaker checked(arguments, bar, [] {});
    const FarmJob job = job_of(arguments);
    write_folder(job);
    const std::vector<std::string> start = start_command(job);
    const bool starts = arguments.submits && !start.empty();
    if (!arguments.render.report.quiet || !starts) {
        std::string by = "openjd run " + job.folder + "/template.yaml";
        if (!start.empty()) by.clear();
        for (const std::string& word : start) by.append(by.empty() ? "" : " ").append(word);
        std::printf("%d tasks in %s\n", job.parts, job.folder.c_str());
        if (!starts) std::printf("start them by: %s\n", by.c_str());
        std::fflush(stdout);
    }
    if (!starts) return;
    std::vector<char*> words;
    for (const std::string& word : start) words.push_back(const_cast<char*>(word.c_str()));
    words.push_back(nullptr);
    ::execv(words.front(), words.data());
    throw Error(ErrorCode::io, start.front() + ": cannot be run");
}

}  // namespace rcs::service
