// SPDX-License-Identifier: Apache-2.0
// Recordings of frames: bit for bit, through kill -9 and a full disk.
#include "protocol/record/recording.h"

#include <gmock/gmock.h>
#include <grp.h>
#include <sched.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <fstream>

#include "protocol/record/mcap_reader.h"
#include "protocol/record/mcap_writer.h"
#include "protocol/wire/codec.h"
#include "tests/protocol/example_messages.h"
#include "tests/record/record_testing.h"

namespace toftwin::record {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

std::int64_t timeOf(int i) { return 1'760'000'000'000'000'000 + 33'000'000ll * i; }

/// Frame i: 32 × 24 pixels in three planes, every value and every time another than in frame i + 1.
Frame frameOf(int i, std::string source = "kinect") {
  Frame frame = wire::exampleFrame(32, 24);
  frame.source = std::move(source);
  frame.sequence = static_cast<std::uint64_t>(i);
  frame.moment.received = {timeOf(i)};
  frame.moment.exposures[0].start = {1000 + 33'000'000ll * i};
  frame.moment.clock = {timeOf(0) - 2'000'000, 1500};
  Image<float> range_m{32, 24};
  for (std::size_t k = 0; k < range_m.size(); ++k)
    range_m[k] = static_cast<float>(i) + 0.001f * static_cast<float>(k);
  frame.planes[0] = toPlane(PlaneKind::Range, std::move(range_m));
  return frame;
}

std::vector<std::byte> wireBytes(const Frame& frame) {
  return wire::toBytes(*wire::encode(wire::FrameMessage{0, frame}));
}

/// Reads frames until the first error, which is returned; each must be frameOf(first + n), bit for
/// bit.
Error expectFrames(Reader& reader, int first, int& count) {
  for (count = 0;; ++count) {
    const auto frame = reader.next();
    if (!frame) return frame.error();
    EXPECT_EQ(wireBytes(*frame), wireBytes(frameOf(first + count))) << "frame " << first + count;
    if (testing::Test::HasFailure()) return {};
  }
}

class Recording : public testing::Test {
 protected:
  Folder folder_;
  std::filesystem::path file_ = folder_ / "a.mcap";

