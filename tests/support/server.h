#pragma once

#include <chrono>
#include <csignal>
#include <string>
#include <thread>
#include <vector>

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include "client/client.h"
#include "support/temporary_folder.h"
#include "wire/errors.h"

extern char** environ;

/// A real rcsplat serve in a folder of its own.
namespace rcs::test {

class TestServer {
public:
    /// @param options  beside --socket and --state
    /// @param before  a command that runs another one, as env does
    explicit TestServer(const std::string& folder, std::vector<std::string> options = {},
                        std::vector<std::string> before = {})
        : folder_(folder), options_(std::move(options)), before_(std::move(before))
    {
        start();
    }
    ~TestServer() { end(SIGKILL); }
    TestServer(const TestServer&) = delete;
    TestServer& operator=(const TestServer&) = delete;

    void start()
    {
        std::vector<std::string> words = before_;
        words.insert(words.end(), {RCS_BIN_DIR "/rcsplat", "serve", "--socket", socket(), "--state", state()});
        words.insert(words.end(), options_.begin(), options_.end());
        std::vector<char*> argv;
        for (std::string& word : words) argv.push_back(word.data());
        argv.push_back(nullptr);
        posix_spawn_file_actions_t actions;
        posix_spawn_file_actions_init(&actions);
        posix_spawn_file_actions_addopen(&actions, 2, log_path().c_str(), O_WRONLY | O_CREAT | O_APPEND, 0600);
        if (::posix_spawnp(&pid_, argv[0], &actions, nullptr, argv.data(), environ) != 0)
            throw std::runtime_error("cannot start rcsplat");
        posix_spawn_file_actions_destroy(&actions);
        for (int i = 0; i < 1000; ++i) {
            try {
                service::Client{socket()};
                return;
            } catch (const service::ServiceError&) {
                std::this_thread::sleep_for(std::chrono::milliseconds(20));
                if (::waitpid(pid_, nullptr, WNOHANG) == pid_) break;
            }
        }
        throw std::runtime_error("rcsplat serve does not answer: " + log());
    }
    /// @return the exit code, or 128 + signal
    int end(int signal)
    {
        if (pid_ == 0) return 0;
        int status = 0;
        ::kill(pid_, signal);
        ::waitpid(pid_, &status, 0);
        pid_ = 0;
        return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    }
    void restart_after(int signal)
    {
        end(signal);
        start();
    }

    /// Of the next start.
    void add_options(const std::vector<std::string>& more)
    {
        options_.insert(options_.end(), more.begin(), more.end());
    }

    pid_t pid() const { return pid_; }
    std::string socket() const { return folder_ + "/run/socket"; }
    std::string state() const { return folder_ + "/state"; }
    std::string log_path() const { return folder_ + "/log"; }
    std::string log() const { return bytes_of(log_path()); }

    /// The number after the last `key` of the log; 0 if there is none.
    long last_number(const std::string& key) const
    {
        const std::string text = log();
        const std::size_t at = text.rfind(key);
        return at == text.npos ? 0 : std::atol(text.c_str() + at + key.size());
    }
    pid_t worker() const { return static_cast<pid_t>(last_number("event=worker_ready pid=")); }

private:
    std::string folder_;
    std::vector<std::string> options_, before_;
    pid_t pid_ = 0;
};

/// A job that takes some 0.1 s.
inline v1::Job small_job(int size = 16)
{
    v1::Job job;
    job.mutable_scene()->set_builtin("demo:cornell");
    job.mutable_options()->set_width(size);
    job.mutable_options()->set_height(size);
    job.mutable_options()->set_aa(1);
    job.add_outputs()->set_name("a.png");
    return job;
}

/// One that goes on for minutes unless it is stopped.
inline v1::Job long_job()
{
    v1::Job job = small_job(2000);
    job.mutable_options()->set_aa(64);
    job.mutable_options()->mutable_settings()->set_rays(4096);
    job.mutable_options()->set_bounces(8);
    return job;
}

}  // namespace rcs::test
