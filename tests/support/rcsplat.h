#pragma once

#include <algorithm>
#include <ostream>
#include <string>
#include <vector>

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>

#include <gtest/gtest.h>

#include "support/temporary_folder.h"

extern char** environ;

/// Runs the real rcsplat, as a user does.
namespace rcs::test {

struct Outcome {
    int code = -1;  ///< exit code, or 128 + signal
    std::string out, err;
};

inline pid_t start(const TemporaryFolder& logs, const std::vector<std::string>& arguments)
{
    std::string program = RCS_BIN_DIR "/rcsplat";
    std::vector<std::string> words = arguments;
    std::vector<char*> argv{program.data()};
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_addopen(&actions, 1, (logs / "out").c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
    posix_spawn_file_actions_addopen(&actions, 2, (logs / "err").c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
    pid_t pid = 0;
    EXPECT_EQ(posix_spawn(&pid, program.c_str(), &actions, nullptr, argv.data(), environ), 0);
    posix_spawn_file_actions_destroy(&actions);
    return pid;
}

inline Outcome finish(pid_t pid, const TemporaryFolder& logs)
{
    int status = 0;
    waitpid(pid, &status, 0);
    return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status), bytes_of(logs / "out"),
            bytes_of(logs / "err")};
}

inline Outcome rcsplat(const std::vector<std::string>& arguments)
{
    const TemporaryFolder logs;
    return finish(start(logs, arguments), logs);
}

/// Any code that says that a command failed for no fault of its arguments: which ones, exit_code_test.cpp says.
struct AnyFailure {
    friend bool operator==(int code, AnyFailure) { return code == 1 || (code >= 64 && code <= 78); }
    friend std::ostream& operator<<(std::ostream& out, AnyFailure) { return out << "the code of a failure"; }
};
inline constexpr AnyFailure kFailure;
inline constexpr int kBadUsage = 2;

/// The command must fail with one line that names `thing`, and leave nothing behind.
template <typename Code>
void expect_error(const std::vector<std::string>& arguments, Code code, const std::string& thing,
                  const TemporaryFolder& folder)
{
    std::vector<std::string> before = folder.names();
    const Outcome outcome = rcsplat(arguments);
    EXPECT_EQ(outcome.code, code) << outcome.err;
    EXPECT_EQ(outcome.err.rfind("rcsplat: error: ", 0), 0u) << outcome.err;
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
    EXPECT_NE(outcome.err.find(thing), std::string::npos) << outcome.err << "does not name " << thing;
    EXPECT_EQ(outcome.out, "");
    std::vector<std::string> after = folder.names();
    std::sort(before.begin(), before.end());
    std::sort(after.begin(), after.end());
    EXPECT_EQ(after, before) << "something was left behind";
}

}  // namespace rcs::test
