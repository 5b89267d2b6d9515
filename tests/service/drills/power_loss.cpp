// The power goes. What a server and its workers write is recorded; then their folder is made as it would be found had
// the machine stopped at one of many moments, with nothing of what had not been synced, with all of it, or with some. A
// server has to start on each of them, hold every job that had been acknowledged, and for each frame that is said to be
// done the right picture.
//
//     power_loss [CUTS [JOBS [SEED]]]
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <optional>
#include <random>

#include "service/drills/crashed_state.h"
#include "service/drills/drill_jobs.h"
#include "service/drills/write_trace.h"
#include "support/server.h"
#include "wire/sha256.h"

namespace {

using namespace rcs;
using service::Client;

/// What a client was told, and how much had been written then.
struct Promise {
    std::uint64_t number = 0, job = 0;
    std::size_t taken_at = SIZE_MAX, ended_at = SIZE_MAX;
    v1::JobState end = v1::JOB_STATE_UNSPECIFIED;
};

const std::vector<std::string> kOptions{"--workers", "1", "--threads", "1", "--min-free", "0"};

class Recording {
public:
    Recording(const std::string& folder, const test::DrillJobs& jobs)
        : folder_(folder), jobs_(jobs), trace_(made_folder(folder + "/state"))
    {
    }

    /// A server that takes jobs, dies in between and is stopped at the end.
    void make(std::uint64_t jobs)
    {
        start();
        for (std::uint64_t i = 1; i <= jobs / 2; ++i) submit(i);
        wait(jobs / 4);
        trace_.end(SIGKILL);
        start();
        for (std::uint64_t i = jobs / 2 + 1; i <= jobs; ++i) submit(i);
        cancel();
        wait(promises_.size());
        trace_.end(SIGTERM);
    }

    const test::WriteTrace& trace() const { return trace_; }
    const std::vector<Promise>& promises() const { return promises_; }

private:
    static std::string made_folder(const std::string& folder)
    {
        std::filesystem::create_directory(folder);
        return folder;
    }
    std::string socket() const { return folder_ + "/run/socket"; }

    void start()
    {
        std::vector<std::string> words{RCS_BIN_DIR "/rcsplat", "serve", "--socket", socket(), "--state",
                                       folder_ + "/state"};
        words.insert(words.end(), kOptions.begin(), kOptions.end());
        trace_.start(words, folder_ + "/log");
        service::ClientOptions patient;
        patient.patience_seconds = 60.0;
        for (client_.reset(); !client_;) {
            try {
                client_.emplace(socket());
            } catch (const service::ServiceError&) {
                std::this_thread::sleep_for(std::chrono::milliseconds(5));
            }
        }
    }
    void submit(std::uint64_t number)
    {
        const v1::Job job = jobs_.job(number);
        if (job.scene().has_files()) client_->upload({service::local_file(jobs_.scene_file())});
        promises_.push_back({number, client_->submit(job).job(), trace_.size()});
        promises_.back().taken_at = trace_.size();
    }
    void cancel()
    {
        Promise promise{0, client_->submit(test::long_job()).job()};
        promise.taken_at = trace_.size();
        client_->cancel(promise.job);
        promises_.push_back(promise);
    }
    /// For the first jobs, in their order.
    void wait(std::size_t count)
    {
        for (std::size_t i = 0; i < count; ++i) {
            Promise& promise = promises_.at(i);
            if (promise.ended_at != SIZE_MAX) continue;
            promise.end = client_->watch(promise.job).state();
            promise.ended_at = trace_.size();
        }
    }

    std::string folder_;
    const test::DrillJobs& jobs_;
    test::WriteTrace trace_;
    std::optional<Client> client_;
    std::vector<Promise> promises_;
};

/// A server on what a power cut left.
class Judge {
public:
    Judge(test::DrillJobs& jobs, const std::vector<Promise>& promises) : promises_(promises)
    {
        for (const Promise& promise : promises) {
            if (promise.number != 0) expected_[promise.job] = jobs.expected(promise.number);
        }
    }

    /// @param to_the_end  all jobs are waited for
    void judge(const test::TemporaryFolder& folder, std::size_t cut, bool to_the_end)
    {
        try {
            const test::TestServer server(folder.path(), kOptions);
            Client client(server.socket());
            for (const Promise& promise : promises_) {
                if (promise.taken_at <= cut) judge_promise(client, promise, cut, to_the_end);
            }
            v1::Request list;
            list.mutable_list()->set_limit(1000);
            const v1::Response jobs = client.call(list);
            for (const v1::JobStatus& job : jobs.list().jobs()) judge_pictures(client, job.job(), folder / "fetched");
        } catch (const std::exception& e) {
            wrong(cut, e.what());
        }
    }

