#pragma once

#include <cstdint>
#include <string>

#include <CLI/CLI.hpp>

#include "cli/server_arguments.h"

namespace rcs::service {

/// What commands about one job are told.
struct JobArguments {
    ServerArguments server;
    std::uint64_t job = 0;
    bool json = false;
};

/// What is wrong with a job's number; "": nothing.
std::string job_number_error(const std::string& text);

/// Adds a command with the argument JOB and the options of a server.
CLI::App& add_job_command(CLI::App& app, const char* name, const char* help, JobArguments& arguments);

}  // namespace rcs::service
