// SPDX-License-Identifier: Apache-2.0
// The real program renders campaigns, is killed, and goes on.
#include <fcntl.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <spawn.h>
#include <sys/file.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <map>
#include <random>
#include <thread>

#include "program.h"
#include "protocol/record/recording.h"
#include "tests/record/record_testing.h"
#include "tiny_camera.h"

extern char** environ;

namespace toftwin::cli {
namespace {

using record::bytesOf;
using testing::HasSubstr;
using testing::Not;
using Clock = std::chrono::steady_clock;

class Campaign : public testing::Test {
 protected:
  void SetUp() override {
    writeText(folder_ / "tiny.toml", std::string{kTinyCamera} + kRemembers);
    writeText(folder_ / "scene.toml", kMovingScene);
    writeText(folder_ / "walk.csv", kRightwards);
  }
  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  std::vector<std::string> arguments(const std::string& output,
                                     const std::vector<std::string>& more = {}) const {
    std::vector<std::string> all{"render",
                                 path("tiny.toml"),
                                 "--scene",
                                 path("scene.toml"),
                                 "--trajectory",
                                 path("walk.csv"),
                                 "--frames",
                                 "40",
                                 "--frame-interval-ms",
                                 "25",
                                 "-o",
                                 path(output)};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }
  Ran render(const std::string& output, const std::vector<std::string>& more = {}) const {
    std::string line;
    for (const std::string& argument : arguments(output, more)) line += " '" + argument + "'";
    return toftwin(line);
  }
  /// Starts the same and kills it after a while. Whether it was killed: else it was through already.
  bool isKilled(const std::string& output, std::chrono::microseconds after) const {
    std::vector<std::string> all = arguments(output);
    all.insert(all.begin(), TOFTWIN_PROGRAM);
    std::vector<char*> argv;
    for (std::string& argument : all) argv.push_back(argument.data());
    argv.push_back(nullptr);
    posix_spawn_file_actions_t quiet;
    ::posix_spawn_file_actions_init(&quiet);
    ::posix_spawn_file_actions_addopen(&quiet, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
    ::posix_spawn_file_actions_addopen(&quiet, STDERR_FILENO, path("err").c_str(),
                                       O_WRONLY | O_CREAT | O_TRUNC, 0666);
    pid_t child = -1;
    EXPECT_EQ(::posix_spawn(&child, TOFTWIN_PROGRAM, &quiet, nullptr, argv.data(), environ), 0);
    ::posix_spawn_file_actions_destroy(&quiet);
    std::this_thread::sleep_for(after);
    ::kill(child, SIGKILL);
    int status = 0;
    ::waitpid(child, &status, 0);
    EXPECT_TRUE(WIFSIGNALED(status) || WEXITSTATUS(status) == 0) << record::bytesOf(path("err")).size();
    return WIFSIGNALED(status);
  }
  /// All files below a folder with their bytes.
  std::map<std::string, std::vector<std::byte>> contents(const std::string& name) const {
    std::map<std::string, std::vector<std::byte>> all;
    for (const auto& entry : std::filesystem::directory_iterator{folder_ / name})
      all[entry.path().filename().string()] = bytesOf(entry.path());
    return all;
  }
  /// Renders the output undisturbed, and again with three kills and more at random times; says how often.
  int renderWithKills(const std::string& undisturbed, const std::string& killed) const {
    const auto began = Clock::now();
    EXPECT_EQ(render(undisturbed).status, 0);
    const auto took = std::chrono::duration_cast<std::chrono::microseconds>(Clock::now() - began);
    const auto seed = std::random_device{}();
    RecordProperty("seed", static_cast<int>(seed));
    fmt::print("seed {}\n", seed);
    std::mt19937 random{seed};
    int kills = 0;
    for (; kills < 200; ++kills) {
      // Later ones live longer, so that it comes to an end on any machine.
      std::uniform_int_distribution<std::int64_t> after{0, took.count() * (1 + kills / 5) / 3};
      if (!isKilled(killed, std::chrono::microseconds{after(random)})) break;
    }
    EXPECT_EQ(render(killed).status, 0);
    return kills;
  }
  record::Folder folder_;
};

TEST_F(Campaign, FilesOfAKilledOneAreThoseOfAnUndisturbedOne) {
  EXPECT_GT(renderWithKills("a/", "b/"), 0);
  const auto a = contents("a"), b = contents("b");
  EXPECT_EQ(a.size(), 40u * 5 + 2);
  EXPECT_TRUE(a == b);
}

TEST_F(Campaign, TheRecordingOfAKilledOneIsThatOfAnUndisturbedOne) {
  EXPECT_GT(renderWithKills("a.mcap", "b.mcap"), 0);
  EXPECT_TRUE(bytesOf(folder_ / "a.mcap") == bytesOf(folder_ / "b.mcap"));
  auto reader = record::Reader::open(folder_ / "b.mcap");
  ASSERT_TRUE(reader);
  EXPECT_TRUE(reader->summary().indexed);
  for (std::uint64_t number = 0; number < 40; ++number) {
    const auto frame = reader->next();
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->sequence, number);
    EXPECT_EQ(frame->source, "tiny");
  }
}

TEST_F(Campaign, TheHdf5FileOfAKilledOneIsThatOfAnUndisturbedOne) {
  if (runShell("h5diff --version").status != 0) GTEST_SKIP() << "there is no h5diff (hdf5-tools)";
  EXPECT_GT(renderWithKills("a.h5", "b.h5"), 0);
  const Ran compared = runShell("h5diff '" + path("a.h5") + "' '" + path("b.h5") + "'");
  EXPECT_EQ(compared.status, 0) << compared.out << compared.err;
  EXPECT_THAT(runShell("h5dump -d /frames/sequence '" + path("b.h5") + "'").out, HasSubstr("38, 39\n"));
}

TEST_F(Campaign, ADamagedOrMissingFileIsRenderedAgain) {
  ASSERT_EQ(render("a/").status, 0);
  const auto before = contents("a");
  writeText(folder_ / "a" / "frame-000007-range.npy", "damaged");
  std::filesystem::remove(folder_ / "a" / "frame-000030-flags.npy");
  const Ran again = render("a/");
  EXPECT_EQ(again.status, 0);
  EXPECT_THAT(again.out, HasSubstr("40 frames, 38 of them there already"));
  EXPECT_TRUE(contents("a") == before);
}

TEST_F(Campaign, AnotherOneIsRefusedAndSaysWhatDiffers) {
  for (const char* output : {"a/", "a.mcap", "a.h5", "a.png"}) {
    SCOPED_TRACE(output);
    ASSERT_EQ(render(output).status, 0);
    const Ran other = render(output, {"--samples", "5"});
    EXPECT_EQ(other.status, 4);
    EXPECT_THAT(other.err, HasSubstr("samples_per_pixel: 4 there, 5 here"));
    EXPECT_THAT(other.err, Not(HasSubstr("seed")));
    EXPECT_THAT(other.err, HasSubstr("--overwrite"));
    writeText(folder_ / "walk.csv", std::string{kRightwards} + "2,1,0,0,1,0,0,0\n");
    EXPECT_THAT(render(output).err, HasSubstr("walk.csv says something else than it did"));
    writeText(folder_ / "walk.csv", kRightwards);
    EXPECT_THAT(render(output).out, HasSubstr("40 of them there already"));
    EXPECT_EQ(render(output, {"--samples", "5", "--overwrite"}).status, 0);
    EXPECT_THAT(render(output, {"--samples", "5", "--overwrite"}).out, HasSubstr("40 of them there already"))
        << "what is of this campaign needs no overwriting";
  }
}

TEST_F(Campaign, ASceneOrCameraThatSaysSomethingElseIsAnotherOne) {
  ASSERT_EQ(render("a/").status, 0);
  std::string scene = kMovingScene;
  writeText(folder_ / "scene.toml", "# a comment changes nothing\n" + scene);
  EXPECT_EQ(render("a/").status, 0);
  scene.replace(scene.find("0.5"), 3, "0.6");
  writeText(folder_ / "scene.toml", scene);
  EXPECT_THAT(render("a/").err, HasSubstr("scene.toml says something else"));
  writeText(folder_ / "scene.toml", kMovingScene);
  writeText(folder_ / "tiny.toml", kTinyCamera);
  EXPECT_THAT(render("a/").err, HasSubstr("tiny.toml says something else"));
}

TEST_F(Campaign, FilesOfSomebodyElseAreNotReplaced) {
  std::filesystem::create_directory(folder_ / "a");
  for (const auto& [file, output] : {std::pair{"a/frame-000039-depth.npy", "a/"},
                                     {"b.mcap", "b.mcap"},
                                     {"c.h5", "c.h5"},
                                     {"d-0003.png", "d.png"}}) {
    writeText(folder_ / file, "precious");
    const Ran ran = render(output);
    EXPECT_EQ(ran.status, 4) << output;
    EXPECT_THAT(ran.err, HasSubstr("there is such a file already"));
    EXPECT_EQ(bytesOf(folder_ / file).size(), 8u);
    EXPECT_FALSE(std::filesystem::exists(folder_ / (std::string{output} + ".campaign.toml")));
    EXPECT_EQ(render(output, {"--overwrite"}).status, 0) << output;
  }
}

TEST_F(Campaign, TwoAtOnceDoNotMix) {
  ASSERT_EQ(render("a/").status, 0);
  const int held = ::open(path("a/campaign.toml").c_str(), O_RDWR);
  ASSERT_EQ(::flock(held, LOCK_EX), 0);
  const Ran ran = render("a/");
  ::close(held);
  EXPECT_EQ(ran.status, 5);
  EXPECT_THAT(ran.err, HasSubstr("another `toftwin` is writing this campaign"));
}

TEST_F(Campaign, AFullDiskIsSaidAndGoneOnFrom) {
  for (const char* output : {"a/", "a.mcap", "a.h5", "a.png"}) {
    SCOPED_TRACE(output);
    // The largest file may have 40 kB: of the one-file formats some frames fit, of the others not even the
    // memory.
    std::string line;
    for (const std::string& argument : arguments(output)) line += " '" + argument + "'";
    const Ran full = runShell("trap '' XFSZ; ulimit -f 40; '" TOFTWIN_PROGRAM "'" + line);
    EXPECT_EQ(full.status, 6);
    EXPECT_THAT(full.err, HasSubstr("cannot write: File too large; free space there"));
    EXPECT_THAT(full.err, HasSubstr("of 40 frames are there, and the same command goes on from there"));
    EXPECT_THAT(full.err, Not(HasSubstr(".part")));
    const Ran freed = render(output);
    EXPECT_EQ(freed.status, 0) << freed.err;
    EXPECT_THAT(freed.out, HasSubstr("40 frames"));
  }
}

TEST_F(Campaign, WhatIsWrongIsSaidBeforeAnythingIsWritten) {
  writeText(folder_ / "unsorted.csv",
            "time_s,x_m,y_m,z_m,q_w,q_x,q_y,q_z\n1,0,0,0,1,0,0,0\n0,0,0,0,1,0,0,0\n");
  const auto with = [&](const std::string& trajectory, const std::string& output) {
    return toftwin("render generic_cw --samples 1 --trajectory '" + path(trajectory) + "' -o '" +
                   path(output) + "'");
  };
  EXPECT_THAT(with("unsorted.csv", "a/").err, HasSubstr("unsorted.csv:3: time_s = 0 is not later"));
  EXPECT_EQ(with("missing.csv", "a/").status, 4);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "a"));
  EXPECT_EQ(with("walk.csv", "no/such/folder/").status, 6);
  EXPECT_EQ(with("walk.csv", "no/such/a.mcap").status, 6);
  EXPECT_EQ(with("walk.csv", "no/such/a.h5").status, 6);
  if (::geteuid() != 0) {
    std::filesystem::create_directory(folder_ / "locked");
    std::filesystem::permissions(folder_ / "locked", std::filesystem::perms::owner_read);
    EXPECT_THAT(with("walk.csv", "locked/").err, HasSubstr("choose a folder that you may write to"));
  }
  for (const auto& [arguments, what] : std::vector<std::pair<std::string, std::string>>{
           {"--frames 3 -o a/ --format jpeg", "png, npy, ply and csv"},
           {"--frames 3 -o a.h5 --format npy", "--format has a meaning for a folder only"},
           {"--frames 3 -o a/ --color", "--color has a meaning for .png only"},
           {"--frames 3 -o a.mcap --scale 2", "--scale has a meaning for"},
           {"--frames 3 -o a/ --images", "--images has a meaning for one frame only"},
           {"-o a.png --overwrite", "--overwrite has a meaning for campaigns only"},
           {"--trajectory walk.csv --position 0,0,0 -o a/", "leave the options of a pose out"},
           {"--frames 0 -o a/", "--frames"},
           {"-o a.jpeg", ".png, .ply, .npy, .csv, .pcd, .tif, .exr, .h5, .mcap"}}) {
    const Ran ran = toftwin("render generic_cw " + arguments);
    EXPECT_EQ(ran.status, 2) << arguments;
    EXPECT_THAT(ran.err, HasSubstr(what)) << arguments;
  }
  EXPECT_THAT(toftwin("render generic_cw --frames 2 --frame-interval-ms 1 -o '" + path("a/") + "'").err,
              HasSubstr("the raw exposures of a frame take 11.5 ms"));
  EXPECT_THAT(toftwin("render generic_cw --frames 2 -p color -o '" + path("a/") + "'").err,
              HasSubstr("have no plane color"));
}

TEST_F(Campaign, CtrlCLeavesWhatIsDone) {
  std::string line;
  for (const std::string& argument : arguments("a.mcap", {"--samples", "4096"}))
    line += " '" + argument + "'";
  const Ran ran = runShell("'" TOFTWIN_PROGRAM "'" + line + " &\nwhile [ ! -e '" + path("a.mcap") +
                           "' ]; do sleep 0.01; done; kill -INT $!; wait $!");
  EXPECT_EQ(ran.status, 130);
  EXPECT_THAT(ran.err, HasSubstr("interrupted; 0 of 40 frames are there, and the same command goes on"));
}

}  // namespace
}  // namespace toftwin::cli
