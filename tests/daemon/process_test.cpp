// SPDX-License-Identifier: Apache-2.0
// toftwind as a process: its exit codes, its messages, its signals.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <functional>
#include <optional>
#include <sstream>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <toftwin/client.h>

#include "protocol/record/recording.h"
#include "toftwind_process.h"

namespace toftwin {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;
using Policy = SubscribeOptions::Policy;

using test::kPattern;
using test::kSoon;
using test::Process;
using test::Toftwind;

TEST_F(Toftwind, StopsCleanlyOnSigterm) {
  configure(kPattern);
  Process daemon{arguments(), path("log")};
  ASSERT_TRUE(daemon.says("source cam: driver pattern")) << daemon.said();
  auto client = this->client();
  ASSERT_TRUE(client.ok()) << client.error().message;
  const auto recording = client->startRecording("cam", "run");
  ASSERT_TRUE(recording.ok()) << recording.error().message;
  auto stream = client->subscribe("cam", {.policy = Policy::Lossless});
  ASSERT_TRUE(stream->next(kSoon).ok());
  daemon.signal(SIGTERM);
  EXPECT_EQ(daemon.wait(), 0) << daemon.said();
  Result<Frame> last = stream->next(kSoon);
  while (last) last = stream->next(kSoon);
  EXPECT_EQ(last.error().code, Error::Code::Stopped) << last.error().message;
  EXPECT_FALSE(std::filesystem::exists(path("s")));
  const auto reader = record::Reader::open(*recording);
  ASSERT_TRUE(reader.ok());
  EXPECT_TRUE(reader->summary().indexed);
  EXPECT_GE(reader->summary().frames_per_source.at("cam"), 1u);
}

TEST_F(Toftwind, ReadsItsConfigurationAgainOnSighup) {
  configure(kPattern);
  Process daemon{arguments(), path("log")};
  ASSERT_TRUE(daemon.says("source cam: driver pattern")) << daemon.said();
  configure(kPattern + "colour = 1\n");
  daemon.signal(SIGHUP);
  ASSERT_TRUE(daemon.says("d.toml:7: unknown key \"colour\"")) << daemon.said();
  configure(kPattern + "[[source]]\nname = 'second'\ndriver = 'pattern'\n");
  daemon.signal(SIGHUP);
  ASSERT_TRUE(daemon.says("the new configuration is in force")) << daemon.said();
  EXPECT_EQ(client()->sources()->size(), 2u);
  daemon.signal(SIGINT);
  EXPECT_EQ(daemon.wait(), 0);
}

/// A configuration that the daemon reads when the test gives it.
class Pipe {
 public:
  explicit Pipe(std::string path) : path_(std::move(path)) { EXPECT_EQ(::mkfifo(path_.c_str(), 0600), 0); }
  /// Waits until the daemon has begun to read.
  void open() { fd_ = ::open(path_.c_str(), O_WRONLY | O_CLOEXEC); }
  void give(const std::string& text) {
    EXPECT_EQ(::write(fd_, text.data(), text.size()), static_cast<ssize_t>(text.size()));
    ::close(std::exchange(fd_, -1));
  }