    int wrong() const { return wrong_; }
    int pictures() const { return pictures_; }

private:
    void judge_promise(Client& client, const Promise& promise, std::size_t cut, bool to_the_end)
    {
        const std::string name = "job " + std::to_string(promise.job);
        const bool had_ended = promise.ended_at <= cut;
        v1::JobStatus status = client.details(promise.job).status();  // throws where there is none
        if (had_ended && status.state() != promise.end) wrong(cut, name + " was " + v1::JobState_Name(promise.end));
        if (to_the_end && promise.number != 0) status = client.watch(promise.job);
        if ((had_ended || to_the_end) && promise.number != 0 && status.state() != v1::JOB_STATE_COMPLETED)
            wrong(cut, name + " is " + v1::JobState_Name(status.state()) + ": " + status.error().message());
    }
    void judge_pictures(Client& client, std::uint64_t job, const std::string& path)
    {
        const v1::JobReply details = client.details(job, 0, 100);
        for (int i = 0; i < details.frames_size(); ++i) {
            if (details.frames(i).state() != v1::FRAME_STATE_COMPLETED) continue;
            client.fetch(job, details.frames(i).number(), "a.png", path);
            ++pictures_;
            if (service::sha256_of_file(path).digest != expected_.at(job).at(static_cast<std::size_t>(i)))
                throw std::runtime_error("job " + std::to_string(job) + " has another picture");
        }
    }
    void wrong(std::size_t cut, const std::string& what)
    {
        ++wrong_;
        std::printf("WRONG after %zu changes: %s\n", cut, what.c_str());
    }

    const std::vector<Promise>& promises_;
    std::map<std::uint64_t, std::vector<std::string>> expected_;
    int wrong_ = 0, pictures_ = 0;
};

const char* name_of(test::Survives survives)
{
    return survives == test::Survives::nothing ? "nothing" : survives == test::Survives::all ? "all" : "some";
}

/// What all changes make has to be what is there, or the recording lacks some.
bool is_complete(const test::CrashedState& state, const std::string& recorded, std::mt19937& random)
{
    namespace fs = std::filesystem;
    const test::TemporaryFolder made;
    state.write(made / "state", test::Survives::all, random);
    const auto files = [](const std::string& folder) {
        std::map<std::string, std::string> found;
        for (const auto& entry : fs::recursive_directory_iterator(folder)) {
            if (entry.path().string().starts_with(folder + "/shaders/")) continue;  // a driver's own, in part by mmap
            found[fs::relative(entry.path(), folder).string()] =
                entry.is_regular_file() ? test::bytes_of(entry.path().string()) : "";
        }
        return found;
    };
    return files(made / "state") == files(recorded);
}

}  // namespace

int main(int argc, char** argv)
{
    std::setvbuf(stdout, nullptr, _IOLBF, 0);
    const std::size_t cuts = argc > 1 ? std::strtoul(argv[1], nullptr, 10) : 500;
    const std::uint64_t count = argc > 2 ? std::strtoul(argv[2], nullptr, 10) : 12;
    std::mt19937 random(argc > 3 ? static_cast<unsigned>(std::atoi(argv[3])) : 1);
    const test::TemporaryFolder folder;
    test::DrillJobs jobs(folder.path());
    Recording recording(folder.path(), jobs);
    recording.make(count);
    const auto& changes = recording.trace().changes();
    const auto syncs = std::count_if(changes.begin(), changes.end(),
                                     [](const auto& c) { return c.kind == test::FileChange::Kind::sync; });
    std::printf("%zu changes recorded, %zu of them syncs, of %zu jobs\n", changes.size(),
                static_cast<std::size_t>(syncs), recording.promises().size());
    Judge judge(jobs, recording.promises());
    test::CrashedState state;
    if (getenv("DBG")) {
        for (auto& c : changes) {
            printf("%d f=%lu d=%lu/%s -> %lu/%s data=%zu at %lu\n", (int)c.kind, c.file, c.folder, c.name.c_str(),
                   c.to_folder, c.to_name.c_str(), c.data.size(), c.offset);
            state.apply(c);
        }
        state.write("/tmp/dbg-model", test::Survives::all, random);
        std::filesystem::copy(folder.path(), "/tmp/dbg-real", std::filesystem::copy_options::recursive);
        return 0;
    }
    constexpr test::Survives kAll[] = {test::Survives::nothing, test::Survives::all, test::Survives::some};
    std::map<std::string, int> judged;
    for (std::size_t cut = 0, next = 0; cut <= changes.size(); ++cut) {
        if (cut * cuts >= next * changes.size()) {
            const test::TemporaryFolder crashed;
            const test::Survives survives = kAll[next % 3];
            ++judged[name_of(survives)];
            state.write(crashed / "state", survives, random);
            judge.judge(crashed, cut, next++ % 20 == 0);
        }
        if (cut < changes.size()) state.apply(changes[cut]);
    }
    for (const auto& [survives, times] : judged)
        std::printf("%d times a server started where %s of what was not synced had survived\n", times,
                    survives.c_str());
    const bool complete = is_complete(state, folder / "state", random);
    std::printf("%d pictures compared, %d things wrong%s\n", judge.pictures(), judge.wrong(),
                complete ? "" : ", and the recording is not complete");
    const bool good = complete && judge.wrong() == 0;
    std::puts(good ? "all held" : "NOT all held");
    return good ? 0 : 1;
}
