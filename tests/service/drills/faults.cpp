// A bad night in short: at random moments kill -9 and SIGTERM of the server, kill -9 and SIGSTOP of workers, full disks
// (queue and pictures have small ones of their own), jumps of the wall's clock, clients that vanish while they upload,
// fetch or wait. Meanwhile clients wait for jobs of which each has a picture of its own. In the end each of them was
// served, with the picture that is rendered here, or was told why not; nothing is there twice, and the database is
// whole.
//
//     faults [ROUNDS [SEED]]
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <optional>
#include <random>
#include <set>
#include <sstream>

#include <unistd.h>

#include "queue/database.h"
#include "service/drills/drill_jobs.h"
#include "service/drills/small_disks.h"
#include "service/drills/waiting_clients.h"
#include "support/server.h"
#include "wire/files.h"

namespace {

using namespace rcs;
using service::Client;
using Clock = std::chrono::steady_clock;

constexpr int kMostWaiting = 12;
constexpr int kQueueDisk = 160, kPicturesDisk = 128;  // [MB]

void pause_ms(unsigned ms) { std::this_thread::sleep_for(std::chrono::milliseconds(ms)); }

/// What a folder holds, and the small disks in it.
struct Place {
    explicit Place(const std::string& path, bool may_mount)
    {
        if (!may_mount) return;
        queue.emplace(path + "/disk1", path + "/state", kQueueDisk);
        pictures.emplace(path + "/disk2", path + "/state/results", kPicturesDisk);
        if (!queue->exists() || !pictures->exists()) pictures.reset(), queue.reset();
    }
    std::optional<test::SmallDisk> queue, pictures;
};

class Drill {
public:
    Drill(const std::string& folder, bool may_mount, unsigned seed)
        : folder_(folder),
          place_(folder, may_mount),
          random_(seed),
          jobs_(folder),
          shift_(set_clock(folder + "/shift", 0)),
          server_(
              folder,
              {"--min-free", "2", "--message-seconds", "2", "--workers", "2", "--threads", "1", "--worker-start", "8"},
              {"env", "LD_PRELOAD=" RCS_BIN_DIR "/libshifted_clock.so", "SHIFTED_CLOCK=" + shift_}),
          clients_(server_.socket(), folder, jobs_)
    {
    }

    void round()
    {
        while (clients_.waiting() >= kMostWaiting) look_after(20);
        begin_client();
        look_after(random_() % 200);
        const auto& [name, strike] = faults().at(random_() % faults().size());
        ++struck_[name];
        (this->*strike)();
        look_after(random_() % 200);
    }

    /// @return whether all held
    bool judge();

    std::uint64_t begun() const { return next_; }

private:
    using Fault = std::pair<const char*, void (Drill::*)()>;
    const std::vector<Fault>& faults() const;

    static std::string set_clock(const std::string& file, long seconds)
    {
        test::write_bytes(file + ".new", std::to_string(seconds));
        std::filesystem::rename(file + ".new", file);
        return file;
    }

    std::vector<pid_t> workers() const;
    void begin_client();
    void look_after(unsigned ms);
    void wrong(const std::string& what)
    {
        ++wrong_;
        std::printf("WRONG %s\n", what.c_str());
    }
    void judge_picture(const test::Served& served);
    bool judge_database();

    void kill_server() { server_.restart_after(SIGKILL); }
    void restart_server() { server_.restart_after(SIGTERM); }
    void kill_worker();
    void stop_worker_for_a_while();
    void stop_worker_for_good();
    void step_clock();
    void vanish_while_uploading();
    void vanish_while_fetching();
    void vanish_while_waiting();
    void fill_queue_disk() { fill(*place_.queue); }
    void fill_pictures_disk() { fill(*place_.pictures); }
    void fill(test::SmallDisk& disk);