  void record(int frames, WriterOptions options = {}) {
    auto writer = Writer::create(file_, options);
    ASSERT_TRUE(writer) << writer.error().message;
    for (int i = 0; i < frames; ++i) ASSERT_TRUE(writer->write(frameOf(i)));
    EXPECT_EQ(writer->frames(), static_cast<std::uint64_t>(frames));
    ASSERT_TRUE(writer->close());
    ASSERT_TRUE(writer->close()) << "closing twice";
  }
};

TEST_F(Recording, FramesComeBackBitForBit) {
  record(100, {.chunk_bytes = 40'000});
  auto reader = Reader::open(file_);
  ASSERT_TRUE(reader) << reader.error().message;
  EXPECT_TRUE(reader->summary().indexed);
  EXPECT_THAT(reader->summary().damage, IsEmpty());
  EXPECT_EQ(reader->summary().frames_per_source,
            (std::map<std::string, std::uint64_t>{{"kinect", 100}}));
  EXPECT_EQ(reader->summary().first_ns, timeOf(0));
  EXPECT_EQ(reader->summary().last_ns, timeOf(99));
  int count = 0;
  EXPECT_EQ(expectFrames(*reader, 0, count).code, Error::Code::EndOfStream);
  EXPECT_EQ(count, 100);
  reader->rewind();
  expectFrames(*reader, 0, count);
  EXPECT_EQ(count, 100);
}

TEST_F(Recording, WhatCanBeWrittenCanBeReadAndAFrameThatIsTooLargeIsRefused) {
  auto writer = Writer::create(file_);
  ASSERT_TRUE(writer);
  Frame large = frameOf(0);
  large.camera.width = large.camera.height = 8192;
  constexpr std::uint64_t kMost = wire::Limits{}.body_bytes;  // 8192 x 8192 floats, to the byte
  large.planes = {{PlaneKind::Range, ElementType::F32, 8192, 8192, 1, wire::zeros(kMost)}};
  ASSERT_TRUE(writer->write(large));
  large.planes.push_back({PlaneKind::Flags, ElementType::U8, 8192, 8192, 1, wire::zeros(kMost / 4)});
  const auto refused = writer->write(large);
  ASSERT_FALSE(refused) << "a frame that nobody can read";
  EXPECT_EQ(refused.error().code, Error::Code::TooLarge);
  ASSERT_TRUE(writer->write(frameOf(1))) << "the recording goes on";
  EXPECT_EQ(writer->frames(), 2u);
  ASSERT_TRUE(writer->close());
  auto reader = Reader::open(file_);
  ASSERT_TRUE(reader) << reader.error().message;
  const auto first = reader->next();
  ASSERT_TRUE(first) << first.error().message;
  EXPECT_EQ(first->planes.at(0).data.size(), kMost);
  const auto second = reader->next();
  ASSERT_TRUE(second) << second.error().message;
  EXPECT_EQ(wireBytes(*second), wireBytes(frameOf(1)));
  EXPECT_EQ(reader->next().error().code, Error::Code::EndOfStream);
}

TEST_F(Recording, SeekGoesToTheFirstFrameAtOrAfterATime) {
  record(100, {.chunk_bytes = 40'000});
  auto reader = Reader::open(file_);
  ASSERT_TRUE(reader);
  int count = 0;
  for (int i : {50, 99, 3}) {
    ASSERT_TRUE(reader->seek(timeOf(i) - 10'000'000));
    expectFrames(*reader, i, count);
    EXPECT_EQ(count, 100 - i);
  }
  ASSERT_TRUE(reader->seek(-1));
  expectFrames(*reader, 0, count);
  EXPECT_EQ(count, 100);
}

TEST_F(Recording, EachSourceCanBeReadAlone) {
  auto writer = Writer::create(file_);
  ASSERT_TRUE(writer);
  for (int i = 0; i < 30; ++i)
    ASSERT_TRUE(writer->write(frameOf(i, i % 3 == 0 ? "o3d" : "kinect")));
  ASSERT_TRUE(writer->close());
  auto reader = Reader::open(file_);
  ASSERT_TRUE(reader);
  EXPECT_EQ(reader->summary().frames_per_source.at("kinect"), 20u);
  EXPECT_EQ(reader->summary().frames_per_source.at("o3d"), 10u);
  for (std::uint64_t i = 0; i < 10; ++i) {
    const auto frame = reader->next("o3d");
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->sequence, 3 * i);
  }
  EXPECT_EQ(reader->next("o3d").error().code, Error::Code::EndOfStream);
}

TEST_F(Recording, PlanesThatWereReadAreAligned) {
  record(3);
  auto reader = Reader::open(file_);
  ASSERT_TRUE(reader);
  for (int i = 0; i < 3; ++i) {
    const auto frame = reader->next();
    ASSERT_TRUE(frame);
    for (const Plane& plane : frame->planes) {
      EXPECT_EQ(reinterpret_cast<std::uintptr_t>(plane.data.bytes().data()) % 64, 0u);
    }
  }
}

TEST_F(Recording, SaysWhenAFrameWasTakenAndReceived) {
  auto writer = Writer::create(file_);
  ASSERT_TRUE(writer);
  Frame known = frameOf(0), unknown = frameOf(1);
  unknown.moment.clock.uncertainty_ns = -1;
  Frame overflowing = frameOf(2);
  overflowing.moment.exposures[0].start.ns = std::numeric_limits<std::int64_t>::max();
  Frame before_1970 = frameOf(3);
  before_1970.moment.received.ns = -5;
  for (const Frame& frame : {known, unknown, overflowing, before_1970})
    ASSERT_TRUE(writer->write(frame));
  ASSERT_TRUE(writer->close());
  auto file = mcap::FileReader::open(file_);
  ASSERT_TRUE(file);
  auto message = file->next();
  EXPECT_EQ(message->log_time_ns, static_cast<std::uint64_t>(timeOf(0)));
  EXPECT_EQ(message->publish_time_ns, static_cast<std::uint64_t>(timeOf(0) - 2'000'000 + 1000));
  EXPECT_EQ(file->next()->publish_time_ns, static_cast<std::uint64_t>(timeOf(1)));
  EXPECT_EQ(file->next()->publish_time_ns, static_cast<std::uint64_t>(timeOf(2)));
  EXPECT_EQ(file->next()->log_time_ns, 0u);
}

TEST_F(Recording, AChannelNamesTheCameraAndACameraThatChangesGetsItsOwn) {
  auto writer = Writer::create(file_);
  ASSERT_TRUE(writer);
  Frame other = frameOf(1);
  other.camera.calibration_id = "ffffffffffffffffffffffffffffffff";
  other.camera.fx = 400.5;
  ASSERT_TRUE(writer->write(frameOf(0)));
  ASSERT_TRUE(writer->write(other));
  ASSERT_TRUE(writer->close());
  auto file = mcap::FileReader::open(file_);
  ASSERT_TRUE(file);
  ASSERT_EQ(file->channels().size(), 2u);
  const mcap::Channel& channel = file->channels().at(1);
  EXPECT_EQ(channel.topic, "kinect");
  EXPECT_EQ(channel.message_encoding, "toftwin");
  EXPECT_EQ(channel.metadata.at("calibration_id"), other.camera.calibration_id);
  EXPECT_THAT(channel.metadata.at("camera"), HasSubstr("\"fx\":400.5"));
  EXPECT_EQ(file->schemas().at(1).encoding, "flatbuffer");
  EXPECT_EQ(Reader::open(file_)->summary().frames_per_source.at("kinect"), 2u);
}

TEST_F(Recording, AKilledRecorderLosesAtMostTheOpenChunk) {
  constexpr std::uint64_t kChunk = 30'000;
  const std::size_t frame_bytes = wireBytes(frameOf(0)).size();
  int pipe_ends[2];
  ASSERT_EQ(::pipe(pipe_ends), 0);
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) {  // the recorder: says after each frame that it is written, until it is killed
    auto writer =
        Writer::create(file_, {.chunk_bytes = kChunk, .chunk_time = std::chrono::hours{1}});
    for (int i = 0; writer && writer->write(frameOf(i)) && ::write(pipe_ends[1], "x", 1) == 1;
         ++i) {
    }
    ::_exit(1);
  }
  int reported = 0;
  for (char x = 0; reported < 64 && ::read(pipe_ends[0], &x, 1) == 1;) ++reported;
  ::kill(child, SIGKILL);
  int status = 0;
  ::waitpid(child, &status, 0);
  ASSERT_TRUE(WIFSIGNALED(status));
  ::close(pipe_ends[0]);
  ::close(pipe_ends[1]);

  auto reader = Reader::open(file_);
  ASSERT_TRUE(reader) << reader.error().message;
  EXPECT_FALSE(reader->summary().indexed);
  EXPECT_THAT(reader->summary().damage, HasSubstr("was not closed"));
  int count = 0;
  EXPECT_EQ(expectFrames(*reader, 0, count).code, Error::Code::EndOfStream);
  // A chunk is finished as soon as it holds kChunk bytes, so fewer bytes than that are open.
  const int open_at_most = static_cast<int>((kChunk + frame_bytes - 1) / frame_bytes);
  EXPECT_GE(count, reported - open_at_most);
  EXPECT_GT(count, 0);
}

/// Records until the first error; how many frames were written until then.
Error recordUntilError(Writer& writer, int& frames) {
  for (frames = 0; frames < 10'000; ++frames) {
    if (auto wrote = writer.write(frameOf(frames)); !wrote) return wrote.error();
  }
  return {};
}

/// The disk is full: the error says so, again and again, and the file opens with all but the last
/// chunk.
void expectWholeUpToTheLastChunk(Writer& writer, const std::filesystem::path& file) {
  int written = 0;
  const Error full = recordUntilError(writer, written);
  EXPECT_EQ(full.code, Error::Code::StorageFull) << full.message;
  EXPECT_THAT(full.message, HasSubstr(file.string()));
  EXPECT_THAT(full.message, HasSubstr("free space"));
  EXPECT_EQ(writer.write(frameOf(written)).error().code, Error::Code::StorageFull);
  EXPECT_EQ(writer.close().error().code, Error::Code::StorageFull);
  auto reader = Reader::open(file);
  ASSERT_TRUE(reader) << reader.error().message;
  // The torn chunk was taken back, which left room for the index (the chunks here are longer than
  // it).
  EXPECT_TRUE(reader->summary().indexed) << reader->summary().damage;
  int count = 0;
  EXPECT_EQ(expectFrames(*reader, 0, count).code, Error::Code::EndOfStream);
  EXPECT_GT(count, 0);
  EXPECT_GE(count, written - 4);  // the frames of one chunk of 30,000 bytes
  EXPECT_EQ(writer.frames(), static_cast<std::uint64_t>(count)) << "counts what is not in the file";
  // With the one whose writing failed; the one after it was refused.
  EXPECT_EQ(writer.lost(), static_cast<std::uint64_t>(written + 1 - count));
}

TEST_F(Recording, AFileSizeLimitIsAFullDisk) {
  std::signal(SIGXFSZ, SIG_IGN);  // as every program of ours does; otherwise it kills
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  const rlimit small{300'000, before.rlim_max};
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &small), 0);
  auto writer = Writer::create(file_, {.chunk_bytes = 30'000, .zstd_level = 0});
  if (writer) expectWholeUpToTheLastChunk(*writer, file_);
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &before), 0);
  EXPECT_TRUE(writer);
  std::signal(SIGXFSZ, SIG_DFL);
}

constexpr int kImpossibleHere = 77;

/// The exit status of a child process that runs `body`; −1 if it did not exit by itself.
template <class Body>
int inAChild(Body body) {
  const pid_t child = ::fork();
  if (child == 0) {
    body();
    ::_exit(testing::Test::HasFailure() ? 1 : 0);
  }
  int status = 0;
  if (child < 0 || ::waitpid(child, &status, 0) != child || !WIFEXITED(status)) return -1;
  return WEXITSTATUS(status);
}

/// Enters a mount namespace of its own, so nothing stays mounted; whoever may not, in a user
/// namespace in which they are root.
bool enterMountNamespace() {
  const auto uid = ::geteuid();
  const auto gid = ::getegid();
  if (::unshare(CLONE_NEWNS) != 0) {
    if (::unshare(CLONE_NEWUSER | CLONE_NEWNS) != 0) return false;
    std::ofstream{"/proc/self/setgroups"} << "deny";
    std::ofstream{"/proc/self/uid_map"} << "0 " << uid << " 1";
    std::ofstream{"/proc/self/gid_map"} << "0 " << gid << " 1";
  }
  return ::mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) == 0;
}

TEST_F(Recording, AFullFileSystemKeepsAllWholeChunks) {
  const std::filesystem::path small = folder_ / "small";
  std::filesystem::create_directory(small);
  const int status = inAChild([&] {
    if (!enterMountNamespace() || ::mount("tmpfs", small.c_str(), "tmpfs", 0, "size=500k") != 0) {
      ::_exit(kImpossibleHere);
    }
    auto writer = Writer::create(small / "a.mcap", {.chunk_bytes = 30'000, .zstd_level = 0});
    ASSERT_TRUE(writer) << writer.error().message;
    expectWholeUpToTheLastChunk(*writer, small / "a.mcap");
  });
  if (status == kImpossibleHere)
    GTEST_SKIP()
        << "this system lets this user mount a tmpfs neither as is nor in a user namespace";
  EXPECT_EQ(status, 0);
}

/// Writes frames until a bound ends it, closes, and reads all of them back; gives how many.
int writeUpToTheBound(Writer writer, const std::filesystem::path& file, const char* reason) {
  Result<> wrote;
  int written = 0;
  while ((wrote = writer.write(frameOf(written))) && written < 10'000) ++written;
  EXPECT_FALSE(wrote) << "the bound did not end it";
  if (wrote) return written;
  EXPECT_EQ(wrote.error().code, Error::Code::StorageFull);
  EXPECT_THAT(wrote.error().message, HasSubstr(reason));
  EXPECT_TRUE(writer.close()) << "a bound is no failure of the file";
  auto reader = Reader::open(file);
  EXPECT_TRUE(reader) << reader.error().message;
  if (!reader) return written;
  EXPECT_TRUE(reader->summary().indexed) << reader->summary().damage;
  int count = 0;
  EXPECT_EQ(expectFrames(*reader, 0, count).code, Error::Code::EndOfStream);
  EXPECT_EQ(count, written);
  return written;
}

TEST_F(Recording, ABoundOnTheFileHoldsWhenItIsClosed) {
  for (const std::uint64_t chunk : {1ull, 30'000ull, 1ull << 30}) {
    for (const int level : {0, 1}) {
      const WriterOptions options{.chunk_bytes = chunk, .zstd_level = level, .most_bytes = 300'000};
      const auto file = folder_ / (std::to_string(chunk) + "-" + std::to_string(level));
      auto writer = Writer::create(file, options);
      ASSERT_TRUE(writer) << writer.error().message;
      const int written = writeUpToTheBound(*std::move(writer), file, "than the 0 MB that it may");
      EXPECT_LE(std::filesystem::file_size(file), 300'000u) << file;
      // Not compressed, it is too early by what is reserved for one more channel (twice 2048 bytes) and for
      // the ends (512), and by at most 40 bytes for the index of each chunk.
      const std::uint64_t reserved = 2 * 2048 + 512 + 40ull * static_cast<unsigned>(written);
      const std::uint64_t one_more = wireBytes(frameOf(0)).size() + 200;
      if (level == 0) {
        EXPECT_GT(std::filesystem::file_size(file) + reserved + one_more, 300'000u) << file;
      }
    }
  }
}

TEST_F(Recording, ABoundOnFreeSpaceIsKeptFromTheFirstFrameOn) {
  auto writer = Writer::create(file_, {.keep_free_bytes = 1ull << 62});
  ASSERT_TRUE(writer);
  EXPECT_EQ(writeUpToTheBound(*std::move(writer), file_, "free on its disk"), 0);
}

TEST_F(Recording, LeavesTheSpaceFreeThatItIsToldTo) {
  const std::filesystem::path small = folder_ / "small";
  std::filesystem::create_directory(small);
  const int status = inAChild([&] {
    if (!enterMountNamespace() || ::mount("tmpfs", small.c_str(), "tmpfs", 0, "size=1m") != 0) {
      ::_exit(kImpossibleHere);
    }
    const std::filesystem::path file = small / "a.mcap";
    auto writer = Writer::create(
        file, {.chunk_bytes = 30'000, .zstd_level = 0, .keep_free_bytes = 600'000});
    ASSERT_TRUE(writer) << writer.error().message;
    EXPECT_GT(writeUpToTheBound(*std::move(writer), file, "free on its disk"), 10);
    EXPECT_GE(std::filesystem::space(small).available, 600'000u);
  });
  if (status == kImpossibleHere)
    GTEST_SKIP()
        << "this system lets this user mount a tmpfs neither as is nor in a user namespace";
  EXPECT_EQ(status, 0);
}

TEST_F(Recording, ADeviceThatIsFullIsNamedAtOnce) {
  const auto writer = Writer::create("/dev/full", {.overwrite = true});
  ASSERT_FALSE(writer);
  EXPECT_EQ(writer.error().code, Error::Code::StorageFull);
}

TEST_F(Recording, AFolderThatMayNotBeWrittenIsNamed) {
  constexpr unsigned kNobody = 65534;
  using std::filesystem::perms;
  const std::filesystem::path closed = folder_ / "closed";
  std::filesystem::create_directory(closed);
  std::filesystem::permissions(closed, perms::owner_read | perms::owner_exec);
  const int status = inAChild([&] {
    // Root may write everywhere, so it first becomes somebody who may not.
    if (::geteuid() == 0 &&
        (::setgroups(0, nullptr) != 0 || ::setgid(kNobody) != 0 || ::setuid(kNobody) != 0)) {
      ::_exit(kImpossibleHere);
    }
    const auto writer = Writer::create(closed / "a.mcap");
    ASSERT_FALSE(writer);
    EXPECT_EQ(writer.error().code, Error::Code::PermissionDenied);
    EXPECT_THAT(writer.error().message, HasSubstr(closed.string()));
  });
  if (status == kImpossibleHere)
    GTEST_SKIP() << "root may write everywhere, and here it cannot become another user";
  EXPECT_EQ(status, 0);
}

TEST_F(Recording, AnMcapFileWithoutFramesIsIncompatible) {
  auto file = mcap::FileWriter::create(file_, {});
  ASSERT_TRUE(file->addChannel({0, 0, "/chatter", "json", {}}));
  ASSERT_TRUE(file->close());
  const auto reader = Reader::open(file_);
  ASSERT_FALSE(reader);
  EXPECT_EQ(reader.error().code, Error::Code::Incompatible);
  EXPECT_THAT(reader.error().message, HasSubstr("\"/chatter\" has the encoding \"json\""));
}

TEST_F(Recording, AMessageThatIsNoFrameIsOneErrorAndTheNextIsRead) {
  auto file = mcap::FileWriter::create(file_, {});
  ASSERT_TRUE(file->addChannel({0, 0, "kinect", "toftwin", {}}));
  for (int i = 0; i < 3; ++i) {
    std::vector<std::byte> bytes = wireBytes(frameOf(i));
    if (i == 1) bytes[bytes.size() / 2] ^= std::byte{1};
    const std::span<const std::byte> pieces[] = {bytes};
    ASSERT_TRUE(file->write({0, static_cast<std::uint32_t>(i), 5, 5, {}}, pieces));
  }
  ASSERT_TRUE(file->close());
  auto reader = Reader::open(file_);
  ASSERT_TRUE(reader);
  EXPECT_TRUE(reader->next());
  const auto bad = reader->next();
  ASSERT_FALSE(bad);
  EXPECT_EQ(bad.error().code, Error::Code::Malformed);
  EXPECT_THAT(bad.error().message, HasSubstr("the message with sequence 1"));
  EXPECT_TRUE(reader->next());
  EXPECT_EQ(reader->next().error().code, Error::Code::EndOfStream);
}

}  // namespace
}  // namespace toftwin::record
