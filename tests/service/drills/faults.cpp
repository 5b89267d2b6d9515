// Everything that can go wrong, at random moments: kill -9 of the server and of workers, a full disk, clients that
// vanish while they upload or fetch, jobs submitted twice with one key. In the end every job that was acknowledged has
// to have ended once, with the right picture or failed with its reason, and the database has to be whole. faults
// [ROUNDS [SEED]] As root the state lies on a small tmpfs, which is filled up; else that fault is left out.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <random>

#include <fcntl.h>
#include <sys/mount.h>
#include <unistd.h>

#include "queue/database.h"
#include "support/server.h"
#include "wire/sha256.h"

namespace {

using namespace rcs;
using service::Client;

void pause_ms(unsigned ms) { std::this_thread::sleep_for(std::chrono::milliseconds(ms)); }

class Drill {
public:
    Drill(const std::string& folder, bool can_fill, unsigned seed)
        : folder_(folder),
          can_fill_(can_fill),
          random_(seed),
          server_(folder, {"--min-free", "2", "--message-seconds", "2", "--workers", "1", "--threads", "2"})
    {
    }

    void round(int number)
    {
        submit_some(number);
        const unsigned fault = random_() % (can_fill_ ? 6 : 5);
        ++faults_[fault];
        pause_ms(random_() % 150);
        switch (fault) {
            case 0:
                server_.restart_after(SIGKILL);
                break;
            case 1:
                if (const pid_t worker = server_.worker(); worker > 0 && is_child_of_server(worker))
                    ::kill(worker, SIGKILL);
                break;
            case 2:
                vanish_while_uploading(number);
                break;
            case 3:
                vanish_while_fetching();
                break;
            case 4:
                submit_again();
                break;
            case 5:
                fill_disk();
                break;
        }
    }

    /// @return whether all held
    bool judge()
    {
        std::map<std::string, int> reasons;
        int completed = 0, failed = 0, wrong = 0;
        std::map<std::uint64_t, int> owners;
        Client client(server_.socket());
        for (const auto& [key, job] : acknowledged_) {
            const v1::JobStatus end = client.watch(job);
            ++owners[job];
            const v1::JobReply details = client.details(job, 0, 1);
            if (end.state() == v1::JOB_STATE_COMPLETED) {
                ++completed;
                const std::string path = folder_ + "/fetched.png";
                client.fetch(job, 0, "a.png", path);
                const std::string digest = service::sha256_of_file(path).digest;
                if (picture_.empty()) picture_ = digest;
                wrong += digest != picture_ || details.frames_size() != 1;
            } else {
                ++failed;
                ++reasons[end.error().message()];
                wrong += end.state() != v1::JOB_STATE_FAILED || end.error().message().empty();
            }
        }
        for (const auto& [job, count] : owners) wrong += count != 1;
        server_.end(SIGTERM);
        std::string integrity;
        long jobs = 0, unfinished = 0;
        {
            service::Database database(server_.state() + "/queue.db");
            service::Statement check(database, "PRAGMA integrity_check");
            check.step();
            integrity = check.text(0);
            service::Statement count(database, "SELECT count(*), sum(finished=0) FROM jobs");
            count.step();
            jobs = count.integer(0);
            unfinished = count.integer(1);
        }
        std::printf(
            "server killed %d times, worker %d, uploads broken off %d, fetches %d, submitted again %d, disk filled "
            "%d\n",
            faults_[0], faults_[1], faults_[2], faults_[3], faults_[4], faults_[5]);
        std::printf(
            "%zu jobs acknowledged: %d completed, %d failed with a reason, %d wrong; %d submits refused, %d answers "
            "lost\n",
            acknowledged_.size(), completed, failed, wrong, refused_, lost_);
        for (const auto& [reason, count] : reasons) std::printf("  %d x %s\n", count, reason.c_str());
        std::printf("database: %s, %ld jobs, %ld unfinished\n", integrity.c_str(), jobs, unfinished);
        // A job whose answer was lost was submitted again with its key: there are no others than those acknowledged.
        const bool good = wrong == 0 && integrity == "ok" && jobs == static_cast<long>(acknowledged_.size()) &&
                          unfinished == 0 && completed > failed;
        std::puts(good ? "all held" : "NOT all held");
        if (!good)
            std::filesystem::copy_file(server_.log_path(), "drill-faults.log",
                                       std::filesystem::copy_options::overwrite_existing);
        return good;
    }

private:
    bool is_child_of_server(pid_t pid) const
    {
        const std::string stat = test::bytes_of("/proc/" + std::to_string(pid) + "/stat");
        const std::size_t close = stat.rfind(')');
        return close != stat.npos && std::atol(stat.c_str() + close + 3) == server_.pid();
    }

    static v1::Job job_with(const std::string& key)
    {
        v1::Job job = test::small_job(24);
        job.set_idempotency_key(key);
        return job;
    }