 private:
  std::string path_;
  int fd_ = -1;
};

TEST_F(Toftwind, ASighupWhileItStartsIsAReloadAfterwards) {
  Pipe config{path("d.toml")};
  Process daemon{arguments(), path("log")};
  config.open();
  daemon.signal(SIGHUP);
  daemon.signal(SIGHUP);
  config.give(kPattern);
  ASSERT_TRUE(daemon.says("source cam: driver pattern")) << daemon.said();
  config.open();  // it reads again
  config.give(kPattern + "[[source]]\nname = 'second'\ndriver = 'pattern'\n");
  ASSERT_TRUE(daemon.says("the new configuration is in force")) << daemon.said();
  EXPECT_EQ(client()->sources()->size(), 2u);
  daemon.signal(SIGTERM);
  EXPECT_EQ(daemon.wait(), 0);
}

TEST_F(Toftwind, ASigtermWhileItStartsIsACleanStopAndASecondOneIsNotWaitedFor) {
  Pipe config{path("d.toml")};
  {
    Process daemon{arguments(), path("log")};
    config.open();
    daemon.signal(SIGTERM);
    config.give(kPattern);
    EXPECT_EQ(daemon.wait(), 0) << daemon.said();
    EXPECT_FALSE(std::filesystem::exists(path("s")));
  }
  Process stuck{arguments(), path("log2")};
  config.open();
  stuck.signal(SIGTERM);
  // The first one must have been taken before the second comes, or both are one.
  const auto pending = [&] {
    std::ifstream status{"/proc/" + std::to_string(stuck.pid()) + "/status"};
    for (std::string line; std::getline(status, line);) {
      if (line.starts_with("ShdPnd:")) return line.find_first_not_of("0\t", 7) != std::string::npos;
    }
    return false;
  };
  while (pending()) std::this_thread::yield();
  std::this_thread::sleep_for(10ms);  // from "no longer pending" to "the handler was entered"
  stuck.signal(SIGTERM);
  EXPECT_EQ(stuck.wait(), -SIGTERM);
}

TEST_F(Toftwind, WithoutAThreadForItARecordingIsRefusedAndTheDaemonServesOn) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "sanitizers need address space of their own";
#endif
  configure(kPattern);
  Process daemon{arguments(), path("log")};
  ASSERT_TRUE(daemon.says("source cam: driver pattern")) << daemon.said();
  auto client = this->client();
  ASSERT_TRUE(client.ok()) << client.error().message;
  ASSERT_TRUE(client->health().ok());
  std::ifstream status{"/proc/" + std::to_string(daemon.pid()) + "/status"};
  rlim_t used = 0;
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with("VmSize:")) used = std::stoull(line.substr(7)) * 1024;
  }
  rlimit before{};
  const rlimit little{used + (2 << 20), RLIM_INFINITY};  // no room for a thread's stack
  ASSERT_EQ(::prlimit(daemon.pid(), RLIMIT_AS, &little, &before), 0);
  const auto refused = client->startRecording("cam", "run");
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().message, HasSubstr("starting to record threw"));
  ASSERT_EQ(::prlimit(daemon.pid(), RLIMIT_AS, &before, nullptr), 0);
  auto again = this->client();
  ASSERT_TRUE(again.ok()) << again.error().message << daemon.said();
  const auto recording = again->startRecording("cam", "run");
  ASSERT_TRUE(recording.ok()) << recording.error().message;
  EXPECT_TRUE(again->stopRecording("cam").ok());
  EXPECT_EQ(again->health()->sources.at(0).last_error, "");
  daemon.signal(SIGTERM);
  EXPECT_EQ(daemon.wait(), 0);
}

TEST_F(Toftwind, ReplaysARecordingBitForBit) {
  configure(kPattern);
  std::vector<Frame> seen;
  {
    Process daemon{arguments(), path("log")};
    ASSERT_TRUE(daemon.says("source cam: driver pattern")) << daemon.said();
    auto client = this->client();
    ASSERT_TRUE(client->startRecording("cam", "run").ok());
    auto stream = client->subscribe("cam", {.policy = Policy::Lossless});
    for (int i = 0; i < 5; ++i) seen.push_back(*stream->next(kSoon));
    ASSERT_TRUE(client->stopRecording("cam").ok());
    daemon.signal(SIGTERM);
    ASSERT_EQ(daemon.wait(), 0);
  }
  configure("[[source]]\nname = 'again'\ndriver = 'replay'\nfile = 'run.mcap'\npace = 'fast'\n");
  Process daemon{arguments(), path("log")};
  ASSERT_TRUE(daemon.says("source again: driver replay")) << daemon.said();
  auto client = this->client();
  auto stream = client->subscribe("again", {.policy = Policy::Lockstep});
  std::size_t found = 0;
  for (Result<Frame> frame = stream->next(kSoon); frame && found < seen.size();
       frame = stream->next(kSoon)) {
    const Frame& original = seen[found];
    if (frame->moment.exposures != original.moment.exposures)
      continue;  // recorded before it was seen
    EXPECT_EQ(frame->moment, original.moment);
    EXPECT_EQ(frame->camera, original.camera);
    EXPECT_EQ(frame->provenance.kind, FrameKind::Replayed);
    ASSERT_EQ(frame->planes.size(), original.planes.size());
    for (std::size_t i = 0; i < frame->planes.size(); ++i) {
      EXPECT_TRUE(
          std::ranges::equal(frame->planes[i].data.bytes(), original.planes[i].data.bytes()));
    }
    ++found;
  }
  EXPECT_EQ(found, seen.size());
}

