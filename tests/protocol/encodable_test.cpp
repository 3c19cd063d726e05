// SPDX-License-Identifier: Apache-2.0
// What the encoder gives, the decoder takes; what the decoder would refuse, the encoder refuses first.
#include <gmock/gmock.h>

#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include <toftwin/nan.h>

#include "example_messages.h"
#include "message_json.h"
#include "protocol/wire/bounds.h"
#include "protocol/wire/codec.h"

namespace toftwin::wire {
namespace {

/// Of planes; the first number that is none.
constexpr std::size_t kKinds = static_cast<std::size_t>(kLastPlaneKind) + 1;

using testing::HasSubstr;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::uint64_t kSeed = 20'261;

/// A message with one thing wrong, and the field that the encoder must name.
struct Refused {
  Message message;
  std::string field;
};

FrameMessage frameWith(const std::function<void(Frame&)>& change) {
  FrameMessage message{1, exampleFrame(8, 4)};
  change(message.frame);
  return message;
}

std::vector<Refused> refusedFrames() {
  const std::string long_name(kMaxName + 1, 'n');
  const auto with = [](auto change) { return frameWith(change); };
  return {
      {with([](Frame& f) { f.camera.fx = kNaN; }), "camera.fx_px"},
      {with([](Frame& f) { f.camera.distortion[4] = kInfinity; }), "camera.k3"},
      {with([](Frame& f) { f.camera.width = -1; }), "camera.width"},
      {with([](Frame& f) { f.moment.since_power_on = kInfinity * second; }), "since_power_on_s"},
      {with([](Frame& f) { f.moment.ambient = kNaN * kilolux; }), "ambient_klx"},
      {with([](Frame& f) {
         f.moment.temperatures = {{"sensor", kNaN * celsius}};
       }),
       "value_c"},
      {with([](Frame& f) { f.moment.exposures[0].duration = -1_ms; }), "exposure.duration_s"},
      {with([](Frame& f) { f.moment.exposures[0].modulation = kNaN * hertz; }), "modulation_hz"},
      {with([](Frame& f) { f.moment.clock.uncertainty_ns = -2; }), "clock_uncertainty_ns"},
      {with([](Frame& f) {
         f.moment.world_from_camera = Transform<World, Camera>{{1, 0, 0, 0}, {0, kNaN, 0}};
       }),
       "pose.y_m"},
      {with([](Frame& f) { f.moment.exposures.resize(kMaxExposures + 1); }), "moment.exposures"},
      {with([](Frame& f) { f.moment.temperatures.resize(kMaxTemperatures + 1); }), "temperatures"},
      {with([](Frame& f) { f.provenance.kind = static_cast<FrameKind>(4); }), "provenance.kind"},
      {with([](Frame& f) { f.provenance.effects.resize(kMaxNames + 1); }), "provenance.effects"},
      {with([&](Frame& f) { f.provenance.scene_id = long_name; }), "provenance.scene_id"},
      {with([&](Frame& f) { f.source = long_name; }), "frame.source"},
      {with([](Frame& f) { f.planes[0].kind = static_cast<PlaneKind>(kKinds); }), "plane.kind"},
      {with([](Frame& f) { f.planes[0].type = static_cast<ElementType>(3); }), "plane.type"},
      {with([](Frame& f) { f.planes[1].width = 0; }), "plane.width"},
      {with([](Frame& f) { f.planes[1].height = -4; }), "plane.height"},
      {with([](Frame& f) { f.planes[1].channels = 1025; }), "plane.channels"},
      {with([](Frame& f) { f.planes[2].width = 7; }), "plane.bytes"},
      {with([](Frame& f) { f.planes.resize(kMaxPlanes + 1, f.planes[0]); }), "frame.planes"},
  };
}

std::vector<Refused> refusedRequests() {
  const std::string long_name(kMaxName + 1, 'n');
  const std::vector<std::string> many(kMaxNames + 1, "n");
  Subscribe subscribe{.id = 1, .source = "k"};
  Subscribe bad_rate = subscribe, bad_policy = subscribe, bad_plane = subscribe, many_planes = subscribe;
  bad_rate.max_rate_hz = kNaN;
  bad_policy.policy = static_cast<Policy>(4);
  bad_plane.planes = {static_cast<PlaneKind>(kKinds)};
  many_planes.planes.resize(kMaxPlanes + 1);
  SourceDescription bad_interval, bad_value, bad_bound, long_parameter, many_parameters, bad_pose;
  bad_interval.frame_interval = -1_ms;
  bad_value.parameters = {{"gain", kNaN}};
  bad_bound.parameters = {{"gain", 1.0, {kInfinity, kInfinity}}};  // none is minus infinity
  long_parameter.parameters = {{long_name}};
  many_parameters.parameters.resize(kMaxNames + 1);
  SourceDescription long_text, long_choice, many_choices;
  long_text.parameters = {{.name = "user", .text = std::string(kMaxText + 1, 'x')}};
  long_choice.parameters = {{.name = "mode", .text = "a", .choices = {long_name}}};
  many_choices.parameters = {{.name = "mode", .text = "a", .choices = many}};
  bad_pose.world_from_camera = Transform<World, Camera>{{kNaN, 0, 0, 0}, {}};
  return {
      {Hello{1, long_name, {}}, "software"},
      {Hello{1, "s", many}, "features"},
      {Hello{1, "s", {long_name}}, "features"},
      {SourceList{1, std::vector<SourceSummary>(kMaxSources + 1)}, "sources"},
      {SourceList{1, {{.name = "a", .model = long_name, .serial = ""}}}, "source.model"},
      {DescribeSource{1, long_name}, "source"},
      {bad_interval, "frame_interval_s"},
      {bad_value, "parameter.value"},
      {bad_bound, "parameter.lowest"},
      {long_parameter, "parameter.name"},
      {many_parameters, "parameters"},
      {long_text, "parameter.text"},
      {long_choice, "parameter.choices"},
      {many_choices, "parameter.choices"},
      {bad_pose, "pose.rotation_w"},
      {bad_rate, "max_rate_hz"},
      {bad_policy, "policy"},
      {bad_plane, "planes"},
      {many_planes, "planes"},
      {SetPose{1, "k", {{1, 0, 0, kNaN}, {}}}, "pose.rotation_z"},
      {SetParameter{1, "k", "p", kInfinity}, "value"},
      {SetParameter{1, "k", "p", 0.0, std::string(kMaxText + 1, 'x')}, "text"},
      {Record{1, "k", long_name}, "file"},
      {Health{1, -1_s, 0, {}}, "uptime_s"},
      {Health{1, 1_s, 0, std::vector<SourceHealth>(kMaxSources + 1)}, "sources"},
      {Health{1, 1_s, 0, {}, std::vector<FacadeHealth>(kMaxSources + 1)}, "facades"},
  };
}

void expectRefused(const std::vector<Refused>& all) {
  for (const auto& [message, field] : all) {
    const auto encoded = encode(message);
    ASSERT_FALSE(encoded) << field;
    EXPECT_EQ(encoded.error().code, Error::Code::InvalidArgument) << field;
    EXPECT_THAT(encoded.error().message, HasSubstr("cannot be sent: "));
    EXPECT_THAT(encoded.error().message, HasSubstr(field));
  }
}

TEST(Encodable, AFrameWithAValueThatNoDecoderTakesIsRefusedByTheFieldsName) {
  expectRefused(refusedFrames());
}

TEST(Encodable, ARequestOrAnswerWithAValueThatNoDecoderTakesIsRefusedByTheFieldsName) {
  expectRefused(refusedRequests());
}

TEST(Encodable, AHeaderBeyondTheLimitIsRefused) {
  const SourceHealth wordy{.name = "n", .last_error = std::string(kMaxText, 'e')};
  const auto encoded = encode(Health{1, 1_s, 0, std::vector<SourceHealth>(kMaxSources, wordy)});
  ASSERT_FALSE(encoded);
  EXPECT_EQ(encoded.error().code, Error::Code::TooLarge);
  EXPECT_THAT(encoded.error().message, HasSubstr("the limit is 1048576"));
}

TEST(Encodable, ABodyBeyondTheLimitIsRefusedAndOneAtTheLimitDecodes) {
  // 8192 x 8192 floats are the limit, 256 MiB, to the byte.
  FrameMessage message = frameWith([](Frame& f) {
    f.camera.width = f.camera.height = 8192;
    f.planes = {{PlaneKind::Range, ElementType::F32, 8192, 8192, 1, zeros(Limits{}.body_bytes)}};
  });
  const auto largest = encode(message);
  ASSERT_TRUE(largest) << largest.error().message;
  const auto preamble =
      decodePreamble(std::span{largest->head}.first<kPreambleSize>(), Limits{});
  ASSERT_TRUE(preamble) << preamble.error().message;
  EXPECT_TRUE(decode(*preamble, std::span{largest->head}.subspan(kPreambleSize),
                     message.frame.planes[0].data));
  message.frame.planes.push_back({PlaneKind::Flags, ElementType::U8, 8192, 8192, 1, zeros(8192 * 8192)});
  const auto larger = encode(message);
  ASSERT_FALSE(larger);
  EXPECT_EQ(larger.error().code, Error::Code::TooLarge);
  EXPECT_THAT(larger.error().message, HasSubstr("its body has 335544320 bytes, the limit is 268435456"));
}

TEST(Encodable, ABodyThatIsNotTheFramesIsRefused) {
  const Frame frame = exampleFrame(8, 4);
  const auto encoded = encode(FrameMessage{1, frame}, encodeBody({frame.planes[0]}));
  ASSERT_FALSE(encoded);
  EXPECT_THAT(encoded.error().message, HasSubstr("plane.offset"));
}

/// Messages whose every field is now and then one that breaks a rule.
class Random {
 public:
  explicit Random(std::uint64_t seed) : bits_(seed) {}

