// SPDX-License-Identifier: Apache-2.0
// A program with libaravis as its author would write it, and Wireshark's dissectors as judges of all packets.
#include <arv.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <cmath>

#include "gige_vision_testing.h"

namespace toftwin::daemon {
namespace {

using namespace test;

struct Unref {
  void operator()(void* object) const { g_object_unref(object); }
};
template <class T>
using Object = std::unique_ptr<T, Unref>;

/// Frames of one stream.
struct Received {
  struct Image {
    std::size_t parts = 0, bytes = 0;
    int width = 0, height = 0;
    std::uint64_t id = 0, stamp_ns = 0;
    double chunk_stamp_ns = -1.0, chunk_exposure_us = -1.0, chunk_frame = -1.0;
  };
  std::vector<Image> images;
  int failed = 0;
};

struct Wish {
  bool is_multipart = false;
  std::string chunks{};
  bool has_long_ids = false;
  std::optional<std::array<int, 4>> region{};
};

Received receive(ArvCamera* camera, const Wish& wish, int count) {
  Received received;
  ArvDevice* device = arv_camera_get_device(camera);
  arv_camera_gv_set_multipart(camera, wish.is_multipart ? TRUE : FALSE, nullptr);
  arv_camera_gv_set_stream_options(camera, ARV_GV_STREAM_OPTION_PACKET_SOCKET_DISABLED);
  arv_device_set_string_feature_value(device, "GevGVSPExtendedIDMode", wish.has_long_ids ? "On" : "Off",
                                      nullptr);
  arv_camera_set_chunk_mode(camera, FALSE, nullptr);
  if (!wish.chunks.empty()) arv_camera_set_chunks(camera, wish.chunks.c_str(), nullptr);
  if (wish.region) {
    const auto [x, y, width, height] = *wish.region;
    arv_camera_set_region(camera, x, y, width, height, nullptr);
  }
  const Object<ArvChunkParser> parser{arv_camera_create_chunk_parser(camera)};
  const Object<ArvStream> stream{arv_camera_create_stream(camera, nullptr, nullptr, nullptr)};
  if (stream == nullptr) {
    ADD_FAILURE() << "no stream";
    return received;
  }
  g_object_set(stream.get(), "packet-request-ratio", 2.0, "frame-retention", 2'000'000U, nullptr);
  const guint payload = arv_camera_get_payload(camera, nullptr);
  for (int i = 0; i < 8; ++i) arv_stream_push_buffer(stream.get(), arv_buffer_new_allocate(payload));
  GError* error = nullptr;
  arv_camera_start_acquisition(camera, &error);
  EXPECT_EQ(error, nullptr) << error->message;
  for (int i = 0; i < count; ++i) {
    ArvBuffer* buffer = arv_stream_timeout_pop_buffer(stream.get(), 10'000'000);
    if (buffer == nullptr) {
      ADD_FAILURE() << "no frame";
      break;
    }
    received.failed += arv_buffer_get_status(buffer) == ARV_BUFFER_STATUS_SUCCESS ? 0 : 1;
    Received::Image image;
    image.parts = arv_buffer_get_n_parts(buffer);
    arv_buffer_get_data(buffer, &image.bytes);
    gint x = 0, y = 0;
    arv_buffer_get_part_region(buffer, 0, &x, &y, &image.width, &image.height);
    image.id = arv_buffer_get_frame_id(buffer);
    image.stamp_ns = arv_buffer_get_timestamp(buffer);
    if (arv_buffer_has_chunks(buffer) != FALSE) {
      const auto whole = [&](const char* name) {
        return static_cast<double>(arv_chunk_parser_get_integer_value(parser.get(), buffer, name, nullptr));
      };
      image.chunk_stamp_ns = whole("ChunkTimestamp");
      image.chunk_frame = whole("ChunkFrameID");
      image.chunk_exposure_us =
          arv_chunk_parser_get_float_value(parser.get(), buffer, "ChunkExposureTime", nullptr);
    }
    received.images.push_back(image);
    arv_stream_push_buffer(stream.get(), buffer);
  }
  arv_camera_stop_acquisition(camera, nullptr);
  return received;
}

class GigeVisionClient : public RunningGigeVision {
 protected:
  Object<ArvCamera> open() {
    GError* error = nullptr;
    Object<ArvCamera> camera{arv_camera_new(address_.c_str(), &error)};
    EXPECT_EQ(error, nullptr) << error->message;
    return camera;
  }
};

constexpr std::size_t kPixels = 176 * 132;
const std::string kAllChunks = "Timestamp,ExposureTime,FrameID";

TEST_F(GigeVisionClient, ReadsOneImageOrAllWithAndWithoutChunksAndLongIds) {
  startGige(kSmallSim);
  EXPECT_EQ(facadeClients(), 0u);
  const auto camera = open();
  ASSERT_NE(camera, nullptr);
  EXPECT_EQ(facadeClients(), 1u);
  for (const bool is_multipart : {false, true}) {
    for (const bool has_chunks : {false, true}) {
      const Received received = receive(
          camera.get(),
          {.is_multipart = is_multipart, .chunks = has_chunks ? kAllChunks : "", .has_long_ids = has_chunks},
          4);
      EXPECT_EQ(received.failed, 0);
      ASSERT_EQ(received.images.size(), 4U);
      for (std::size_t i = 0; i < received.images.size(); ++i) {
        const auto& image = received.images[i];
        EXPECT_EQ(image.parts, is_multipart ? 3U + (has_chunks ? 1U : 0U) : 1U);
        const std::size_t chunk_bytes = has_chunks ? 3 * 16 + (is_multipart ? 0 : 8) : 0;
        EXPECT_EQ(image.bytes, kPixels * (is_multipart ? 6 : 2) + chunk_bytes);
        EXPECT_EQ(image.width, 176);
        EXPECT_EQ(image.height, 132);
        if (i > 0) {
          EXPECT_GT(image.stamp_ns, received.images[i - 1].stamp_ns);
        }
        if (!has_chunks) continue;
        EXPECT_EQ(image.chunk_stamp_ns, static_cast<double>(image.stamp_ns));
        EXPECT_GT(image.chunk_exposure_us, 0.0);
        if (i == 0) continue;
        // Ids also leave out what the source was too busy to make.
        EXPECT_GE(image.chunk_frame, received.images[i - 1].chunk_frame + 1.0);
        EXPECT_LE(image.chunk_frame - received.images[i - 1].chunk_frame,
                  static_cast<double>(image.id - received.images[i - 1].id));
      }
    }
  }
}

TEST_F(GigeVisionClient, TellsTheTimeOnTheSourcesClockOrOnTheDaemons) {
  startGige(kSmallSim);
  const auto camera = open();
  ASSERT_NE(camera, nullptr);
  ArvDevice* device = arv_camera_get_device(camera.get());
  constexpr std::uint64_t kMinute_ns = 60'000'000'000;
  const auto expectNear = [&](std::uint64_t later_ns, std::uint64_t earlier_ns) {
    EXPECT_GE(later_ns, earlier_ns);
    EXPECT_LT(later_ns - earlier_ns, kMinute_ns);
  };
  for (const bool on_host : {false, true}) {
    arv_device_set_boolean_feature_value(device, "PtpEnable", on_host ? TRUE : FALSE, nullptr);
    const std::chrono::nanoseconds host = std::chrono::system_clock::now().time_since_epoch();
    const Received received = receive(camera.get(), {}, 3);
    ASSERT_EQ(received.images.size(), 3U);
    const std::uint64_t stamp_ns = received.images.back().stamp_ns;
    expectNear(stamp_ns, on_host ? static_cast<std::uint64_t>(host.count()) - kMinute_ns / 2 : 0U);
    for (const char* command : {"TimestampLatch", "GevTimestampControlLatch"}) {
      arv_device_execute_command(device, command, nullptr);
      for (const char* value : {"TimestampLatchValue", "GevTimestampValue"})
        expectNear(static_cast<std::uint64_t>(arv_device_get_integer_feature_value(device, value, nullptr)),
                   stamp_ns);
    }
    arv_device_execute_command(device, "PtpDataSetLatch", nullptr);
    EXPECT_STREQ(arv_device_get_string_feature_value(device, "PtpStatus", nullptr),
                 on_host ? "Slave" : "Disabled");
  }
}

TEST_F(GigeVisionClient, ReadsAPartOfTheImage) {
  startGige(kSmallSim);
  const auto camera = open();
  ASSERT_NE(camera, nullptr);
  const Received received = receive(camera.get(), {.is_multipart = true, .region = {{8, 16, 40, 30}}}, 2);
  EXPECT_EQ(received.failed, 0);
  for (const auto& image : received.images) {
    EXPECT_EQ(image.width, 40);
    EXPECT_EQ(image.height, 30);
    EXPECT_EQ(image.bytes, 40U * 30U * 6U);
  }
}

TEST_F(GigeVisionClient, FindsTheLargestPacketThatComesThrough) {
  startGige(kSmallSim);
  const auto camera = open();
  ASSERT_NE(camera, nullptr);
  GError* error = nullptr;
  const guint size = arv_camera_gv_auto_packet_size(camera.get(), &error);
  EXPECT_EQ(error, nullptr);
  EXPECT_GT(size, 9000U);  // loopback takes 65,536
  EXPECT_EQ(receive(camera.get(), {.is_multipart = true}, 3).failed, 0);
}

TEST_F(GigeVisionClient, SendsNothingThatWiresharkCallsMalformed) {
  if (!hasProgram("tshark"))
    GTEST_SKIP() << "tshark is not installed (tools/install-dependencies --for test)";
  startGige(kSmallSim, "[facade.line]\nloss = 0.02\nseed = 3");
  const std::string file = (folder_ / "packets.pcapng").string(), said = file + ".log";
  const Ran begun = run(fmt::format(
      "sh -c 'dumpcap -q -i lo -B 64 -a duration:60 -f \"udp and net {}/32\" -w {} > {} 2>&1 & echo $!'",
      address_, file, said));
  const auto stop = [&] { ::kill(std::stoi(begun.output), SIGINT); };
  // It says so when it captures; where it may not, it ends.
  const Ran waited = run(fmt::format(
      "sh -c 'for i in $(seq 100); do test -s {} && exit 0; kill -0 {} || exit 1; sleep 0.1; done'", file,
      std::stoi(begun.output)));
  if (waited.status != 0) GTEST_SKIP() << "packets cannot be captured here: " << run("cat " + said).output;
  gint64 port = 0;
  {
    const auto camera = open();
    ASSERT_NE(camera, nullptr);
    port = arv_device_get_integer_feature_value(arv_camera_get_device(camera.get()), "GevSCSP", nullptr);
    arv_camera_gv_auto_packet_size(camera.get(), nullptr);
    arv_camera_gv_set_packet_size(camera.get(), 1500, nullptr);
    for (const bool is_multipart : {false, true}) {
      for (const std::string& chunks : {std::string{}, kAllChunks})
        EXPECT_EQ(
            receive(camera.get(),
                    {.is_multipart = is_multipart, .chunks = chunks, .has_long_ids = !chunks.empty()}, 5)
                .failed,
            0);
    }
  }
  stop();
  const std::string read = fmt::format("tshark -r {} -d udp.port=={},gvsp", file, port);
  ASSERT_TRUE(eventually(
      [&] { return run(fmt::format("sh -c '! kill -0 {}'", std::stoi(begun.output))).status == 0; }));
  const auto lines = [&](const std::string& filter) {
    const Ran ran = run(fmt::format("sh -c \"{} -Y '{}' 2> /dev/null | wc -l\"", read, filter));
    return std::stoi(ran.output);
  };
  EXPECT_GT(lines("gvcp"), 100);
  EXPECT_GT(lines("gvsp"), 500);
  EXPECT_GT(lines("gvsp.status == 0x0100 or gvsp.flag.packetresend == 1"), 0);
  EXPECT_EQ(lines("_ws.malformed"), 0) << run(read + " -Y _ws.malformed -V").output;
  EXPECT_EQ(lines("_ws.expert.severity >= 6291456"), 0)
      << run(read + " -Y '_ws.expert.severity >= 6291456'").output;
}

}  // namespace
}  // namespace toftwin::daemon
