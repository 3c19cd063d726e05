// SPDX-License-Identifier: Apache-2.0
// Against the reference implementation (npm: @mcap/core): it reads what we write, every CRC and
// index checked, and we read what it writes.
#include <gmock/gmock.h>

#include <cstdlib>
#include <sstream>

#include "protocol/record/recording.h"
#include "protocol/wire/codec.h"
#include "tests/protocol/example_messages.h"
#include "tests/record/record_testing.h"

namespace toftwin::record {
namespace {

constexpr int kFrames = 60;

/// Two sources, 60 frames, 33 ms apart; in each every value is another.
Frame frameOf(int i) {
  Frame frame = wire::exampleFrame(40, 30);
  frame.source = i % 3 == 0 ? "o3d" : "kinect";
  frame.sequence = static_cast<std::uint64_t>(i);
  frame.moment.received = {1'760'000'000'000'000'000 + 33'000'000ll * i};
  frame.moment.clock = {frame.moment.received.ns - 5'000'000, 1500};
  Image<float> range_m{40, 30};
  std::mt19937 random{static_cast<unsigned>(i)};
  for (float& range : range_m.pixels()) range = static_cast<float>(random() % 65536) / 8192.0f;
  frame.planes[0] = toPlane(PlaneKind::Range, std::move(range_m));
  return frame;
}
std::vector<std::byte> wireBytes(const Frame& frame) {
  return wire::toBytes(*wire::encode(wire::FrameMessage{0, frame}));
}
std::string lineOf(const Frame& frame) {
  std::ostringstream line;
  line << frame.source << '\t' << frame.sequence << '\t' << frame.moment.received.ns << '\t'
       << frame.moment.exposures[0].start.ns + frame.moment.clock.host_minus_device_ns;
  return line.str();
}

class Reference : public testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(std::filesystem::path{TOFTWIN_MCAP_REFERENCE} / "installed")) {
      GTEST_SKIP()
          << "the reference implementation could not be installed (see mcap_reference_install)";
    }
    std::filesystem::create_directory(messages_);
  }
  /// Runs reference.mjs; what it printed goes to the test's output.
  static int run(const std::string& arguments) {
    return std::system(("cd '" TOFTWIN_MCAP_REFERENCE "' && node '" TOFTWIN_SOURCE_DIR
                        "/tests/record/mcap-reference/reference.mjs' " +
                        arguments)
                           .c_str());
  }
  void expectItReadsOurs(WriterOptions options) {
    auto writer = Writer::create(file_, options);
    ASSERT_TRUE(writer);
    for (int i = 0; i < kFrames; ++i) ASSERT_TRUE(writer->write(frameOf(i)));
    ASSERT_TRUE(writer->close());
    ASSERT_EQ(run("read '" + file_.string() + "' '" + messages_.string() + "'"), 0);
    std::ifstream lines{messages_ / "messages.tsv"};
    std::string line;
    for (int i = 0; i < kFrames; ++i) {
      ASSERT_TRUE(std::getline(lines, line));
      EXPECT_EQ(line, lineOf(frameOf(i)));
      EXPECT_EQ(bytesOf(messages_ / (std::to_string(i) + ".bin")), wireBytes(frameOf(i)));
    }
    EXPECT_FALSE(std::getline(lines, line));
  }
  void expectWeReadIts(const std::string& compression, bool indexed) {
    std::ofstream lines{messages_ / "messages.tsv"};
    for (int i = 0; i < kFrames; ++i) {
      lines << lineOf(frameOf(i)) << '\n';
      writeBytes(messages_ / (std::to_string(i) + ".bin"), wireBytes(frameOf(i)));
    }
    lines.close();
    ASSERT_EQ(run("write '" + file_.string() + "' '" + messages_.string() + "' " + compression), 0);
    auto reader = Reader::open(file_);
    ASSERT_TRUE(reader) << reader.error().message;
    EXPECT_EQ(reader->summary().indexed, indexed);
    EXPECT_EQ(reader->summary().damage, "");
    EXPECT_EQ(reader->summary().frames_per_source.at("o3d"), kFrames / 3u);
    for (int i = 0; i < kFrames; ++i) {
      const auto frame = reader->next();
      ASSERT_TRUE(frame) << frame.error().message;
      EXPECT_EQ(wireBytes(*frame), wireBytes(frameOf(i)));
    }
    EXPECT_EQ(reader->next().error().code, Error::Code::EndOfStream);
    ASSERT_TRUE(reader->seek(frameOf(41).moment.received.ns));
    EXPECT_EQ(reader->next()->sequence, 41u);
  }

  Folder folder_;
  std::filesystem::path file_ = folder_ / "a.mcap";
  std::filesystem::path messages_ = folder_ / "messages";
};

TEST_F(Reference, ItReadsOursCompressed) { expectItReadsOurs({.chunk_bytes = 100'000}); }
TEST_F(Reference, ItReadsOursNotCompressed) {
  expectItReadsOurs({.chunk_bytes = 100'000, .zstd_level = 0});
}
TEST_F(Reference, WeReadItsZstdChunks) { expectWeReadIts("zstd", true); }
TEST_F(Reference, WeReadItsLz4Chunks) { expectWeReadIts("lz4", true); }
TEST_F(Reference, WeReadItsPlainChunks) { expectWeReadIts("none", true); }
TEST_F(Reference, WeReadItsMessagesOutsideOfChunks) { expectWeReadIts("unchunked", false); }

}  // namespace
}  // namespace toftwin::record
