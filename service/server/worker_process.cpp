#include "server/worker_process.h"

#include <chrono>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <sstream>
#include <thread>

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include "process/exit_code.h"
#include "process/program.h"

namespace rcs::service {
namespace {

constexpr int kSocketInWorker = 3;
constexpr int kLongestEnd = 5000;  // of an srun that was told to end [ms]

std::vector<std::string> words_of_worker(const ServerConfig& config, const std::string& home)
{
    std::vector<std::string> words{"worker", "--threads", std::to_string(config.threads), "--state", config.state,
                                   "--home", home};
    for (const std::string& root : config.roots) words.insert(words.end(), {"--root", root});
    return words;
}

/// One step, whose input and output srun passes on as they are: a worker speaks by them as by its socket.
std::vector<std::string> words_of_srun(const ServerConfig& config)
{
    std::vector<std::string> words{find_program("srun"), "--chdir=/", "--job-name=rcsplat-worker"};
    if (config.threads > 0) words.push_back("--cpus-per-task=" + std::to_string(config.threads));
    std::istringstream more(config.srun_options);
    for (std::string word; more >> word;) words.push_back(word);
    // What comes last holds.
    words.insert(words.end(), {"--nodes=1", "--ntasks=1", "--unbuffered", "--quiet"});
    words.push_back(std::filesystem::read_symlink("/proc/self/exe").string());
    return words;
}

/// It goes with its server, by this signal.
void tie_to(pid_t server, int signal)
{
    ::prctl(PR_SET_PDEATHSIG, signal);
    if (::getppid() != server) ::_exit(1);
    sigset_t none;
    sigemptyset(&none);
    ::sigprocmask(SIG_SETMASK, &none, nullptr);
}

/// What happens between fork and exec: only what is safe there.
[[noreturn]] void become_worker(int socket, char* const* words)
{
    const int null = ::open("/dev/null", O_RDWR);
    ::dup2(null, 0);
    ::dup2(null, 1);
    ::dup2(socket, kSocketInWorker);  // of the same number the copy keeps close-on-exec, which is undone
    ::fcntl(kSocketInWorker, F_SETFD, 0);
    const rlimit no_core{0, 0};
    ::setrlimit(RLIMIT_CORE, &no_core);
    const int score = ::open("/proc/self/oom_score_adj", O_WRONLY | O_CLOEXEC);
    if (score >= 0) {
        [[maybe_unused]] const ssize_t ignored = ::write(score, "900", 3);
        ::close(score);
    }
    ::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0);
    ::execv("/proc/self/exe", words);
    ::_exit(127);
}

/// As above. Of a group of its own, since an interrupt at the terminal is the server's alone.
[[noreturn]] void become_srun(int socket, char* const* words)
{
    ::setpgid(0, 0);
    ::dup2(socket, 0);
    ::dup2(socket, 1);
    ::execv(words[0], words);
    ::_exit(127);
}

}  // namespace

WorkerProcess start_worker(const ServerConfig& config, const std::string& home)
{
    int pair[2];
    if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, pair) != 0) fail_file("make", "a socket pair");
    Fd ours(pair[0]), theirs(pair[1]);
    ::fcntl(ours.get(), F_SETFL, O_NONBLOCK);
    const bool by_slurm = config.engine == WorkerEngine::slurm;
    std::vector<std::string> words = by_slurm ? words_of_srun(config) : std::vector<std::string>{"rcsplat"};
    for (std::string& word : words_of_worker(config, home)) words.push_back(std::move(word));
    const std::string in = std::to_string(by_slurm ? 0 : kSocketInWorker),
                      out = std::to_string(by_slurm ? 1 : kSocketInWorker);
    words.insert(words.end(), {"--in", in, "--out", out});
    if (by_slurm) words.push_back("--elsewhere");
    std::vector<char*> argv;
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    const pid_t server = ::getpid();
    const pid_t pid = ::fork();
    if (pid < 0) fail_file("start", "a worker");
    if (pid == 0) {
        tie_to(server, by_slurm ? SIGTERM : SIGKILL);
        by_slurm ? become_srun(theirs.get(), argv.data()) : become_worker(theirs.get(), argv.data());
    }
    return {pid, std::move(ours)};
}

void kill_worker(pid_t pid, WorkerEngine engine) { ::kill(pid, engine == WorkerEngine::slurm ? SIGTERM : SIGKILL); }

void end_workers(const std::vector<pid_t>& pids, WorkerEngine engine)
{
    for (const pid_t pid : pids) kill_worker(pid, engine);
    int left = kLongestEnd;
    for (const pid_t pid : pids) {
        while (::waitpid(pid, nullptr, WNOHANG) == 0) {
            constexpr int kLook = 5;  // [ms]
            std::this_thread::sleep_for(std::chrono::milliseconds(kLook));
            left -= kLook;
            if (left <= 0) ::kill(pid, SIGKILL);
        }
    }
}

std::string how_it_ended(int status)
{
    const int code = WIFEXITED(status) ? WEXITSTATUS(status) : kSignalBase + WTERMSIG(status);
    if (code <= kSignalBase) return "ended with code " + std::to_string(code);
    const int signal = code - kSignalBase;
    return "was ended by signal " + std::to_string(signal) + " (" + ::strsignal(signal) + ")";
}

}  // namespace rcs::service
