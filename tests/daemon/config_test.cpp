// SPDX-License-Identifier: Apache-2.0
#include "daemon/config.h"

#include <gtest/gtest.h>

#include <fmt/format.h>

#include "daemon/recorder.h"
#include "drivers/not_built.h"
#include "drivers/source.h"

namespace toftwin::daemon {
namespace {

Result<Config> parse(const std::string& toml, const std::vector<std::string>& running = {}) {
  return parseConfig(toml, "/etc/toftwin/toftwind.toml", drivers::allDrivers(), running);
}
std::string errorOf(const std::string& toml) {
  const auto config = parse(toml);
  return config ? "no error" : config.error().message;
}
#define EXPECT_SAYS(text, part) EXPECT_NE((text).find(part), std::string::npos) << (text)

TEST(Config, OfAnEmptyFileIsTheDefault) {
  const auto config = parse("");
  ASSERT_TRUE(config.ok()) << config.error().message;
  EXPECT_EQ(config->keys.listen.port, 47800);
  EXPECT_EQ(config->keys.listen.address, "127.0.0.1");
  EXPECT_TRUE(config->sources.empty());
}

TEST(Config, OpensItsSources) {
  const auto config = parse(
      "[[source]]\nname = 'a'\ndriver = 'pattern'\nwidth = 64\n"
      "[[source]]\nname = 'b'\ndriver = 'pattern'\nstart = 'always'");
  ASSERT_TRUE(config.ok()) << config.error().message;
  ASSERT_EQ(config->sources.size(), 2u);
  ASSERT_TRUE(config->sources[0].opened.ok());
  EXPECT_EQ((*config->sources[0].opened)->info().camera.width, 64);
  EXPECT_EQ(config->sources[1].keys.start, SourceKeys::Start::Always);
}

TEST(Config, ADriverThatThrowsWhenOpenedIsACameraThatIsNotThere) {
  const drivers::Driver throwing{
      .name = "throwing",
      .summary = "",
      .list = [] { return std::vector<std::string>{}; },
      .open = [](settings::Table&) -> Result<std::unique_ptr<drivers::Source>> { throw 42; },
      .document = [] { return std::string{}; }};
  const auto config = parseConfig("[[source]]\nname = 'a'\ndriver = 'throwing'\n", "d.toml",
                                  {&throwing, 1});
  ASSERT_TRUE(config.ok()) << config.error().message;
  ASSERT_FALSE(config->sources.at(0).opened.ok());
  EXPECT_SAYS(config->sources[0].opened.error().message, "the driver threw something");
}

constexpr const char* kAlsoAGoodOne = "[[source]]\nname = 'good'\ndriver = 'pattern'\n";

TEST(Config, WhatADeviceAnswersKeepsNoOtherSourceAway) {
  const drivers::Driver answering{
      .name = "answering",
      .summary = "",
      .list = [] { return std::vector<std::string>{}; },
      .open = [](settings::Table& table) -> Result<std::unique_ptr<drivers::Source>> {
        const auto code = table.number("code", {0, 14}, {}, true);
        return Error{static_cast<Error::Code>(*code), "the camera has no 640 x 480 on USB 2"};
      },
      .document = [] { return std::string{}; }};
  std::vector<drivers::Driver> drivers{drivers::allDrivers().begin(), drivers::allDrivers().end()};
  drivers.push_back(answering);
  for (int code = 0; code <= 14; ++code) {
    const auto config = parseConfig(
        fmt::format("[[source]]\nname = 'a'\ndriver = 'answering'\ncode = {}\n{}", code, kAlsoAGoodOne), "d.toml",
        drivers);
    ASSERT_TRUE(config.ok()) << code << ": " << config.error().message;
    ASSERT_FALSE(config->sources.at(0).opened.ok());
    EXPECT_SAYS(config->sources[0].opened.error().message, "no 640 x 480");
    EXPECT_TRUE(config->sources.at(1).opened.ok());
  }
}

struct LidarKeys {
  std::string uri;
  template <class Visitor>
  void visit(Visitor& v) {
    v.text("uri", uri, "which");
  }
};
struct AboutLidar {
  static constexpr std::string_view name = "lidar", summary = "", remedy = "install liblidar-dev";
  using Keys = LidarKeys;
};

TEST(Config, ADriverThatWasNotBuiltKeepsNoOtherSourceAway) {
  std::vector<drivers::Driver> drivers{drivers::allDrivers().begin(), drivers::allDrivers().end()};
  drivers.push_back(drivers::notBuilt<AboutLidar>());
  const auto config = parseConfig(
      fmt::format("[[source]]\nname = 'a'\ndriver = 'lidar'\nuri = 'lidar:1'\n{}", kAlsoAGoodOne), "d.toml",
      drivers);
  ASSERT_TRUE(config.ok()) << config.error().message;
  ASSERT_FALSE(config->sources.at(0).opened.ok());
  EXPECT_EQ(config->sources[0].opened.error().code, Error::Code::Unsupported);
  EXPECT_SAYS(config->sources[0].opened.error().message,
              "d.toml:3: the driver \"lidar\" was not built: install liblidar-dev");
  EXPECT_TRUE(config->sources.at(1).opened.ok());
}

TEST(Config, WhatADeviceDoesNotTakeIsItsAnswerWhateverItsDriverCallsIt) {
  const drivers::Driver picky{.name = "picky",
                              .summary = "",
                              .list = [] { return std::vector<std::string>{}; },
                              .open = [](settings::Table&) -> Result<std::unique_ptr<drivers::Source>> {
                                return Error{Error::Code::InvalidArgument, "gain = 3: it must be 0 to 2"};
                              },
                              .document = [] { return std::string{}; }};
  const auto config = parseConfig("[[source]]\nname = 'cam'\ndriver = 'picky'\n", "d.toml", {&picky, 1});
  ASSERT_TRUE(config.ok()) << config.error().message;
  EXPECT_EQ(config->sources.at(0).opened.error().code, Error::Code::Incompatible);
}

TEST(Config, AFacadeThatWasNotBuiltKeepsNothingElseAway) {
  const FacadeKind lacking{.name = "telegraph",
                           .summary = "",
                           .read = nullptr,
                           .document = [] { return std::string{}; },
                           .not_built = "not built: install libmorse-dev"};
  const auto config = parseConfig(
      fmt::format("{}[[facade]]\nkind = 'telegraph'\nsource = 'good'\nspeed = 3\n", kAlsoAGoodOne), "d.toml",
      drivers::allDrivers(), {}, {&lacking, 1});
  ASSERT_TRUE(config.ok()) << config.error().message;
  EXPECT_TRUE(config->sources.at(0).opened.ok());
  ASSERT_EQ(config->facades.size(), 1u);
  EXPECT_FALSE(config->facades[0].start);
  EXPECT_EQ(config->facades[0].not_built, "d.toml:5: it was not built: install libmorse-dev");
}

TEST(Config, ErrorsNameFileLineKeyBoundAndUnit) {
  const std::string error = errorOf("[limits]\nhandshake_s = 0\nsesions = 3");
  EXPECT_SAYS(
      error,
      "/etc/toftwin/toftwind.toml:2: handshake_s = 0 s is out of bounds: it must be 0.1 to 3600 s");
  EXPECT_SAYS(error, "/etc/toftwin/toftwind.toml:3: unknown key \"sesions\"");
}

TEST(Config, ADriversUnknownKeyIsAnErrorAtItsLine) {
  EXPECT_SAYS(errorOf("[[source]]\nname = 'a'\ndriver = 'pattern'\ncolour = 3"),
              "toftwind.toml:4: unknown key \"colour\"");
}

TEST(Config, AnUnknownDriverIsNamedWithThoseThatThereAre) {
  const std::string error = errorOf("[[source]]\nname = 'a'\ndriver = 'patern'\nwidth = 3");
  EXPECT_SAYS(error, "toftwind.toml:3: driver");
  EXPECT_SAYS(error, "\"patern\" is not in this build; there are: pattern");
  EXPECT_EQ(error.find("unknown key"), std::string::npos) << error;
}

TEST(Config, SourcesNeedNamesOfTheirOwn) {
  EXPECT_SAYS(errorOf("[[source]]\ndriver = 'pattern'"), "toftwind.toml:1: name is missing: ");
  EXPECT_SAYS(errorOf("[[source]]\nname = 'a/b'\ndriver = 'pattern'"),
              "toftwind.toml:2: name = \"a/b\" is no name: ");
  EXPECT_SAYS(
      errorOf(
          "[[source]]\nname = 'a'\ndriver = 'pattern'\n[[source]]\nname = 'a'\ndriver = 'pattern'"),
      "toftwind.toml:5: name = \"a\" is the name of another source already");
}

TEST(Config, AnAddressOthersReachNeedsTheWordForIt) {
  EXPECT_SAYS(errorOf("[listen]\naddress = '0.0.0.0'"), "allow_remote = true");
  EXPECT_SAYS(errorOf("[listen]\naddress = '::'"), "allow_remote = true");
  EXPECT_EQ(errorOf("[listen]\naddress = '0.0.0.0'\nallow_remote = true\ninsecure = true"), "no error");
  EXPECT_SAYS(errorOf("[listen]\naddress = '0.0.0.0'\nallow_remote = true"), "no certificate and no roles");
  EXPECT_SAYS(errorOf("[listen]\naddress = '0.0.0.0'\nallow_remote = true\n[roles]\nview = ['anyone']"),
              "is no certificate, so that anybody listens");
  EXPECT_SAYS(errorOf("[listen]\ncertificate = 'c.pem'"), "certificate and key belong together");
  EXPECT_SAYS(errorOf("[listen]\ncertificate = 'c.pem'\nkey = 'k.pem'"), "c.pem: cannot be used as a certificate");
  EXPECT_SAYS(errorOf("[roles]\nview = ['everybody']"), "has \"everybody\", but must have user:NAME");
  EXPECT_EQ(errorOf("[listen]\naddress = '::1'"), "no error");
  EXPECT_SAYS(errorOf("[listen]\nport = 1\naddress = '0.0.0.0'"), "toftwind.toml:3: address = ");
}

TEST(Config, AnAddressThatIsNoneIsCalledThat) {
  const std::string error = errorOf("[listen]\naddress = 'fish'");
  EXPECT_SAYS(error, "toftwind.toml:2: address = \"fish\" is no IP address: use 127.0.0.1");
  EXPECT_EQ(error.find("allow_remote"), std::string::npos) << error;
}

TEST(Config, ErrorsComeOnceEachInTheOrderOfTheLines) {
  const std::string error = errorOf(
      "[[source]]\nname = 'a'\ndriver = 'sim'\nuri = 'sim:kinect_v3'\nscene = 'none.toml'\n"
      "[[source]]\nname = 'b'\ndriver = 'pattern'\nwidth = 1\n[limits]\nsessions = 0");
  std::size_t at = 0;
  for (const char* line : {"toml:4: uri = \"sim:kinect_v3\"", "toml:5: scene = \"none.toml\"",
                           "toml:9: width = 1", "toml:11: sessions = 0"}) {
    const std::size_t found = error.find(line);
    ASSERT_NE(found, std::string::npos) << line << " is not in\n" << error;
    EXPECT_GE(found, at) << line << " comes too early in\n" << error;
    EXPECT_EQ(error.find(line, found + 1), std::string::npos) << line << " comes twice in\n" << error;
    at = found;
  }
}

TEST(Config, AMissingPresetOrFileIsAnErrorOfTheFile) {
  EXPECT_SAYS(errorOf("[[source]]\nname = 'a'\ndriver = 'sim'\nuri = 'sim:kinect_v2'\ncamera = 'c.toml'"),
              "has no meaning beside camera = \"c.toml\"");
  EXPECT_SAYS(errorOf("[[source]]\nname = 'a'\ndriver = 'sim'\nuri = 'sim:kinect_v3'"),
              "sim:kinect_v2");
  EXPECT_SAYS(errorOf("[[source]]\nname = 'a'\ndriver = 'sim'\ncamera = 'none.toml'"),
              "toml:4: camera = \"none.toml\"");
  EXPECT_SAYS(errorOf("[[source]]\nname = 'a'\ndriver = 'replay'\nfile = 'none.mcap'"),
              "toml:4: file \"none.mcap\"");
}

TEST(Config, ARelativeSocketLiesBesideTheFile) {
  EXPECT_EQ(parse("[listen]\nsocket = 'run/s'")->keys.listen.socket, "/etc/toftwin/run/s");
  EXPECT_EQ(parse("[listen]\nsocket = 'auto'")->keys.listen.socket, "auto");
  EXPECT_EQ(parse("[listen]\nsocket = ''")->keys.listen.socket, "");
}

TEST(Config, ACameraThatIsNotThereIsNoErrorOfTheFile) {
  const auto config = parse("[[source]]\nname = 'a'\ndriver = 'pattern'\nuri = 'pattern:9'");
  ASSERT_TRUE(config.ok());
  ASSERT_FALSE(config->sources[0].opened.ok());
  EXPECT_SAYS(config->sources[0].opened.error().message, "pattern:9");
}

TEST(Config, ARunningSourceIsRecognisedWhateverTheLayoutAndNotOpened) {
  const auto before = parse("[[source]]\nname = 'a'\ndriver = 'pattern'\nwidth = 64");
  const std::vector<std::string> running{before->sources[0].fingerprint};
  const auto same =
      parse("# comment\n[[source]]\nwidth = 64\n\ndriver = 'pattern'\nname = 'a'", running);
  ASSERT_TRUE(same.ok()) << same.error().message;
  EXPECT_TRUE(same->sources[0].is_as_before);
  const auto other = parse("[[source]]\nname = 'a'\ndriver = 'pattern'\nwidth = 65", running);
  EXPECT_FALSE(other->sources[0].is_as_before);
}

TEST(Config, DocumentsEveryKey) {
  const std::string text = documentConfig(drivers::allDrivers());
  for (const char* key :
       {"listen.port", "limits.subscription_backlog_mb", "recording_folder", "recording.max_mb",
        "recording.keep_free_mb", "start", "frame_rate_hz"}) {
    EXPECT_SAYS(text, key);
  }
}

TEST(RecordingPath, TakesOnlyBareNames) {
  const std::filesystem::path folder = testing::TempDir();
  EXPECT_EQ(recordingPath(folder, "run-1")->filename(), "run-1.mcap");
  EXPECT_EQ(recordingPath(folder, "run.mcap")->filename(), "run.mcap");
  for (const char* bad : {"", "../up", "/abs", "a/b", ".hidden", "..", "a b", "a\nb"}) {
    EXPECT_FALSE(recordingPath(folder, bad).ok()) << bad;
  }
  EXPECT_FALSE(recordingPath(folder, std::string(201, 'a')).ok());
}

}  // namespace
}  // namespace toftwin::daemon