/// A busy machine can make a frame late, never early: each comes no sooner after the subscription than it was recorded
/// after the first.
TEST_F(Toftwind, ReplaysAtTheRecordedTimes) {
  configure(kPattern);
  const std::vector<std::chrono::milliseconds> recorded{0ms, 250ms, 300ms, 700ms};
  {
    Process daemon{arguments(), path("log")};
    ASSERT_TRUE(daemon.says("source cam: driver pattern")) << daemon.said();
    auto client = this->client();
    auto frame = client->subscribe("cam", {})->next(kSoon);
    ASSERT_TRUE(frame.ok()) << frame.error().message;
    auto writer = record::Writer::create(path("run.mcap"));
    const std::int64_t began_ns = frame->moment.received.ns;
    for (const auto after : recorded) {
      frame->moment.received.ns = began_ns + std::chrono::nanoseconds{after}.count();
      ASSERT_TRUE(writer->write(*frame).ok());
      ++frame->sequence;
    }
    ASSERT_TRUE(writer->close().ok());
  }
  configure("[[source]]\nname = 'again'\ndriver = 'replay'\nfile = 'run.mcap'\npace = 'exact'\n");
  Process daemon{arguments(), path("log")};
  ASSERT_TRUE(daemon.says("source again: driver replay")) << daemon.said();
  auto client = this->client();
  const auto subscribed = std::chrono::steady_clock::now();
  auto stream = client->subscribe("again", {.policy = Policy::Lossless});
  for (const auto after : recorded) {
    const auto frame = stream->next(kSoon);
    ASSERT_TRUE(frame.ok()) << frame.error().message;
    EXPECT_GE(std::chrono::steady_clock::now() - subscribed, after);
  }
}

/// The files of a recording that goes on and on, each opened.
std::vector<record::Reader> filesIn(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> names;
  for (const auto& entry : std::filesystem::directory_iterator{folder}) {
    if (entry.path().extension() == ".mcap") names.push_back(entry.path());
  }
  std::vector<record::Reader> readers;
  for (const auto& name : names) {
    auto reader = record::Reader::open(name);
    if (reader) readers.push_back(*std::move(reader));
  }
  // The newest may have been begun a moment before the kill, and have nothing yet.
  EXPECT_GE(readers.size() + 1, names.size());
  return readers;
}

TEST_F(Toftwind, ARecordingThatGoesOnAndOnIsSplitWithoutAGapAndOutlivesAKill) {
  configure(kPattern + "record = { file = 'cam-%H%M%S', split = '1s', keep = '100MB' }\n");
  const auto waitForFiles = [&](std::size_t count) {
    const auto deadline = std::chrono::steady_clock::now() + kSoon;
    const auto closed = [&] {
      std::size_t found = 0;
      for (const auto& entry : std::filesystem::directory_iterator{folder_}) found += entry.path().extension() == ".mcap";
      return found;
    };
    while (closed() < count && std::chrono::steady_clock::now() < deadline) std::this_thread::sleep_for(10ms);
    return closed() >= count;
  };
  {
    Process daemon{arguments(), path("log")};
    ASSERT_TRUE(daemon.says("cam: recording into ")) << daemon.said();
    EXPECT_TRUE(daemon.says("then the oldest files make room")) << daemon.said();
    ASSERT_TRUE(waitForFiles(4));
    const auto refused = client()->startRecording("cam", "another");
    EXPECT_EQ(refused.error().code, Error::Code::Busy);
    EXPECT_EQ(client()->health()->sources.at(0).recording_by, "the configuration");
    daemon.signal(SIGKILL);
    daemon.wait();
  }
  std::vector<std::uint64_t> sequences;
  std::size_t with_index = 0;
  auto files = filesIn(folder_);
  for (record::Reader& file : files) {
    with_index += file.summary().indexed ? 1 : 0;
    std::size_t frames = 0;
    for (auto frame = file.next("cam"); frame.ok(); frame = file.next("cam"), ++frames) {
      sequences.push_back(frame->sequence);
    }
    EXPECT_TRUE(frames > 0 || !file.summary().indexed) << "closed without a frame";
  }
  std::ranges::sort(sequences);  // files of one moment have no order
  for (std::size_t i = 1; i < sequences.size(); ++i) EXPECT_EQ(sequences[i], sequences[i - 1] + 1);
  EXPECT_GT(sequences.size(), 60u);
  EXPECT_GE(with_index + 1, files.size()) << "all but the one that was being written";
  Process again{arguments(), path("log2")};
  ASSERT_TRUE(waitForFiles(files.size() + 1)) << again.said();
}

