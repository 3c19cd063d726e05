// SPDX-License-Identifier: Apache-2.0
// toftwind as a process that speaks TLS, and knows its clients by certificates, tokens and users.
#include <gmock/gmock.h>
#include <sys/stat.h>

#include "protocol/transport/certificates.h"
#include "toftwind_process.h"

namespace toftwin {
namespace {

using test::Process;
using test::Toftwind;
using testing::HasSubstr;
using namespace std::chrono_literals;
constexpr auto kSoon = test::kSoon;

const std::string kToken = "0123456789abcdef0123456789abcdef";

class Encrypted : public Toftwind {
 protected:
  void SetUp() override {
    Toftwind::SetUp();
    for (const char* authority : {"ca", "later"}) {
      ASSERT_TRUE(transport::makeAuthority(folder_ / authority, authority, 30).ok());
      ASSERT_TRUE(transport::makeCertificate(folder_ / authority, {.name = "dock", .hosts = {"127.0.0.1"}}).ok());
      ASSERT_TRUE(transport::makeCertificate(folder_ / authority, {.name = "plc"}).ok());
    }
    std::ofstream{folder_ / "cell3.token"} << kToken << "\n";
    ::chmod(path("cell3.token").c_str(), 0600);
  }
  void serve(const std::string& authority, const std::string& roles) {
    configureWith(authority, roles);
    daemon_ = std::make_unique<Process>(std::vector<std::string>{"--config", path("d.toml"), "--socket", ""}, path("log"));
    ASSERT_TRUE(daemon_->says("source cam: driver pattern")) << daemon_->said();
    const std::string log = daemon_->said();
    port_ = std::to_string(std::stoi(log.substr(log.find(" port ") + 6, 5)));
  }
  void configureWith(const std::string& authority, const std::string& roles) const {
    configure("audit_log = 'audit'\nrecording_folder = '.'\n[listen]\nport = 0\ncertificate = '" + authority + "/dock.pem'\nkey = '" + authority +
              "/dock.key'\nclient_authorities = '" + authority + "/authority.pem'\n" + roles +
              "[[source]]\nname = 'cam'\ndriver = 'pattern'\nwidth = 64\nheight = 48\n");
  }
  [[nodiscard]] Result<Client> connect(const std::string& authority, bool has_certificate = false,
                                       const std::string& token = {}, const std::string& scheme = "tls:") const {
    ClientOptions options;
    options.timeout = 20s;
    options.token = token;
    options.authorities = path((authority + "/authority.pem").c_str());
    if (has_certificate) {
      options.certificate = path((authority + "/plc.pem").c_str());
      options.key = path((authority + "/plc.key").c_str());
    }
    return Client::connect(scheme + "127.0.0.1:" + port_, options);
  }
  std::unique_ptr<Process> daemon_;
  std::string port_;
};

TEST_F(Encrypted, FramesComeThroughAndClearTextDoesNot) {
  serve("ca", "");
  auto client = connect("ca");
  ASSERT_TRUE(client.ok()) << client.error().message << daemon_->said();
  auto stream = client->subscribe("cam");
  for (int i = 0; i < 5; ++i) ASSERT_TRUE(stream->next(kSoon).ok());
  const auto stranger = connect("later");
  ASSERT_FALSE(stranger.ok());
  EXPECT_EQ(stranger.error().code, Error::Code::PermissionDenied) << stranger.error().message;
  EXPECT_FALSE(connect("ca", false, {}, "tcp:").ok());
  EXPECT_TRUE(client->health().ok()) << "which disturbs nobody";
}

TEST_F(Encrypted, WhoAClientIsSaysWhatItMayDo) {
  // Whoever runs the daemon is its administrator: the clients are somebody else, which only root can be.
  if (::geteuid() != 0) GTEST_SKIP() << "only root can be somebody else";
  serve("ca", "[roles]\nview = ['anyone']\ncontrol = ['certificate:plc']\nrecord = ['token:cell3']\n"
              "[[roles.token]]\nname = 'cell3'\nfile = 'cell3.token'\n");
  std::filesystem::permissions(folder_, std::filesystem::perms{0755});
  if (!test::othersMayEnter(folder_)) GTEST_SKIP() << "no folder here that another user may enter";
  std::filesystem::permissions(folder_ / "ca/plc.key", std::filesystem::perms{0644});
  ASSERT_EQ(::seteuid(65534), 0);
  auto anybody = connect("ca");
  auto plc = connect("ca", true);
  auto cell3 = connect("ca", false, kToken);
  const auto guessed = connect("ca", false, "guessed");
  ASSERT_EQ(::seteuid(0), 0);
  ASSERT_TRUE(anybody.ok() && plc.ok() && cell3.ok()) << daemon_->said();
  EXPECT_THAT(guessed.error().message, HasSubstr("none of this daemon's"));
  EXPECT_TRUE(anybody->subscribe("cam").ok());
  EXPECT_EQ(anybody->setPose("cam", {}).error().code, Error::Code::PermissionDenied);
  EXPECT_EQ(anybody->subscribe("cam", {.policy = SubscribeOptions::Policy::Lockstep}).error().code,
            Error::Code::PermissionDenied);
  EXPECT_EQ(anybody->startRecording("cam", "a").error().code, Error::Code::PermissionDenied);
  EXPECT_TRUE(plc->setPose("cam", {}).ok());
  EXPECT_EQ(plc->startRecording("cam", "a").error().code, Error::Code::PermissionDenied);
  EXPECT_TRUE(cell3->startRecording("cam", "a").ok());
  EXPECT_THAT(cell3->health()->sources.at(0).recording_by, HasSubstr("token:cell3"));
  EXPECT_EQ(cell3->trigger("cam").error().code, Error::Code::PermissionDenied);
  EXPECT_TRUE(cell3->stopRecording("cam").ok());
  daemon_->signal(SIGTERM);
  EXPECT_EQ(daemon_->wait(), 0);
  std::ostringstream audit;
  audit << std::ifstream{path("audit")}.rdbuf();
  EXPECT_THAT(audit.str(), HasSubstr("\"what\":\"set pose 1 0 0 0, 0 0 0 m\",\"done\":true"));
  EXPECT_THAT(audit.str(), HasSubstr("\"what\":\"record into a\",\"done\":false"));
  EXPECT_THAT(audit.str(), HasSubstr("\"who\":\"token:cell3"));
}

TEST_F(Encrypted, ANewCertificateComesWithAReloadAndCutsNobodyOff) {
  serve("ca", "");
  auto before = connect("ca");
  ASSERT_TRUE(before.ok()) << before.error().message;
  configureWith("later", "");
  daemon_->signal(SIGHUP);
  ASSERT_TRUE(daemon_->says("the new configuration is in force")) << daemon_->said();
  EXPECT_TRUE(connect("later").ok());
  EXPECT_FALSE(connect("ca").ok());
  EXPECT_TRUE(before->health().ok());
  configure("[listen]\ncertificate = 'none.pem'\nkey = 'none.key'\n");
  daemon_->signal(SIGHUP);
  ASSERT_TRUE(daemon_->says("the configuration stays as it was")) << daemon_->said();
  EXPECT_TRUE(connect("later").ok());
}

}  // namespace
}  // namespace toftwin