    /// Until it is acknowledged, as a client does that wants its picture.
    void submit_key(const std::string& key)
    {
        for (int i = 0; i < 200; ++i) {
            try {
                const std::uint64_t job = Client(server_.socket()).submit(job_with(key)).job();
                const auto known = acknowledged_.find(key);
                if (known != acknowledged_.end() && known->second != job) {
                    std::printf("key %s was job %llu, now %llu\n", key.c_str(),
                                static_cast<unsigned long long>(known->second), static_cast<unsigned long long>(job));
                    std::exit(1);
                }
                acknowledged_[key] = job;
                return;
            } catch (const service::ServiceError&) {
                ++refused_;
                pause_ms(20);
            }
        }
        std::printf("%s was never taken\n%s", key.c_str(), server_.log().c_str());
        std::exit(1);
    }

    void submit_some(int number)
    {
        const unsigned count = 1 + random_() % 3;
        for (unsigned i = 0; i < count; ++i) submit_key(std::to_string(number) + "-" + std::to_string(i));
        // One whose answer nobody hears, as the server dies in between; it is asked for again.
        if (random_() % 4 != 0) return;
        const std::string key = std::to_string(number) + "-lost";
        try {
            Client client(server_.socket());
            std::thread killer([&] {
                pause_ms(random_() % 4);
                ::kill(server_.pid(), SIGKILL);
            });
            try {
                acknowledged_[key] = client.submit(job_with(key)).job();
            } catch (const service::ServiceError&) {
                ++lost_;
            }
            killer.join();
        } catch (const service::ServiceError&) {
        }
        server_.restart_after(SIGKILL);
        ++faults_[0];
        submit_key(key);
    }

    void vanish_while_uploading(int number)
    {
        const std::string path = folder_ + "/upload";
        test::write_bytes(path, std::string(700'000, static_cast<char>('a' + number % 4)));
        const auto file = service::local_file(path);
        try {
            Client client(server_.socket());
            v1::Request put;
            *put.mutable_blob_put()->mutable_blob() = file.blob;
            put.mutable_blob_put()->set_data(test::bytes_of(path).substr(0, 300'000));
            client.call(put);
            if (random_() % 2 == 0) client.upload({file});  // some come back
        } catch (const service::ServiceError&) {
            ++refused_;
        }
    }

    void vanish_while_fetching()
    {
        if (acknowledged_.empty()) return;
        try {
            Client client(server_.socket());
            v1::Request fetch;
            fetch.mutable_fetch()->set_job(acknowledged_.begin()->second);
            fetch.mutable_fetch()->set_name("a.png");
            fetch.mutable_fetch()->set_length(100);
            client.call(fetch);
        } catch (const service::ServiceError&) {
        }
    }

    void submit_again()
    {
        auto any = acknowledged_.begin();
        std::advance(any, random_() % acknowledged_.size());
        submit_key(any->first);
    }

    void fill_disk()
    {
        const std::string filler = server_.state() + "/../filler";
        {
            const service::Fd file(::open(filler.c_str(), O_CREAT | O_WRONLY | O_CLOEXEC, 0600));
            const std::string block(64 << 10, 'x');
            while (::write(file.get(), block.data(), block.size()) > 0) {
            }
        }
        try {
            Client(server_.socket()).submit(job_with("full"));
            std::puts("a job was taken on a full disk");
            acknowledged_["full"] = Client(server_.socket()).submit(job_with("full")).job();
        } catch (const service::ServiceError&) {
            ++refused_;
        }
        pause_ms(random_() % 400);
        if (random_() % 3 == 0) {
            server_.end(SIGKILL);
            std::filesystem::remove(filler);
            server_.start();
        }
        std::filesystem::remove(filler);
    }

    std::string folder_;
    bool can_fill_;
    std::mt19937 random_;
    test::TestServer server_;
    std::map<std::string, std::uint64_t> acknowledged_;
    std::map<unsigned, int> faults_;
    std::string picture_;
    int refused_ = 0, lost_ = 0;
};

}  // namespace

int main(int argc, char** argv)
{
    const int rounds = argc > 1 ? std::atoi(argv[1]) : 200;
    const unsigned seed = argc > 2 ? static_cast<unsigned>(std::atoi(argv[2])) : 1;
    const test::TemporaryFolder folder;
    const bool small_disk = ::mount("rcs-drill", folder.path().c_str(), "tmpfs", 0, "size=24m,mode=0700") == 0;
    bool good = false;
    {
        Drill drill(folder.path(), small_disk, seed);
        for (int i = 0; i < rounds; ++i) drill.round(i);
        good = drill.judge();
    }
    if (small_disk) ::umount2(folder.path().c_str(), MNT_DETACH);
    return good ? 0 : 1;
}
