#pragma once

#include <vector>

#include <CLI/CLI.hpp>

#include "cli/arguments.h"
#include "output/output_files.h"

namespace rcs::service {

/// What the options of a command line ask for, in their order.
/// @param exr_default  how EXR values are stored unless --pixel-format says otherwise
/// @throws rcs::Error bad_argument that names the option
std::vector<OutputFile> parse_outputs(const OutputArguments& arguments, PixelFormat exr_default);
ToneMapOptions parse_tone_map(const OutputArguments& arguments);

/// As OutputFiles are made. @throws Ended with kBadConfig: the colour configuration is refused
OutputFiles output_files(std::vector<OutputFile> files, const ToneMapOptions& tone_map, const LogFunction& log,
                         bool shows = false);

/// No two of the files that a command writes may be one, however they are spelled.
/// @param command  whose options have been parsed
/// @throws rcs::Error bad_argument that names the options
void check_written_files(const CLI::App& command);

}  // namespace rcs::service