TEST_F(Toftwind, AFullDiskEndsTheRecordingKeepsWhatWasWrittenAndSaysSo) {
  configure(
      "recording_folder = '.'\n[[source]]\nname = 'cam'\ndriver = 'pattern'\npace = 'fast'\n");
  // Files of at most 4 MB, so that the disk seems full after that; the signal that comes with it is
  // off.
  Process daemon{arguments(), path("log"), [] {
                   const rlimit limit{4 << 20, 4 << 20};
                   ::setrlimit(RLIMIT_FSIZE, &limit);
                   ::signal(SIGXFSZ, SIG_IGN);
                 }};
  ASSERT_TRUE(daemon.says("source cam: driver pattern")) << daemon.said();
  auto client = this->client();
  const auto recording = client->startRecording("cam", "run");
  ASSERT_TRUE(recording.ok()) << recording.error().message;
  ASSERT_TRUE(daemon.says("run.mcap: ")) << daemon.said();
  const auto health = client->health();
  ASSERT_TRUE(health.ok());
  EXPECT_THAT(health->sources.at(0).last_error, HasSubstr("recording: "));
  const auto stopped = client->stopRecording("cam");
  ASSERT_FALSE(stopped.ok());
  EXPECT_EQ(stopped.error().code, Error::Code::StorageFull) << stopped.error().message;
  EXPECT_TRUE(client->sources().ok()) << "the daemon serves on";
  const auto reader = record::Reader::open(*recording);
  ASSERT_TRUE(reader.ok()) << reader.error().message;
  const std::uint64_t frames = reader->summary().frames_per_source.at("cam");
  EXPECT_GE(frames, 1u);
  EXPECT_THAT(daemon.said(), HasSubstr("cam: recorded " + std::to_string(frames) + " frames into "));
  EXPECT_THAT(daemon.said(), HasSubstr(" more did not fit"));
}

TEST_F(Toftwind, AWrongConfigurationIsExitCodeTwoWithFileAndLine) {
  configure("[listen]\nport = 70000\n");
  Process daemon{{"--config", path("d.toml")}, path("log")};
  EXPECT_EQ(daemon.wait(), 2);
  EXPECT_THAT(daemon.said(),
              HasSubstr("d.toml:2: port = 70000 is out of bounds: it must be 0 to 65535"));
}

TEST_F(Toftwind, AMissingConfigurationIsNamed) {
  Process daemon{{"--config", path("none.toml")}, path("log")};
  EXPECT_EQ(daemon.wait(), 2);
  EXPECT_THAT(daemon.said(), HasSubstr("none.toml"));
}

