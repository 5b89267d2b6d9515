#include "cli/batch_nights.h"

#include <filesystem>

#include "batch/frame_record.h"
#include "batch/report.h"
#include "process/clock.h"
#include "rcs/error.h"

namespace rcs::service {

namespace fs = std::filesystem;

void begin_night(BatchArguments& arguments)
{
    OutputArguments& output = arguments.render.output;
    arguments.nightly.outputs = output.files;
    arguments.nightly.report_folder = arguments.report_folder.empty()
                                          ? fs::path(output.files.front()).parent_path().string()
                                          : arguments.report_folder;
    if (arguments.keep_nights > 0 && !has_night(output.files.front()))
        throw Error(ErrorCode::bad_argument,
                    "--keep-nights needs {night} in the first --output, such as frames/{night}/beauty.####.exr: " +
                        output.files.front() + " is each night's");
    arguments.night = night_of(read_clocks().wall_ms);
    for (std::string& file : output.files) file = at_night(file, arguments.night);
    for (std::string* folder : {&arguments.report_folder, &arguments.job_folder})
        *folder = at_night(*folder, arguments.night);
}

std::vector<std::string> remove_old_nights(const BatchArguments& arguments, bool really)
{
    std::vector<std::string> lines;
    if (arguments.keep_nights == 0) return lines;
    std::vector<std::string> nights = nights_of(arguments.nightly.outputs.front());
    std::erase_if(nights, [&](const std::string& night) { return night >= arguments.night; });
    const auto kept = static_cast<std::size_t>(arguments.keep_nights - 1);  // and this one
    for (std::size_t i = 0; i + kept < nights.size(); ++i) {
        const OldNight old = remove_night(arguments.nightly, nights[i], really);
        if (old.files > 0 || !old.left.empty()) lines.push_back(to_text(old, really));
    }
    return lines;
}

void note_report(const BatchArguments& arguments, const std::string& folder)
{
    if (!has_night(arguments.nightly.report_folder)) return;
    FrameRecord note;
    for (const std::string& name : report_files()) {
        std::error_code failed;
        const std::string file = (fs::path(folder) / name).string();
        const auto bytes = fs::file_size(file, failed);
        if (!failed) note.files.push_back({name, bytes, "", file_hash(file)});
    }
    fs::create_directories(fs::path(report_record_path(folder)).parent_path());
    write_frame_record(report_record_path(folder), note);
}

}  // namespace rcs::service
