#include "service/drills/waiting_clients.h"

#include <cctype>
#include <chrono>
#include <csignal>
#include <filesystem>

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include "client/client.h"
#include "support/temporary_folder.h"
#include "wire/errors.h"
#include "wire/sha256.h"

extern char** environ;

namespace rcs::test {
namespace {

using service::Client;
using Clock = std::chrono::steady_clock;

constexpr double kLongestWait = 240.0;  // of a client, from its first word to its last picture [s]

service::ClientOptions patient()
{
    service::ClientOptions options;
    options.patience_seconds = kLongestWait;
    return options;
}

void pause_ms(unsigned ms) { std::this_thread::sleep_for(std::chrono::milliseconds(ms)); }

/// What may pass: space, places, a server that is not there yet.
bool comes_again(v1::ErrorCode code)
{
    return code == v1::ERROR_CODE_UNAVAILABLE || code == v1::ERROR_CODE_LIMIT || code == v1::ERROR_CODE_MISSING_BLOBS;
}

pid_t start_process(std::vector<std::string> words, const std::string& logs)
{
    words.insert(words.begin(), RCS_BIN_DIR "/rcsplat");
    std::vector<char*> argv;
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addopen(&actions, 1, (logs + ".out").c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
    posix_spawn_file_actions_addopen(&actions, 2, (logs + ".err").c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
    pid_t pid = 0;
    if (::posix_spawn(&pid, argv[0], &actions, nullptr, argv.data(), environ) != 0) pid = 0;
    posix_spawn_file_actions_destroy(&actions);
    return pid;
}

std::string without_numbers(std::string text)
{
    std::erase_if(text, [](unsigned char c) { return std::isdigit(c) != 0; });
    return text.substr(0, text.find('\n'));
}

}  // namespace

WaitingClients::~WaitingClients()
{
    while (waiting_ > 0) pause_ms(10);
}

void WaitingClients::begin(std::uint64_t number, bool as_process, bool dies)
{
    ++waiting_;
    std::thread([=, this] { run(number, as_process, dies); }).detach();
}

std::vector<Served> WaitingClients::take_served()
{
    const std::scoped_lock lock(mutex_);
    return std::exchange(served_, {});
}

std::map<std::string, int> WaitingClients::refusals() const
{
    const std::scoped_lock lock(mutex_);
    return refusals_;
}

void WaitingClients::note(const std::string& refusal)
{
    const std::scoped_lock lock(mutex_);
    ++refusals_[without_numbers(refusal)];
}

void WaitingClients::run(std::uint64_t number, bool as_process, bool dies)
{
    const auto begin = Clock::now();
    Served served;
    served.number = number;
    while (Clock::now() - begin < std::chrono::duration<double>(kLongestWait)) {
        try {
            as_process ? serve_by_process(served, dies) : serve_by_library(served);
            break;
        } catch (const service::ServiceError& e) {
            note(e.what());
            served.reason = std::string("not served: ") + e.what();
            if (!comes_again(e.code())) break;
            pause_ms(50);
        } catch (const std::exception& e) {
            served.reason = std::string("not served: ") + e.what();
            break;
        }
    }
    served.in_time = Clock::now() - begin < std::chrono::duration<double>(kLongestWait);
    {
        const std::scoped_lock lock(mutex_);
        served_.push_back(std::move(served));
    }
    --waiting_;
}

std::uint64_t WaitingClients::submit(std::uint64_t number)
{
    const v1::Job job = jobs_.job(number);
    Client client(socket_, patient());
    if (job.scene().has_files()) client.upload({service::local_file(jobs_.scene_file())});
    return client.submit(job).job();
}

void WaitingClients::serve_by_library(Served& served)
{
    served.job = submit(served.number);
    fetch(served);
}

void WaitingClients::fetch(Served& served)
{
    Client client(socket_, patient());
    const v1::JobStatus end = client.watch(served.job);
    served.reason = end.error().message();
    served.code = end.error().code();
    served.pictures.assign(static_cast<std::size_t>(end.frames()), "");
    const v1::JobReply details = client.details(served.job, 0, 100);
    for (int i = 0; i < details.frames_size(); ++i) {
        const v1::FrameStatus& frame = details.frames(i);
        if (frame.state() != v1::FRAME_STATE_COMPLETED) continue;
        const std::string path = folder_ + "/" + std::to_string(served.number) + ".fetched.png";
        client.fetch(served.job, frame.number(), "a.png", path);
        served.pictures.at(static_cast<std::size_t>(i)) = service::sha256_of_file(path).digest;
        std::filesystem::remove(path);
    }
}

void WaitingClients::serve_by_process(Served& served, bool dies)
{
    const std::string output = folder_ + "/" + std::to_string(served.number) + ".png";
    std::vector<std::string> words = DrillJobs::submit_words(served.number, output);
    words.insert(words.end(), {"--server", socket_});
    if (dies) {
        const pid_t gone = start_process(words, output);
        pause_ms(static_cast<unsigned>(served.number % 200));
        ::kill(gone, SIGKILL);
        ::waitpid(gone, nullptr, 0);
    }
    int status = 0;
    ::waitpid(start_process(words, output), &status, 0);
    const std::string out = bytes_of(output + ".out"), err = bytes_of(output + ".err");
    if (out.starts_with("job ")) served.job = std::stoull(out.substr(4));
    if (status == 0) {
        served.pictures = {service::sha256_of_file(output).digest};
        served.reason.clear();
    } else if (err.find("no pictures") != err.npos) {
        fetch(served);
    } else {
        throw service::ServiceError(v1::ERROR_CODE_UNAVAILABLE, err);
    }
    for (const char* ending : {"", ".out", ".err"}) std::filesystem::remove(output + ending);
}

}  // namespace rcs::test
