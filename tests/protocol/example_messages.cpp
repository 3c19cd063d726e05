// SPDX-License-Identifier: Apache-2.0
#include "example_messages.h"

#include <sys/mman.h>

#include <limits>
#include <new>

namespace toftwin::wire {
namespace {

CameraInfo kinect() {
  return {512,
          424,
          365.456,
          365.25,
          254.88,
          205.40,
          {0.0905, -0.268, 0.001, -0.002, 0.0951},
          "0123456789abcdef0123456789abcdef"};
}

SourceSummary summary() {
  return {"kinect", "Microsoft Kinect v2 (simulated)", "sim-1", FrameKind::Simulated, true};
}

Transform<World, Camera> pose() { return {{0.5, 0.5, -0.5, 0.5}, {1.25, -2.0, 0.75}}; }

Moment fullMoment() {
  Moment moment;
  moment.exposures = {{{1'000'000}, 500_us, 80_MHz}, {{1'700'000}, 500_us, 16_MHz}};
  moment.received = {1'760'000'000'123'456'789};
  moment.clock = {1'760'000'000'000'000'000, 1500};
  moment.since_power_on = 1234.5_s;
  moment.temperatures = {{"illumination", 41.25_degC}, {"sensor", 38.5_degC}};
  moment.ambient = 12.5_klx;
  moment.world_from_camera = pose();
  return moment;
}

Provenance fullProvenance() {
  return {FrameKind::Simulated,
          "0123456789abcdef0123456789abcdef",
          "fedcba9876543210fedcba9876543210",
          "00112233445566778899aabbccddeeff",
          18'446'744'073'709'551'615ull,
          {"lens_scatter", "shot_noise"}};
}

/// Planes of every element type, one with several channels, none a multiple of 64 bytes long.
Frame richFrame() {
  Frame frame = exampleFrame(3, 2);
  frame.moment = fullMoment();
  frame.provenance = fullProvenance();
  frame.dropped_before = 3;
  frame.dropped_by_device = 1;
  frame.dropped_because = "packets of it did not come (1)";
  frame.planes.push_back(toPlane(PlaneKind::Ambient, Image<std::uint16_t>{3, 2, 513}));
  std::vector<float> normals(18);
  for (std::size_t i = 0; i < normals.size(); ++i) normals[i] = 0.5f * static_cast<float>(i);
  frame.planes.push_back(
      {PlaneKind::TruthNormal, ElementType::F32, 3, 2, 3, Buffer::adopt(std::move(normals))});
  return frame;
}

Frame bareFrame() {
  Frame frame;
  frame.source = "o3d";
  frame.moment.exposures = {{{-5}, 1_ms, 20_MHz}};
  return frame;
}

SourceDescription fullDescription() {
  return {.id = 4,
          .summary = summary(),
          .driver = "sim",
          .camera = kinect(),
          .planes = {PlaneKind::Range, PlaneKind::Flags},
          .frame_interval = Duration{1.0 / 32.0, second},
          .can_set_pose = true,
          .can_trigger = true,
          .can_lockstep = true,
          .parameters = {{"exposure_us", 500.0, {1.0, 20'000.0}},
                         {"ambient_klx", 0.0, {0.0, 200.0}},
                         {"since_power_on_s", {}, {}}},
          .world_from_camera =
              Transform<World, Camera>{{0.5, -0.5, 0.5, 0.5}, {1.0, -2.0, 0.25}}};
}

SourceDescription describedTexts() {
  SourceDescription described;
  described.id = 4;
  described.summary.name = "gige";
  described.driver = "aravis";
  described.parameters = {{.name = "TriggerActivation",
                           .value = 1.0,
                           .bounds = {0.0, 1.0},
                           .text = "FallingEdge",
                           .choices = {"RisingEdge", "FallingEdge"}},
                          {.name = "DeviceUserID", .text = ""}};
  return described;
}

Subscribe fullSubscribe() {
  return {.id = 5,
          .source = "kinect",
          .planes = {PlaneKind::Range, PlaneKind::Amplitude, PlaneKind::Flags},
          .region = {8, 16, 256, 128},
          .decimation = 2,
          .max_rate_hz = 7.5,
          .policy = Policy::Queue,
          .queue = 12,
          .window = 2};
}

Health fullHealth() {
  return {.id = 12,
          .uptime = 3600.25_s,
          .sessions = 3,
          .sources = {{"kinect", true, 108'000, 2, 8, 1, "", "user 1000 (client 5)", "user 1000 (client 4)"},
                      {"o3d", false, 0, 0, 0, 7, "no device at 192.168.0.69"}},
          .facades = {{"o3d303", "kinect", "XML-RPC on 127.0.0.1 port 80", FacadeState::Running, 2, ""},
                      {"modbus", "kinect", "", FacadeState::NotThere, {}, "port 502 is in use"}}};
}

}  // namespace

Frame exampleFrame(int width, int height) {
  Image<float> range_m{width, height}, amplitude{width, height};
  Image<std::uint8_t> flags{width, height};
  for (std::size_t i = 0; i < range_m.size(); ++i) {
    range_m[i] = 1.0f + 0.001f * static_cast<float>(i % 4096);
    amplitude[i] = static_cast<float>(i % 1000);
  }
  range_m[0] = std::numeric_limits<float>::quiet_NaN();
  flags[0] = static_cast<std::uint8_t>(PixelFlag::Invalid);
  Frame frame;
  frame.source = "kinect";
  frame.sequence = 41;
  frame.moment.exposures = {{{1'000'000}, 500_us, 80_MHz}};
  frame.camera = kinect();
  frame.camera.width = width;
  frame.camera.height = height;
  frame.planes = {toPlane(PlaneKind::Range, std::move(range_m)),
                  toPlane(PlaneKind::Amplitude, std::move(amplitude)),
                  toPlane(PlaneKind::Flags, std::move(flags))};
  return frame;
}

std::vector<ExampleMessage> exampleMessages() {
  return {
      {"hello", Hello{1, "toftwind 0.1.0", {"memfd"}}},
      {"hello-bare", Hello{}},
      {"hello-token", Hello{.id = 1, .software = "toftwin client", .features = {}, .token = "s3cret"}},
      {"hello-idle", Hello{.id = 1, .software = "toftwind", .features = {}, .idle = 60_s}},
      {"list-sources", ListSources{2}},
      {"source-list", SourceList{2,
                                 {summary(),
                                  {"o3d", "O3D303", "", FrameKind::Replayed, false},
                                  {"xtion", "", "", FrameKind::Real, false, "no camera at usb:1-4"}}}},
      {"source-list-empty", SourceList{2, {}}},
      {"describe-source", DescribeSource{4, "kinect"}},
      {"source-description", fullDescription()},
      {"source-description-bare", SourceDescription{}},
      {"source-description-texts", describedTexts()},
      {"subscribe", fullSubscribe()},
      {"subscribe-bare", Subscribe{.id = 6, .source = "kinect", .planes = {}, .region = {}}},
      {"subscribed", Subscribed{5, 77}},
      {"unsubscribe", Unsubscribe{7, 77}},
      {"frame", FrameMessage{77, richFrame()}},
      {"frame-bare", FrameMessage{78, bareFrame()}},
      {"acknowledge", Acknowledge{77, 41}},
      {"subscription-ended", SubscriptionEnded{77, {Error::Code::EndOfStream, "the recording ended"}}},
      {"set-pose", SetPose{8, "kinect", pose()}},
      {"set-parameter", SetParameter{9, "kinect", "ambient_klx", 0.1}},
      {"set-parameter-text", SetParameter{9, "gige", "TriggerActivation", 0.0, "FallingEdge"}},
      {"set-parameter-empty-text", SetParameter{9, "gige", "DeviceUserID", 0.0, ""}},
      {"trigger", Trigger{10, "o3d"}},
      {"record", Record{11, "kinect", "monday.mcap"}},
      {"done", Done{11, "/var/lib/toftwin/monday.mcap"}},
      {"ask-health", AskHealth{12}},
      {"health", fullHealth()},
      {"keep-alive", KeepAlive{}},
      {"failure", Failure{13, {Error::Code::NotFound, "no source is named \"kinekt\""}}},
  };
}

Buffer zeros(std::size_t bytes) {
  void* const pages = ::mmap(nullptr, bytes, PROT_READ, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (pages == MAP_FAILED) throw std::bad_alloc{};
  const std::shared_ptr<const void> owner{pages, [bytes](void* all) { ::munmap(all, bytes); }};
  return {owner, {static_cast<const std::byte*>(pages), bytes}};
}

}  // namespace toftwin::wire