    std::string folder_;
    Place place_;
    std::mt19937 random_;
    test::DrillJobs jobs_;
    std::string shift_;
    test::TestServer server_;
    test::WaitingClients clients_;
    std::uint64_t next_ = 0;
    std::set<std::uint64_t> jobs_taken_;
    std::map<std::string, int> struck_, reasons_;
    int wrong_ = 0;
    std::vector<std::pair<pid_t, Clock::time_point>> stopped_;
    std::set<std::string> pictures_;
    int completed_ = 0, failed_ = 0;
};

const std::vector<Drill::Fault>& Drill::faults() const
{
    static const std::vector<Fault> kAll{{"server killed", &Drill::kill_server},
                                         {"server restarted", &Drill::restart_server},
                                         {"worker killed", &Drill::kill_worker},
                                         {"worker stopped for a while", &Drill::stop_worker_for_a_while},
                                         {"worker stopped for good", &Drill::stop_worker_for_good},
                                         {"clock set", &Drill::step_clock},
                                         {"uploader gone", &Drill::vanish_while_uploading},
                                         {"fetcher gone", &Drill::vanish_while_fetching},
                                         {"waiter gone", &Drill::vanish_while_waiting},
                                         {"queue's disk filled", &Drill::fill_queue_disk},
                                         {"pictures' disk filled", &Drill::fill_pictures_disk}};
    static const std::vector<Fault> kWithoutDisks(kAll.begin(), kAll.end() - 2);
    return place_.queue ? kAll : kWithoutDisks;
}

std::vector<pid_t> Drill::workers() const
{
    const std::string pid = std::to_string(server_.pid());
    std::istringstream children(test::bytes_of("/proc/" + pid + "/task/" + pid + "/children"));
    return {std::istream_iterator<pid_t>(children), {}};
}

void Drill::begin_client()
{
    const std::uint64_t number = ++next_;
    clients_.begin(number, test::DrillJobs::can_be_words(number) && random_() % 4 == 0, false);
}

/// Waits; meanwhile stopped workers go on and pictures are judged.
void Drill::look_after(unsigned ms)
{
    const auto until = Clock::now() + std::chrono::milliseconds(ms);
    do {
        std::erase_if(stopped_, [](const auto& stopped) {
            if (Clock::now() < stopped.second) return false;
            ::kill(stopped.first, SIGCONT);
            return true;
        });
        for (const test::Served& served : clients_.take_served()) judge_picture(served);
        pause_ms(5);
    } while (Clock::now() < until);
}

void Drill::judge_picture(const test::Served& served)
{
    const std::string name = "job " + std::to_string(served.number) + ": ";
    if (!served.in_time) wrong(name + "served too late, or not at all: " + served.reason);
    if (served.job != 0 && !jobs_taken_.insert(served.job).second) wrong(name + "shares the server's job");
    const auto expected = jobs_.expected(served.number);
    if (served.pictures.size() != expected.size()) wrong(name + "lacks frames: " + served.reason);
    for (std::size_t i = 0; i < std::min(expected.size(), served.pictures.size()); ++i) {
        if (served.pictures[i].empty()) continue;
        if (served.pictures[i] != expected[i]) wrong(name + "another picture");
        if (!pictures_.insert(served.pictures[i]).second) wrong(name + "not a picture of its own");
    }
    if (std::count(served.pictures.begin(), served.pictures.end(), "") == 0) {
        ++completed_;
        return;
    }
    // What the drill itself did to a frame's workers may end it; nothing else.
    ++failed_;
    ++reasons_[served.reason];
    if (served.code != v1::ERROR_CODE_WORKER_DIED && served.code != v1::ERROR_CODE_TIME_LIMIT)
        wrong(name + "failed: " + served.reason);
}

void Drill::kill_worker()
{
    const auto all = workers();
    if (!all.empty()) ::kill(all[random_() % all.size()], SIGKILL);
}

void Drill::stop_worker_for_a_while()
{
    const auto all = workers();
    if (all.empty()) return;
    stopped_.emplace_back(all[random_() % all.size()], Clock::now() + std::chrono::milliseconds(random_() % 4000));
    ::kill(stopped_.back().first, SIGSTOP);
}

void Drill::stop_worker_for_good()
{
    const auto all = workers();
    if (!all.empty()) ::kill(all[random_() % all.size()], SIGSTOP);
}

void Drill::step_clock()
{
    constexpr long kHour = 3600, k1970 = -1'700'000'000, k2100 = 2'300'000'000;
    const long shifts[] = {0, kHour, -kHour, k1970, k2100};
    set_clock(shift_, shifts[random_() % std::size(shifts)]);
}

void Drill::vanish_while_uploading()
{
    const std::string path = folder_ + "/upload";
    test::write_bytes(path, std::string(300'000, static_cast<char>('a' + random_() % 20)));
    const auto file = service::local_file(path);
    try {
        Client client(server_.socket());
        v1::Request put;
        *put.mutable_blob_put()->mutable_blob() = file.blob;
        put.mutable_blob_put()->set_data(test::bytes_of(path).substr(0, 100'000));
        client.call(put);
        if (random_() % 2 == 0) client.upload({file});  // some come back
    } catch (const service::ServiceError&) {
    }
}

void Drill::vanish_while_fetching()
{
    if (jobs_taken_.empty()) return;
    try {
        Client client(server_.socket());
        v1::Request fetch;
        fetch.mutable_fetch()->set_job(*jobs_taken_.rbegin());
        fetch.mutable_fetch()->set_name("a.png");
        fetch.mutable_fetch()->set_length(100);
        client.call(fetch);
    } catch (const service::ServiceError&) {
    }
}

void Drill::vanish_while_waiting()
{
    do ++next_;
    while (!test::DrillJobs::can_be_words(next_));
    clients_.begin(next_, true, true);
}

void Drill::fill(test::SmallDisk& disk)
{
    disk.fill();
    begin_client();
    look_after(random_() % 600);
    if (random_() % 3 == 0) {
        server_.end(SIGKILL);
        disk.empty();
        server_.start();
    }
    disk.empty();
}

bool Drill::judge_database()
{
    server_.end(SIGTERM);
    service::Database database(server_.state() + "/queue.db");
    const auto number = [&](const char* sql) {
        service::Statement row(database, sql);
        row.step();
        return row.integer(0);
    };
    service::Statement check(database, "PRAGMA integrity_check");
    check.step();
    const std::string integrity = check.text(0);
    const auto jobs = number("SELECT count(*) FROM jobs"), keys = number("SELECT count(DISTINCT key) FROM jobs");
    const auto unfinished = number("SELECT count(*) FROM jobs WHERE finished=0");
    const auto frames = number("SELECT count(*) FROM frames WHERE state=4");
    const auto folders = std::distance(std::filesystem::directory_iterator(server_.state() + "/results"), {});
    std::printf("database: %s, %lld jobs, %lld unfinished, %lld frames in %lld folders\n", integrity.c_str(),
                static_cast<long long>(jobs), static_cast<long long>(unfinished), static_cast<long long>(frames),
                static_cast<long long>(folders));
    return integrity == "ok" && jobs == completed_ + failed_ && keys == jobs && unfinished == 0 && frames == folders;
}

bool Drill::judge()
{
    while (clients_.waiting() > 0) look_after(100);
    look_after(0);
    for (const auto& [fault, count] : struck_) std::printf("%5d x %s\n", count, fault.c_str());
    std::printf("%d jobs completed, %d failed with a reason; %zu distinct pictures, as rendered here\n", completed_,
                failed_, pictures_.size());
    for (const auto& [reason, count] : reasons_) std::printf("%5d x %s\n", count, reason.c_str());
    for (const auto& [refusal, count] : clients_.refusals())
        std::printf("%5d x asked again: %s\n", count, refusal.c_str());
    const bool good = judge_database() && wrong_ == 0 && completed_ > 10 * failed_;
    std::puts(good ? "all held" : "NOT all held");
    if (!good)
        std::filesystem::copy_file(server_.log_path(), "drill-faults.log",
                                   std::filesystem::copy_options::overwrite_existing);
    return good;
}

}  // namespace

int main(int argc, char** argv)
{
    std::setvbuf(stdout, nullptr, _IOLBF, 0);
    const int rounds = argc > 1 ? std::atoi(argv[1]) : 200;
    const unsigned seed = argc > 2 ? static_cast<unsigned>(std::atoi(argv[2])) : 1;
    const bool may_mount = test::own_mounts();
    const test::TemporaryFolder folder;
    Drill drill(folder.path(), may_mount, seed);
    const auto begin = Clock::now();
    for (int i = 0; i < rounds; ++i) {
        drill.round();
        if (i % 50 == 49) {
            std::printf("%d rounds, %llu jobs, %.0f s\n", i + 1, static_cast<unsigned long long>(drill.begun()),
                        std::chrono::duration<double>(Clock::now() - begin).count());
        }
    }
    return drill.judge() ? 0 : 1;
}
