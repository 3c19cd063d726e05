// SPDX-License-Identifier: Apache-2.0
// The ROS 2 facade in a running daemon; its clients are programs on another maker's DDS.
#include <netinet/in.h>
#include <signal.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <limits>
#include <map>
#include <random>
#include <set>
#include <thread>

#include "gige_vision_testing.h"
#include "ros2_testing.h"

namespace toftwin::daemon {
namespace {

using namespace test;
using Policy = SubscribeOptions::Policy;
using testing::AllOf, testing::AnyOf, testing::Ge, testing::Le;

CdrWriter poseMessage(const std::array<double, 7>& numbers, const std::string& frame = "world") {
  CdrWriter cdr;
  cdr.number<std::int32_t>(5).number<std::uint32_t>(6).text(frame);
  for (const double one : numbers) cdr.number(one);
  return cdr;
}

std::int64_t wallNow() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

class Ros2Facade : public RunningRos2 {};

TEST_F(Ros2Facade, APoseThatIsSentIsWhereTheNextFrameIsFrom) {
  startRos2("pace = 'trigger'\n" + kSmallSim, "pose_topic = '/amr/pose'\ntrigger_on_pose = true\n");
  auto* transforms = program_->read("/tf_static", kTransforms, Asks::Latched);
  auto* images = program_->read("/cam/depth/image_raw", kImage);
  auto* poses = program_->write("/amr/pose", kPose);
  auto native_client = client();
  auto stream = native_client.subscribe("cam", {.policy = Policy::Queue, .queue = 64});
  ASSERT_TRUE(stream.ok());
  ASSERT_TRUE(eventually([&] { return isRead(poses) && isWritten(images); }));
  const auto send = [&](const std::array<double, 7>& numbers, const std::string& frame = "world") {
    ASSERT_TRUE(poses->write(&poseMessage(numbers, frame).bytes()));
  };
  // Again and again: a reader that this writer knows may not know the writer yet.
  ASSERT_TRUE(eventually([&] {
    send({0, 0, 0, 0, 0, 0, std::nan("")});
    std::this_thread::sleep_for(std::chrono::milliseconds{50});
    return log_->count("unit quaternion") > 0;
  }));
  send({1e300, 0, 0, 0.9, 0, 0, 0.9});
  ASSERT_TRUE(log_->waitFor("1e+300", 1));
  send({0, 0, 0, 0, 0, 0, 1}, "map");
  ASSERT_TRUE(log_->waitFor("not in \"world\"", 1));
  const std::int64_t sent_ns = wallNow();
  const Transform<World, Camera> expected{{0.8, 0.0, 0.6, 0.0}, {0.25, -0.125, -0.5}};
  std::set<std::int64_t> frame_times;
  const auto isImageHere = [&] {
    send({0.25, -0.125, -0.5, 0.0, 0.6, 0.0, 0.8});
    const auto frame = stream->next(kSoon);
    EXPECT_TRUE(frame.ok() && frame->moment.world_from_camera == expected);
    if (frame.ok()) frame_times.insert(rosTimeOf(*frame));
    return images->wait_for_unread_message({1, 0});
  };
  ASSERT_TRUE(eventually(isImageHere));  // likewise
  const auto image = nextOf(images);
  ASSERT_TRUE(image);
  CdrReader cdr{*image};
  EXPECT_THAT(frame_times, testing::Contains(readHeader(cdr)));
  ReadTransform seen{};
  do {
    auto message = nextOf(transforms);
    ASSERT_TRUE(message);
    seen = readTransform(*std::move(message));
  } while (seen.numbers != numbersOf(expected));
  EXPECT_EQ(seen.child, "cam_optical_frame");
  // The frame's time; or, where the frame is slow, when the pose was set, which is told before it.
  EXPECT_THAT(seen.stamp_ns, AnyOf(*frame_times.begin(), AllOf(Ge(sent_ns), Le(wallNow()))));
}

/// Best effort, as Fast DDS has it, or reliable, as a subscription of ROS 2 has it.
TEST_F(Ros2Facade, WithoutAnyKeysItIsReadByReadersThatAskForNothingSpecial) {
  startRos2(kPattern);
  EXPECT_TRUE(nextOf(program_->read("/cam/depth/image_raw", kImage, Asks::Nothing)));
  EXPECT_TRUE(nextOf(program_->read("/cam/points", kPoints, Asks::Reliable)));
}

/// rmw_dds_common/ParticipantEntitiesInfo, as published.
struct NodeSaid {
  std::string space, name;
  std::vector<std::vector<std::uint8_t>> readers, writers;
};
NodeSaid readNode(Cdr message, std::size_t gid_size) {
  CdrReader cdr{std::move(message)};
  const auto gid = [&] {
    auto bytes = cdr.numbers<std::uint8_t>(gid_size);
    for (std::size_t i = 16; i < gid_size; ++i) EXPECT_EQ(bytes[i], 0);
    bytes.resize(16);
    return bytes;
  };
  const auto gids = [&] {
    std::vector<std::vector<std::uint8_t>> all(cdr.number<std::uint32_t>());
    for (auto& one : all) one = gid();
    return all;
  };
  gid();
  EXPECT_EQ(cdr.number<std::uint32_t>(), 1U) << "one node";
  NodeSaid said;
  said.space = cdr.text();
  said.name = cdr.text();
  said.readers = gids();
  said.writers = gids();
  EXPECT_LT(cdr.left(), 4U);
  return said;
}

constexpr const char* kNodeInfo = "rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_";

TEST_F(Ros2Facade, IsANodeWithItsWritersAndReaders) {
  startRos2(kPattern, "name = 'front/tof'\npose_topic = '/pose'");
  auto message = nextOf(program_->read("ros_discovery_info", kNodeInfo, Asks::Latched));
  ASSERT_TRUE(message);
  const NodeSaid said = readNode(*std::move(message), 16);
  EXPECT_EQ(said.space, "/front");
  EXPECT_EQ(said.name, "tof");
  EXPECT_EQ(said.readers.size(), 1u) << "of the pose";
  EXPECT_EQ(said.writers.size(), 7u) << "five of frames, transforms, diagnostics";
  std::vector<std::uint8_t> writer;
  ASSERT_TRUE(nextOf(program_->read("/front/tof/points", kPoints), &writer));
  EXPECT_THAT(said.writers, testing::Contains(writer)) << "as the network sees it";
}

TEST_F(Ros2Facade, ForHumbleIdentifiersHave24Bytes) {
  startRos2(kPattern, "node_info = 'humble'");
  auto message = nextOf(program_->read("ros_discovery_info", kNodeInfo, Asks::Latched));
  ASSERT_TRUE(message);
  const NodeSaid said = readNode(*std::move(message), 24);
  EXPECT_EQ(said.space, "/");
  EXPECT_EQ(said.name, "cam");
  EXPECT_EQ(said.writers.size(), 7u);
}

TEST_F(Ros2Facade, DiagnosticsTellHowTheSourceIs) {
  startRos2(kPattern);
  auto message =
      nextOf(program_->read("/diagnostics", "diagnostic_msgs::msg::dds_::DiagnosticArray_", Asks::Reliable));
  ASSERT_TRUE(message);
  CdrReader cdr{*std::move(message)};
  readHeader(cdr, "");
  ASSERT_EQ(cdr.number<std::uint32_t>(), 1U);
  EXPECT_LE(cdr.number<std::uint8_t>(), 1) << "OK, or frames were lost on a busy machine";
  EXPECT_EQ(cdr.text(), "cam: cam");
  EXPECT_FALSE(cdr.text().empty());
  EXPECT_EQ(cdr.text(), "cam") << "the hardware";
  ASSERT_EQ(cdr.number<std::uint32_t>(), 3U);
  EXPECT_EQ(cdr.text(), "frames");
}

/// rviz2 and subscriptions ask for reliable ones, nav2's layers for sensor data: all get them.
TEST_F(Ros2Facade, PointsAndImagesAreReadByReliableAndBestEffortReaders) {
  startRos2(kPattern);
  for (const Asks asks : {Asks::Reliable, Asks::SensorData}) {
    EXPECT_TRUE(nextOf(program_->read("/cam/points", kPoints, asks)));
    EXPECT_TRUE(nextOf(program_->read("/cam/depth/image_raw", kImage, asks)));
    EXPECT_TRUE(nextOf(program_->read("/cam/amplitude/camera_info", kInfo, asks)));
  }
}

TEST_F(Ros2Facade, HealthCountsTheReadersOfItsFrames) {
  startRos2(kPattern);
  EXPECT_EQ(facadeClients(), 0u);
  ASSERT_TRUE(nextOf(program_->read("/cam/depth/image_raw", kImage)));
  EXPECT_TRUE(eventually([&] { return facadeClients() == 1u; }));
}

TEST_F(Ros2Facade, AReaderThatComesLateGetsTheStaticTransform) {
  startRos2(kSmallSim + "position_m = [0.5, 0.25, -1.0]\n");
  auto native_client = client();
  auto stream = native_client.subscribe("cam");
  const auto frame = stream->next(kSoon);
  ASSERT_TRUE(frame.ok());
  auto message = nextOf(program_->read("/tf_static", kTransforms, Asks::Latched));
  ASSERT_TRUE(message);
  const auto first = readTransform(*std::move(message));
  EXPECT_EQ(first.numbers, numbersOf(*frame->moment.world_from_camera));
  RosProgram late{domain_};
  auto again = nextOf(late.read("/tf_static", kTransforms, Asks::Latched));
  ASSERT_TRUE(again);
  EXPECT_EQ(readTransform(*std::move(again)).numbers, first.numbers);
}

TEST_F(Ros2Facade, APoseThatIsSetIsToldWhereNobodyReadsImages) {
  startRos2(kSmallSim + "position_m = [0.5, 0.25, -1.0]\n");
  auto* transforms = program_->read("/tf_static", kTransforms, Asks::Latched);
  ASSERT_TRUE(nextOf(transforms)) << "the first frame's";
  const Transform<World, Camera> expected{{0.8, 0.0, 0.0, 0.6}, {0.5, 0.25, -0.75}};
  ASSERT_TRUE(client().setPose("cam", expected).ok());
  ReadTransform seen{};
  while (seen.numbers != numbersOf(expected)) {
    auto message = nextOf(transforms);
    ASSERT_TRUE(message);
    seen = readTransform(*std::move(message));
  }
  EXPECT_EQ(seen.child, "cam_optical_frame");
}

TEST_F(Ros2Facade, ThePoseIsToldAlsoWhereTheFirstFrameIsLost) {
  startRos2(kSmallSim + "position_m = [0.5, 0.25, -1.0]\n", "[facade.line]\nloss = 1.0\n");
  auto message = nextOf(program_->read("/tf_static", kTransforms, Asks::Latched));
  ASSERT_TRUE(message);
  EXPECT_EQ(readTransform(*std::move(message)).numbers,
            numbersOf(*client().describe("cam")->world_from_camera));
}

TEST_F(Ros2Facade, ACameraThatWaitsForItsFirstTriggerIsWhereItWasPut) {
  startRos2(kSmallSim + "position_m = [0.5, 0.25, -1.0]\npace = 'trigger'\n");
  auto message = nextOf(program_->read("/tf_static", kTransforms, Asks::Latched));
  ASSERT_TRUE(message);
  EXPECT_EQ(readTransform(*std::move(message)).numbers,
            numbersOf(*client().describe("cam")->world_from_camera));
}

TEST_F(Ros2Facade, AFrameThatIsDoubledOnPurposeComesTwice) {
  startRos2(kSmallSim, "reliability = 'reliable'\nkeep_last = 50\n[facade.line]\nduplicate = 1.0\n");
  auto* images = program_->read("/cam/amplitude/image_raw", kImage, Asks::Reliable);
  std::map<std::int64_t, int> times;  // of each stamp
  while (times.size() < 5) {
    auto message = nextOf(images);
    ASSERT_TRUE(message);
    CdrReader cdr{*std::move(message)};
    ++times[readHeader(cdr)];
  }
  // The first may have begun before the reader was known, the last is not over.
  for (auto one = std::next(times.begin()); one != std::prev(times.end()); ++one) EXPECT_EQ(one->second, 2);
}

TEST_F(Ros2Facade, ATransformMovesTheCameraAndTransformsComeWithEachFrame) {
  startRos2(kSmallSim,
            "pose_topic = '/tf'\npose_type = 'TFMessage'\nreliability = 'reliable'\nclock = 'device'\n"
            "transform = 'moving'\nframe_id = 'tof'\n");
  auto* poses = program_->write("/tf", kTransforms);
  auto* transforms = program_->read("/tf", kTransforms, Asks::Reliable);
  ASSERT_TRUE(eventually([&] { return isRead(poses, 2) && isWritten(transforms, 2); }));
  const Transform<World, Camera> expected{{0.8, 0.0, 0.0, 0.6}, {0.5, 0.25, -0.75}};
  CdrWriter cdr;
  cdr.number<std::uint32_t>(2);
  for (const std::string child : {"wheel", "tof"}) {
    cdr.number<std::int32_t>(0).number<std::uint32_t>(0).text("world").text(child);
    for (const double one : numbersOf(expected)) cdr.number(child == "tof" ? one : std::nan(""));
  }
  auto native_client = client();
  auto stream = native_client.subscribe("cam", {.policy = Policy::Lossless});
  ASSERT_TRUE(stream.ok());
  ReadTransform seen{};
  for (int i = 0; i < 200 && seen.numbers != numbersOf(expected); ++i) {
    // Again and again: a reader that this writer knows may not know the writer yet.
    if (i % 20 == 0) {
      ASSERT_TRUE(poses->write(&cdr.bytes()));
    }
    auto message = nextOf(transforms);
    ASSERT_TRUE(message);
    if (*message != cdr.bytes()) seen = readTransform(*std::move(message));  // it hears itself, too
  }
  ASSERT_EQ(seen.numbers, numbersOf(expected));
  EXPECT_EQ(seen.child, "tof");
  std::int64_t native_ns = -1;
  while (native_ns < seen.stamp_ns) {
    const auto frame = stream->next(kSoon);
    ASSERT_TRUE(frame.ok()) << frame.error().message;
    native_ns = frame->moment.exposures.at(0).start.ns;
    if (native_ns == seen.stamp_ns) {
      EXPECT_EQ(*frame->moment.world_from_camera, expected);
    }
  }
  EXPECT_EQ(native_ns, seen.stamp_ns);
}

TEST_F(Ros2Facade, BearsWhatIsNoMessage) {
  startRos2("pace = 'trigger'\n" + kSmallSim,
            "pose_topic = '/amr/pose'\ntrigger_on_pose = true\nreliability = 'reliable'\n");
  auto* poses = program_->write("/amr/pose", kPose);
  ASSERT_TRUE(eventually([&] { return isRead(poses); }));
  constexpr unsigned kSeed = 20'26;
  SCOPED_TRACE(fmt::format("seed {}", kSeed));
  std::mt19937 random{kSeed};
  for (int i = 0; i < 200; ++i) {
    Cdr bytes = poseMessage({0, 0, 0, 0, 0, 0, 1}).bytes();
    const auto below = [&](std::size_t limit) { return random() % limit; };
    for (std::size_t changes = 1 + below(4); changes > 0; --changes)
      bytes[below(bytes.size())] = static_cast<std::uint8_t>(random());
    if (i % 3 == 0) bytes.resize(below(bytes.size() + 1));
    if (i % 5 == 0) bytes.resize(bytes.size() + below(3000));
    poses->write(&bytes);
    poses->wait_for_acknowledgments(eprosima::fastrtps::Duration_t{1, 0});  // it keeps one
  }
  auto native_client = client();
  auto stream = native_client.subscribe("cam", {.policy = Policy::Queue, .queue = 64});
  ASSERT_TRUE(stream.ok());
  ASSERT_TRUE(poses->write(&poseMessage({0.125, 0, -0.5, 0, 0, 0, 1}).bytes()));
  const Transform<World, Camera> expected{{1.0, 0.0, 0.0, 0.0}, {0.125, 0.0, -0.5}};
  while (true) {
    const auto frame = stream->next(kSoon);
    ASSERT_TRUE(frame.ok()) << frame.error().message;
    if (frame->moment.world_from_camera == expected) break;
  }
}

TEST_F(Ros2Facade, HearsTheLoopbackInterfaceAlone) {
  start(fmt::format("[[source]]\nname = 'cam'\n{}\n{}", kPattern, facadeTable("")));
  ASSERT_TRUE(log_->waitFor("ROS 2 topics", 1));
  int seen = 0;
  for (int descriptor = 3; descriptor < 1024; ++descriptor) {
    sockaddr_in address{};
    socklen_t size = sizeof address;
    if (::getsockname(descriptor, reinterpret_cast<sockaddr*>(&address), &size) != 0 ||
        address.sin_family != AF_INET || address.sin_addr.s_addr == htonl(INADDR_LOOPBACK) ||
        address.sin_port == 0)
      continue;
    std::array<char, 16> device{};
    size = device.size();
    ASSERT_EQ(::getsockopt(descriptor, SOL_SOCKET, SO_BINDTODEVICE, device.data(), &size), 0);
    EXPECT_STREQ(device.data(), "lo") << "port " << ntohs(address.sin_port);
    ++seen;
  }
  EXPECT_EQ(seen, 2);  // for discovery, and for data
}

TEST_F(Ros2Facade, ThatCannotStartSaysWhyAndTheDaemonServesOn) {
  start(fmt::format("[[source]]\nname = 'cam'\n{}\n{}", kPattern, facadeTable("address = '127.0.0.77'")));
  ASSERT_TRUE(log_->waitFor("127.0.0.77: does not match an available interface", 1));
  auto native = client();
  auto stream = native.subscribe("cam");
  ASSERT_TRUE(stream.ok());
  EXPECT_TRUE(stream->next(kSoon).ok());
}

TEST_F(Ros2Facade, AReliableReaderThatStopsHoldsUpNobody) {
  // 4.9 MB per message, so that no buffer on the way takes them all.
  startRos2("driver = 'pattern'\nwidth = 640\nheight = 480\nframe_rate_hz = 10\n",
            "reliability = 'reliable'\n");
  const std::string sign = folder_ / "sign";
  const Ran begun = run(
      fmt::format("sh -c '{} {} {} > /dev/null 2>&1 & echo $!'", TOFTWIN_ROS2_POINTS_READER, domain_, sign));
  const int program = std::stoi(begun.output);
  ASSERT_TRUE(eventually([&] { return std::filesystem::exists(sign); }));
  auto* points = program_->read("/cam/points", kPoints, Asks::Reliable);
  EXPECT_TRUE(nextOf(points));
  ::kill(program, SIGSTOP);
  std::vector<std::int64_t> stamps_ns;
  for (int i = 0; i < 20; ++i) {
    auto message = nextOf(points);
    ASSERT_TRUE(message);
    CdrReader cdr{*std::move(message)};
    stamps_ns.push_back(readHeader(cdr));
  }
  ::kill(program, SIGKILL);
  // 19 intervals of 0.1 s if no frame is missing; a busy machine may lose two of three. Were it waited for,
  // it would be 20 s (seen with writers that keep all).
  EXPECT_LT(stamps_ns.back() - stamps_ns.front(), 3 * 19 * 100'000'000LL);
}

TEST_F(Ros2Facade, SeveralCamerasShareADomain) {
  start(fmt::format("[[source]]\nname = 'cam'\n{}\n{}{}", kPattern, facadeTable("name = 'left'"),
                    facadeTable("name = 'right'")));
  RosProgram program{domain_};
  EXPECT_TRUE(nextOf(program.read("/left/depth/image_raw", kImage)));
  EXPECT_TRUE(nextOf(program.read("/right/depth/image_raw", kImage)));
}

TEST_F(Ros2Facade, RefusesNamesThatRos2DoesNotKnow) {
  configure(fmt::format("[[source]]\nname = 'cam'\n{}\n{}", kPattern,
                        facadeTable("name = '2nd'\npose_topic = 'amr'\npeers = ['<Peer/>']")));
  const auto started = Daemon::start(options());
  ASSERT_FALSE(started.ok());
  for (const char* part : {"\"2nd\" is no name of ROS 2", "\"amr\" is no topic", "has \"<Peer/>\", but must"})
    EXPECT_NE(started.error().message.find(part), std::string::npos) << started.error().message;
}

TEST_F(Ros2Facade, SendsNothingThatWiresharkCallsMalformed) {
  if (!hasProgram("tshark"))
    GTEST_SKIP() << "tshark is not installed (tools/install-dependencies --for test)";
  const int first_port = 7400 + 250 * domain_;
  const std::string file = (folder_ / "packets.pcapng").string(), said = file + ".log";
  const Ran begun =
      run(fmt::format("sh -c 'dumpcap -q -i lo -B 64 -f \"udp portrange {}-{}\" -w {} > {} 2>&1 & echo $!'",
                      first_port, first_port + 249, file, said));
  const int capture = std::stoi(begun.output);
  // It says so when it captures; where it may not, it ends.
  const Ran waited = run(fmt::format(
      "sh -c 'for i in $(seq 100); do test -s {} && exit 0; kill -0 {} || exit 1; sleep 0.1; done'", said,
      capture));
  if (waited.status != 0 || run("grep -c ' on ' " + said).status != 0)
    GTEST_SKIP() << "packets cannot be captured here: " << run("cat " + said).output;
  startRos2(kSmallSim, "pose_topic = '/amr/pose'\nreliability = 'reliable'\n");
  auto* poses = program_->write("/amr/pose", kPose);
  EXPECT_TRUE(eventually([&] { return isRead(poses); }));
  poses->write(&poseMessage({0, 0, -1, 0, 0, 0, 1}).bytes());
  auto* points = program_->read("/cam/points", kPoints, Asks::Reliable);
  EXPECT_TRUE(nextOf(program_->read("/cam/depth/camera_info", kInfo)));
  EXPECT_TRUE(nextOf(program_->read("/tf_static", kTransforms, Asks::Latched)));
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(nextOf(points));
  program_.reset();
  stop();
  ::kill(capture, SIGINT);
  ASSERT_TRUE(eventually([&] { return run(fmt::format("sh -c '! kill -0 {}'", capture)).status == 0; }));
  // Others have registered some of the ports that a domain may have.
  const auto lines = [&](const std::string& filter) {
    return std::stoi(
        run(fmt::format("sh -c \"tshark -o udp.try_heuristic_first:TRUE -r {} -Y '{}' 2> /dev/null | wc -l\"",
                        file, filter))
            .output);
  };
  EXPECT_GT(lines("rtps"), 50);
  EXPECT_EQ(lines("udp.length >= 28 and not rtps"), 0);  // shorter ones wake Fast DDS' own threads
  EXPECT_EQ(lines("_ws.malformed"), 0);
  EXPECT_EQ(lines("_ws.expert.severity >= 6291456"), 0);
}

}  // namespace
}  // namespace toftwin::daemon
