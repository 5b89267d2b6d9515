#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "options.h"
#include "rcs/image.h"
#include "rcs/image_io.h"
#include "rcs/log.h"
#include "rcs/thread_pool.h"
#include "rcs/tone_map.h"
#include "stats_json.h"

namespace rcs::service {

/// The files that a command was asked for, checked before any work, written after all of it.
class OutputFiles {
public:
    /// @param exr_default  how EXR values are stored unless --pixel-format says otherwise
    /// @throws rcs::Error that names the file, option, display or view
    OutputFiles(const OutputArguments& arguments, PixelFormat exr_default, const LogFunction& log);

    /// Tone maps once if any file wants it, then writes the files in the order of the command line.
    /// Adds stages, exposure and the names of the files to `report`.
    void write(const LayeredImage& image, ThreadPool& pool, const ProgressFunction& progress,
               RunReport& report) const;

private:
    struct File {
        std::string path;
        ImageFileOptions options;
        bool is_exr = false;
    };
    std::vector<File> files_;
    std::unique_ptr<ToneMapper> tone_mapper_;  ///< null if only EXR files are written
};

}  // namespace rcs::service
