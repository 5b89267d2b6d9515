// Who may come over TCP.

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>

#include "rcs/error.h"
#include "support/server.h"

namespace rcs {
namespace {

using service::Client;
using service::ClientOptions;
using service::ServiceError;
using test::TemporaryFolder;
using test::TestServer;

/// Keys and certificates as an administrator makes them, with openssl.
class Tcp : public ::testing::Test {
protected:
    void openssl(const std::string& arguments)
    {
        ASSERT_EQ(std::system(("cd " + folder_.path() + " && openssl " + arguments + " >openssl.log 2>&1").c_str()), 0)
            << arguments << "\n"
            << test::bytes_of(folder_ / "openssl.log");
    }
    /// A certificate NAME.pem of the authority ca.pem with its key NAME.key, valid for 127.0.0.1.
    void certificate(const std::string& name, const std::string& validity)
    {
        test::write_bytes(
            folder_ / "ca.cnf",
            "[ca]\ndefault_ca=own\n[own]\ndatabase=index\nnew_certs_dir=.\ndefault_md=sha256\nrand_serial=yes\n"
            "policy=names\nx509_extensions=place\n[names]\ncommonName=supplied\n"
            "[place]\nsubjectAltName=IP:127.0.0.1\n");
        std::ofstream(folder_ / "index", std::ios::app);  // of what was signed: empty at first
        openssl("req -newkey rsa:2048 -nodes -keyout " + name + ".key -out " + name + ".csr -subj /CN=" + name);
        openssl("ca -batch -notext -config ca.cnf -cert ca.pem -keyfile ca.key -in " + name + ".csr " + validity +
                " -out " + name + ".pem");
    }
    void authority() { openssl("req -x509 -newkey rsa:2048 -nodes -keyout ca.key -out ca.pem -days 2 -subj /CN=ca"); }

    std::string address(const TestServer& server) const
    {
        return "127.0.0.1:" + std::to_string(server.last_number("address=127.0.0.1 port="));
    }
    static std::string refusal(const std::string& address, const ClientOptions& options)
    {
        try {
            Client client(address, options);
        } catch (const std::exception& e) {
            return e.what();
        }
        return "";
    }

    TemporaryFolder folder_;
};

std::string token_of(const TestServer& server)
{
    std::string token = test::bytes_of(server.state() + "/token");
    token.pop_back();
    return token;
}

TEST_F(Tcp, WantsTheTokenAndNeverTellsIt)
{
    TestServer server(folder_.path(), {"--listen", "127.0.0.1:0", "--debug"});
    const std::string token = token_of(server);
    EXPECT_EQ(token.size(), 64u);
    EXPECT_EQ(std::filesystem::status(server.state() + "/token").permissions(), std::filesystem::perms(0600));
    EXPECT_EQ(refusal(address(server), {}), "this server wants a token");
    ClientOptions wrong;
    wrong.token = std::string(64, 'f');
    EXPECT_EQ(refusal(address(server), wrong), "the token is wrong");
    ClientOptions right;
    right.token = token;
    Client client(address(server), right);
    EXPECT_EQ(client.watch(client.submit(test::small_job()).job()).state(), v1::JOB_STATE_COMPLETED);
    EXPECT_EQ(server.log().find(token), std::string::npos);
    EXPECT_EQ(server.log().find(wrong.token), std::string::npos);
}

TEST_F(Tcp, JobsOfOthersAreNotSeen)
{
    TestServer server(folder_.path(), {"--listen", "127.0.0.1:0"});
    const auto job = Client(server.socket()).submit(test::small_job()).job();
    ClientOptions options;
    options.token = token_of(server);
    Client other(address(server), options);
    try {
        other.cancel(job);
        FAIL();
    } catch (const ServiceError& e) {
        EXPECT_EQ(e.code(), v1::ERROR_CODE_FORBIDDEN);
    }
    v1::Request list;
    list.mutable_list();
    EXPECT_EQ(other.call(list).list().jobs_size(), 0);
}

TEST_F(Tcp, TlsTakesATokenOrACertificateThatIsValid)
{
    authority();
    certificate("server", "-days 2");
    certificate("client", "-days 2");
    certificate("expired", "-startdate 20200101000000Z -enddate 20200102000000Z");
    TestServer server(folder_.path(), {"--listen", "127.0.0.1:0", "--tls-certificate", folder_ / "server.pem",
                                       "--tls-key", folder_ / "server.key", "--client-ca", folder_ / "ca.pem"});
    ClientOptions options;
    options.ca = folder_ / "ca.pem";
    EXPECT_EQ(refusal(address(server), options), "this server wants a token");
    options.token = "wrong";
    EXPECT_EQ(refusal(address(server), options), "the token is wrong");
    options.token = token_of(server);
    EXPECT_EQ(refusal(address(server), options), "");
    ClientOptions plain;
    plain.token = options.token;
    plain.connect_seconds = plain.reply_seconds = 3;
    EXPECT_NE(refusal(address(server), plain), "") << "without TLS";
    const auto shown = [&](const std::string& name) {
        ClientOptions with;
        with.ca = folder_ / "ca.pem";
        with.certificate = folder_ / (name + ".pem");
        with.key = folder_ / (name + ".key");
        return refusal(address(server), with);
    };
    EXPECT_EQ(shown("client"), "");
    EXPECT_NE(shown("expired"), "");
    EXPECT_EQ(server.log().find(options.token), std::string::npos);
}

TEST_F(Tcp, AServerOfAnUnknownAuthorityIsNotTrusted)
{
    authority();
    certificate("server", "-days 2");
    TestServer server(folder_.path(), {"--listen", "127.0.0.1:0", "--tls-certificate", folder_ / "server.pem",
                                       "--tls-key", folder_ / "server.key"});
    std::filesystem::rename(folder_ / "ca.pem", folder_ / "old.pem");
    authority();
    ClientOptions options;
    options.ca = folder_ / "ca.pem";
    options.token = token_of(server);
    const std::string said = refusal(address(server), options);
    EXPECT_NE(said.find("certificate"), std::string::npos) << said;
}

}  // namespace
}  // namespace rcs
