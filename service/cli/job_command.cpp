#include "cli/job_command.h"

namespace rcs::service {

std::string job_number_error(const std::string& text)
{
    const bool is_number = text.find_first_not_of("0123456789") == text.npos && text.size() <= 18 &&
                           text.find_first_not_of('0') != text.npos;
    return is_number ? std::string() : text + " is no number of a job, expected a whole number >= 1";
}

CLI::App& add_job_command(CLI::App& app, const char* name, const char* help, JobArguments& arguments)
{
    CLI::App& command = *app.add_subcommand(name, help);
    command.add_option("job", arguments.job, "Its number, as submit printed it")
        ->required()
        ->type_name("JOB")
        ->check(job_number_error, "");
    add_server_arguments(command, arguments.server);
    return command;
}

}  // namespace rcs::service
