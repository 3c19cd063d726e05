// SPDX-License-Identifier: Apache-2.0
#include "daemon/access.h"

#include <gmock/gmock.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "daemon/audit.h"
#include "fakes.h"

namespace toftwin::daemon {
namespace {

using testing::HasSubstr;

constexpr uid_t kStranger = 123456;

struct Read {
  Access access;
  std::vector<std::string> complaints;
};

using Names = std::vector<std::string>;
RoleKeys keysOf(Names view, Names control = {}, Names record = {}, std::vector<TokenKeys> tokens = {}) {
  return {std::move(view), std::move(control), std::move(record), {}, std::move(tokens)};
}

Read readRoles(const RoleKeys& keys, const std::filesystem::path& folder = {}) {
  Read read;
  read.access = Access::read(
      keys, [&](const std::string& path) { return folder / path; },
      [&](const std::string& key, const std::string& what) { read.complaints.push_back(key + " " + what); });
  return read;
}

TEST(Access, WithoutRolesWhoeverCanConnectMayDoAllButStopTheRecordingsOfOthers) {
  const auto who = Access{}.identify({.user = kStranger}, "", "");
  ASSERT_TRUE(who.ok());
  EXPECT_EQ(who->name, "user 123456");
  EXPECT_TRUE(who->grants.view && who->grants.control && who->grants.record);
  EXPECT_FALSE(who->grants.admin);
}

TEST(Access, RootAndTheDaemonsOwnUserAreAdministrators) {
  for (const uid_t own : {uid_t{0}, ::geteuid()}) EXPECT_TRUE(Access{}.identify({.user = own}, "", "")->grants.admin);
  EXPECT_FALSE(Access{}.identify({.user = {}, .address = "10.0.0.1"}, "", "")->grants.admin);
}

TEST(Access, WithRolesEveryoneHasWhatTheyGiveAndNoMore) {
  const auto roles = readRoles(keysOf({"anyone"}, {"user:123456"}, {"group:777"}));
  ASSERT_TRUE(roles.complaints.empty());
  const auto of = [&](const Peer& peer) { return roles.access.identify(peer, "", "")->grants; };
  EXPECT_TRUE(of({.user = kStranger}).control);
  EXPECT_FALSE(of({.user = kStranger}).record);
  EXPECT_TRUE(of({.user = 2, .groups = {5, 777}}).record);
  EXPECT_FALSE(of({.user = 2, .groups = {5, 777}}).control);
  const Grants elsewhere = of({.user = {}, .address = "10.0.0.1"});
  EXPECT_TRUE(elsewhere.view);
  EXPECT_FALSE(elsewhere.control || elsewhere.record || elsewhere.admin);
}

TEST(Access, WhoeverHasNoRoleIsRefusedWithAWordOfWhy) {
  const auto roles = readRoles(keysOf({"here"}));
  EXPECT_TRUE(roles.access.identify({.user = kStranger}, "", "").ok());
  const auto refused = roles.access.identify({.user = {}, .address = "10.0.0.1"}, "", "");
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, Error::Code::PermissionDenied);
  EXPECT_THAT(refused.error().message, HasSubstr("10.0.0.1 has no role here"));
}

TEST(Access, ATokenOrACertificateSaysWhoSomebodyIs) {
  const std::filesystem::path folder = testing::TempDir();
  const std::string secret = "0123456789abcdef0123";
  std::ofstream{folder / "cell3.token"} << secret << "\n";
  ::chmod((folder / "cell3.token").c_str(), 0600);
  const auto roles = readRoles(
      keysOf({}, {"token:cell3", "certificate:plc"}, {}, {{"cell3", "cell3.token"}}), folder);
  ASSERT_TRUE(roles.complaints.empty()) << roles.complaints.front();
  const Peer far{.user = {}, .address = "10.0.0.1"};
  const auto by_token = roles.access.identify(far, secret, "");
  ASSERT_TRUE(by_token.ok());
  EXPECT_EQ(by_token->name, "token:cell3");
  EXPECT_TRUE(by_token->grants.control);
  EXPECT_EQ(roles.access.identify(far, "", "plc")->name, "certificate:plc");
  EXPECT_FALSE(roles.access.identify(far, "", "plc2").ok());
  EXPECT_FALSE(roles.access.identify(far, secret + "4", "").ok());
  EXPECT_THAT(roles.access.identify({.user = 0}, "guessed", "").error().message, HasSubstr("none of this daemon's"));
}

TEST(Access, WhatIsWrongInTheRolesIsToldWithItsKey) {
  const std::filesystem::path folder = testing::TempDir();
  std::ofstream{folder / "open.token"} << "0123456789abcdef0123";
  ::chmod((folder / "open.token").c_str(), 0644);
  std::ofstream{folder / "short.token"} << "secret";
  ::chmod((folder / "short.token").c_str(), 0600);
  const auto roles = readRoles(
      keysOf({"everybody"}, {"user:nobody-of-this-name"}, {"token:unknown"},
             {{"a", "open.token"}, {"b", "short.token"}, {"c", "missing.token"}}),
      folder);
  EXPECT_THAT(roles.complaints,
              testing::ElementsAre(HasSubstr("view has \"everybody\""), HasSubstr("this machine has no user of that name"),
                                   HasSubstr("no [[roles.token]] of that name"), HasSubstr("chmod 600"),
                                   HasSubstr("has a secret of 6 bytes"), HasSubstr("cannot be read")));
}

TEST(AuditLog, HasALineOfJsonForEachThingWithNothingThatBreaksIt) {
  const std::filesystem::path file = std::filesystem::path{testing::TempDir()} / "audit.log";
  std::filesystem::remove(file);
  const test::FakeClock clock;
  {
    const auto log = AuditLog::open(file, clock);
    ASSERT_TRUE(log.ok());
    (*log)->tell("user 5", "cam", "set \"gain\"\n= 3", {});
    (*log)->tell("user 6", "cam", "stop recording", Error{Error::Code::PermissionDenied, "not yours"});
  }
  std::ifstream in{file};
  std::string first, second, none;
  std::getline(in, first);
  std::getline(in, second);
  EXPECT_EQ(first,
            R"({"time":"2023-11-14T22:13:20.000Z","who":"user 5","source":"cam","what":"set \u0022gain\u0022\u000a= 3","done":true,"why_not":""})");
  EXPECT_THAT(second, HasSubstr(R"("done":false,"why_not":"not yours"})"));
  EXPECT_FALSE(std::getline(in, none));
}

}  // namespace
}  // namespace toftwin::daemon
