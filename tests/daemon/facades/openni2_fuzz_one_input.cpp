// SPDX-License-Identifier: Apache-2.0
// What a program may hand to the plug-in for OpenNI2: URIs, an environment, properties of any size; and frames of
// any shape from a daemon.
#include <algorithm>
#include <array>
#include <cstdlib>
#include <cstring>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "daemon/facades/openni2/facts.h"
#include "daemon/facades/openni2/stream_settings.h"
#include "daemon/facades/openni2/uri.h"
#include "fuzz_one_input.h"

namespace toftwin::daemon {
namespace {

void demand(bool holds) {
  if (!holds) std::abort();
}

/// Takes numbers and bytes off the front; zeros when there is no more.
class Bytes {
 public:
  explicit Bytes(std::span<const std::byte> bytes) : bytes_(bytes) {}
  [[nodiscard]] bool isEmpty() const { return bytes_.empty(); }
  template <class T>
  T take() {
    T value{};
    const auto some = takeSome(sizeof value);
    if (!some.empty()) std::memcpy(&value, some.data(), some.size());
    return value;
  }
  std::span<const std::byte> takeSome(std::size_t most) {
    const auto some = bytes_.first(std::min(most, bytes_.size()));
    bytes_ = bytes_.subspan(some.size());
    return some;
  }

 private:
  std::span<const std::byte> bytes_;
};

void readUris(std::span<const std::byte> bytes) {
  const std::string_view text{reinterpret_cast<const char*>(bytes.data()), bytes.size()};
  const auto place = openni2::placeOf(text, "unix:/first");
  const auto configuration = openni2::readConfiguration("", text);
  static_cast<void>(configuration);
  if (!place) return;
  demand(openni2::isOurs(text) && !place->source.empty());
  const auto again = openni2::placeOf(openni2::uriOf(*place, "unix:/first"), "unix:/first");
  demand(again && *again == *place);
}

openni2::Facts factsFrom(Bytes& bytes) {
  SourceDetails details;
  details.camera.width = 1 + bytes.take<std::uint8_t>() % 20;
  details.camera.height = 1 + bytes.take<std::uint8_t>() % 20;
  details.camera.fx = details.camera.fy = 10.0;
  details.camera.distortion[0] = bytes.take<float>();
  details.planes = {PlaneKind::Range, PlaneKind::Amplitude, PlaneKind::Color};
  if (const auto rate = bytes.take<float>(); rate > 0.0F) details.frame_interval = double{rate} * second;
  auto facts = openni2::factsOf(details);
  demand(facts.ok());
  return *facts;
}

void setAnything(openni2::StreamSettings& settings, Bytes& bytes) {
  for (int i = 0; i < 8 && !bytes.isEmpty(); ++i) {
    const int property = bytes.take<std::uint8_t>() % 12;
    const auto value = bytes.takeSome(bytes.take<std::uint8_t>() % 24);
    settings.set(property, value.data(), static_cast<int>(value.size()));
    std::array<std::byte, 24> got{};
    int size = bytes.take<std::uint8_t>() % 24;
    const int room = size;
    if (settings.get(property, got.data(), &size) == ONI_STATUS_OK) demand(size <= room);
  }
}

/// A plane of any kind, type and size, whose bytes may be fewer than that.
Plane planeFrom(Bytes& bytes, const openni2::Facts& facts) {
  Plane plane;
  plane.kind = static_cast<PlaneKind>(bytes.take<std::uint8_t>() % 11);
  plane.type = static_cast<ElementType>(bytes.take<std::uint8_t>() % 3);
  const bool fits = bytes.take<std::uint8_t>() % 4 != 0;
  plane.width = fits ? facts.width : bytes.take<std::uint8_t>();
  plane.height = fits ? facts.height : bytes.take<std::uint8_t>();
  plane.channels = bytes.take<std::uint8_t>() % 2 == 0 ? 1 : 3;
  const auto some = bytes.takeSome(plane.byteSize());
  std::vector<std::byte> data(fits ? plane.byteSize() : some.size());
  std::ranges::copy(some, data.begin());
  plane.data = Buffer::adopt(std::move(data));
  return plane;
}

}  // namespace

void fuzzOneInput(std::span<const std::byte> input) {
  readUris(input);
  Bytes bytes{input};
  const openni2::Facts facts = factsFrom(bytes);
  const std::array sensors{ONI_SENSOR_DEPTH, ONI_SENSOR_IR, ONI_SENSOR_COLOR};
  const OniSensorType sensor = sensors[bytes.take<std::uint8_t>() % sensors.size()];
  openni2::StreamSettings settings{sensor, facts, {}};
  setAnything(settings, bytes);
  Frame frame;
  frame.planes = {planeFrom(bytes, facts), planeFrom(bytes, facts)};
  frame.moment.exposures = {{DeviceTime{bytes.take<std::int64_t>()}, 0_s, 0_Hz}};
  demand(openni2::stampOf(frame) <= 9'223'372'036'854'775ULL);
  const openni2::ImageSetup& image = settings.image();
  const auto full = static_cast<std::size_t>(image.window.height * settings.bytesPerRow());
  demand(full <= static_cast<std::size_t>(settings.mostBytes()));
  std::vector<std::byte> out(full);
  const std::size_t drawn = openni2::draw(frame, openni2::depthPerRange(facts.camera), image, out);
  demand(drawn == 0 || drawn == full);
  if (full > 0) demand(openni2::draw(frame, {}, image, std::span{out}.first(full - 1)) == 0);
}

}  // namespace toftwin::daemon