TEST_F(Toftwind, CheckSaysWhetherTheConfigurationIsGood) {
  configure(kPattern);
  Process good{{"--check", "--config", path("d.toml")}, path("good")};
  EXPECT_EQ(good.wait(), 0);
  EXPECT_THAT(good.said(), HasSubstr("cam: toftwin test pattern"));
  EXPECT_THAT(good.said(), HasSubstr("is good: 1 source\n"));
  configure(kPattern + "[[facade]]\nkind = 'o3d303'\nsource = 'cam'\n");
  Process facade{{"--check", "--config", path("d.toml")}, path("facade")};
  EXPECT_EQ(facade.wait(), 0);
  EXPECT_THAT(facade.said(), HasSubstr("facade o3d303 of cam: good\n"));
  configure("");
  Process empty{{"--check", "--config", path("d.toml")}, path("empty")};
  EXPECT_EQ(empty.wait(), 0);
  EXPECT_THAT(empty.said(), HasSubstr("has no [[source]]"));
  configure(kPattern + "widht = 3\n");
  Process bad{{"--check", "--config", path("d.toml")}, path("bad")};
  EXPECT_EQ(bad.wait(), 2);
  EXPECT_THAT(bad.said(), HasSubstr("d.toml:7: unknown key \"widht\""));
}

TEST_F(Toftwind, ASecondOneIsRefusedAndNamesTheFirst) {
  configure(kPattern);
  Process first{arguments(), path("first")};
  ASSERT_TRUE(first.says("source cam: driver pattern")) << first.said();
  Process second{arguments(), path("second")};
  EXPECT_EQ(second.wait(), 1);
  EXPECT_THAT(second.said(), HasSubstr("another daemon (pid " + std::to_string(first.pid()) + ")"));
  EXPECT_TRUE(client()->health().ok());
}

TEST_F(Toftwind, ASocketOfAKilledDaemonDoesNotHinderTheNext) {
  configure(kPattern);
  {
    Process first{arguments(), path("first")};
    ASSERT_TRUE(first.says("source cam: driver pattern")) << first.said();
    first.signal(SIGKILL);
    EXPECT_EQ(first.wait(), -SIGKILL);
  }
  ASSERT_TRUE(std::filesystem::exists(path("s")));
  Process second{arguments(), path("second")};
  ASSERT_TRUE(second.says("source cam: driver pattern")) << second.said();
  EXPECT_TRUE(client()->health().ok());
}

TEST_F(Toftwind, WhereNoFolderIsForTheSocketItServesTcp) {
  configure(kPattern);
  const std::string nowhere = path("no/folder");
  Process daemon{{"--config", path("d.toml"), "--port", "0"}, path("log"), [&] {
                   ::setenv("RUNTIME_DIRECTORY", nowhere.c_str(), 1);
                 }};
  ASSERT_TRUE(daemon.says("listening on 127.0.0.1 port ")) << daemon.said();
  EXPECT_TRUE(daemon.says("no Unix socket, TCP only: " + nowhere)) << daemon.said();
  const std::string log = daemon.said();
  const std::string port = log.substr(log.find(" port ") + 6, 5);
  EXPECT_TRUE(Client::connect("localhost:" + std::to_string(std::stoi(port))).ok()) << log;
  daemon.signal(SIGTERM);
  EXPECT_EQ(daemon.wait(), 0);
  // A path that somebody wrote down must work.
  Process strict{{"--config", path("d.toml"), "--port", "0", "--socket", nowhere + "/s"}, path("l2")};
  EXPECT_EQ(strict.wait(), 1);
}

TEST_F(Toftwind, NoPermissionForTheSocketsFolderIsSaid) {
  if (::geteuid() != 0) {
    std::filesystem::create_directory(folder_ / "locked");
    std::filesystem::permissions(folder_ / "locked", std::filesystem::perms::none);
  }
  configure(kPattern);
  // Root may write anywhere but into /proc.
  const std::string socket = ::geteuid() == 0 ? "/proc/toftwin.sock" : path("locked/s");
  Process daemon{{"--config", path("d.toml"), "--port", "0", "--socket", socket}, path("log")};
  EXPECT_NE(daemon.wait(), 0);
  EXPECT_THAT(daemon.said(), HasSubstr(socket + ".lock: cannot be made"));
  EXPECT_THAT(daemon.said(), HasSubstr("--socket"));
}

}  // namespace
}  // namespace toftwin
