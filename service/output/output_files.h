#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "output/stats_json.h"
#include "rcs/image.h"
#include "rcs/image_io.h"
#include "rcs/log.h"
#include "rcs/render.h"
#include "rcs/thread_pool.h"
#include "rcs/tone_map.h"

namespace rcs::service {

/// A file to write; its ending says the format.
struct OutputFile {
    std::string path;
    ImageFileOptions options;
};
bool is_exr(const OutputFile& file);
bool is_png(const OutputFile& file);

/// Sets what a render makes beside beauty to what `files` keep of it.
void render_for(const std::vector<OutputFile>& files, RenderOptions& options);

/// The files that a command or a job was asked for, checked before any work, written after all of it.
class OutputFiles {
public:
    /// @param shows  a tone mapper is wanted even if only EXR files are written
    /// @throws rcs::Error that names the file, display or view
    OutputFiles(std::vector<OutputFile> files, const ToneMapOptions& tone_map, const LogFunction& log,
                bool shows = false);

    /// Tone maps once if any file wants it, then writes the files in the order of the command line.
    /// Adds stages, exposure and the names of the files to `report`.
    /// @throws rcs::Error cancelled, if `progress` says so; io
    /// @param path_of  where a file goes instead; empty: where its path says
    void write(const LayeredImage& image, ThreadPool& pool, const ProgressFunction& progress, RunReport& report,
               const std::function<std::string(const std::string&)>& path_of = {}) const;

    /// Null if only EXR files are written and nothing else is shown.
    ToneMapper* tone_mapper() const noexcept { return tone_mapper_.get(); }

private:
    std::vector<OutputFile> files_;
    std::unique_ptr<ToneMapper> tone_mapper_;
};

}  // namespace rcs::service