  Message message() {
    switch (below(7)) {
      case 0:
        return FrameMessage{bits_(), frame()};
      case 1:
        return Subscribe{.id = bits_(),
                         .source = name(),
                         .planes = kinds(),
                         .region = {1, 2, 3, 4},
                         .decimation = 1,
                         .max_rate_hz = number(),
                         .policy = static_cast<Policy>(rarely(4, 3))};
      case 2:
        return SetPose{bits_(), name(), pose()};
      case 3:
        return SetParameter{bits_(), name(), name(), number(), name()};
      case 4:
        return Health{bits_(),
                      number() * second,
                      1,
                      {{.name = name(), .last_error = name()}},
                      {{.kind = name(), .source = name(), .place = name(), .clients = 1, .problem = name()}}};
      case 5:
        return description();
      default:
        return Hello{bits_(), name(), names()};
    }
  }
  std::size_t below(std::size_t limit) {
    return std::uniform_int_distribution<std::size_t>{0, limit - 1}(bits_);
  }

 private:
  bool isRare() { return below(40) == 0; }
  template <class T>
  T rarely(T odd, T usual) {
    return isRare() ? odd : usual;
  }
  double number() {
    const std::array<double, 6> odd{kNaN, kInfinity, -kInfinity, -1.0, 1e308, 5e-324};
    return rarely(odd[below(odd.size())], static_cast<double>(below(1000)) / 8.0);
  }
  std::string name() {
    return std::string(rarely(kMaxName + below(3), below(20)), static_cast<char>('a' + below(26)));
  }
  std::vector<std::string> names() {
    std::vector<std::string> all(rarely(kMaxNames + below(2), below(4)));
    for (auto& one : all) one = all.size() > 100 ? "n" : name();
    return all;
  }
  std::vector<PlaneKind> kinds() {
    std::vector<PlaneKind> all(rarely(kMaxPlanes + below(2), below(4)));
    for (auto& one : all) one = static_cast<PlaneKind>(rarely<std::size_t>(kKinds, below(kKinds)));
    return all;
  }
  Transform<World, Camera> pose() {
    return {{number(), number(), number(), number()}, {number(), number(), number()}};
  }
  CameraInfo camera() {
    return {rarely(-1, 8), rarely(65536, 4), number(), number(), number(), number(),
            {number(), 0, 0, 0, number()}, name()};
  }
  Message description() {
    SourceDescription d;
    d.summary = {name(), name(), name(), static_cast<FrameKind>(rarely(4, 2)), true};
    d.driver = name();
    d.camera = camera();
    d.planes = kinds();
    if (below(2) == 0) d.frame_interval = number() * second;
    for (const auto& one : names())
      d.parameters.push_back({one, number(), {-kInfinity, number()}, name(), names()});
    if (below(2) == 0) d.world_from_camera = pose();
    return d;
  }
  Frame frame() {
    Frame f = exampleFrame(8, 4);
    f.source = name();
    f.camera = camera();
    f.moment.exposures.resize(rarely<std::size_t>(kMaxExposures + below(2), 2));
    f.moment.exposures[0] = {{static_cast<std::int64_t>(bits_())}, number() * second, number() * hertz};
    f.moment.clock = {static_cast<std::int64_t>(bits_()), rarely<std::int64_t>(-2, 5)};
    if (below(2) == 0) f.moment.since_power_on = number() * second;
    if (below(2) == 0) f.moment.ambient = number() * kilolux;
    if (below(2) == 0) f.moment.world_from_camera = pose();
    f.moment.temperatures = {{name(), number() * celsius}};
    f.provenance = {static_cast<FrameKind>(rarely(4, 1)), name(), name(), name(), bits_(), names()};
    Plane& plane = f.planes[below(3)];
    plane.width = rarely(static_cast<int>(below(70'000)), plane.width);
    plane.channels = rarely(static_cast<int>(below(3)), plane.channels);
    plane.kind = static_cast<PlaneKind>(rarely<std::size_t>(kKinds, below(kKinds)));
    plane.type = static_cast<ElementType>(rarely<std::size_t>(3, static_cast<std::size_t>(plane.type)));
    return f;
  }
  std::mt19937_64 bits_;
};

TEST(Encodable, WhateverIsEncodedDecodesToTheSameAndWhateverIsNotSaysWhy) {
  SCOPED_TRACE("seed " + std::to_string(kSeed));
  Random random{kSeed};
  int encoded_ones = 0, refused_ones = 0;
  for (int i = 0; i < 20'000; ++i) {
    const Message message = random.message();
    const auto encoded = encode(message);
    if (!encoded) {
      ++refused_ones;
      ASSERT_GT(encoded.error().message.size(), std::string{"this message cannot be sent: "}.size());
      continue;
    }
    ++encoded_ones;
    const auto back = decode(Buffer::adopt(toBytes(*encoded)));
    ASSERT_TRUE(back) << i << ": " << back.error().message;
    ASSERT_EQ(toJson(*back), toJson(message)) << i;
  }
  EXPECT_GT(encoded_ones, 1000);  // both happen, or this says nothing
  EXPECT_GT(refused_ones, 1000);
}

}  // namespace
}  // namespace toftwin::wire
