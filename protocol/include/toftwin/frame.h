// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <toftwin/camera_info.h>
#include <toftwin/clock.h>
#include <toftwin/geometry.h>
#include <toftwin/image.h>
#include <toftwin/units.h>

namespace toftwin {

/// Bytes that many hold and nobody changes. Shared by everyone who forwards a frame: the source,
/// each session's queue and each socket write; the last to let go frees them.
class Buffer {
 public:
  Buffer() = default;
  Buffer(std::shared_ptr<const void> owner, std::span<const std::byte> bytes)
      : owner_(std::move(owner)), bytes_(bytes) {}

  /// Takes the elements over without copying them.
  template <class T, class Allocator>
  static Buffer adopt(std::vector<T, Allocator> elements) {
    auto owner = std::make_shared<const std::vector<T, Allocator>>(std::move(elements));
    return {owner, std::as_bytes(std::span{*owner})};
  }
  [[nodiscard]] std::span<const std::byte> bytes() const { return bytes_; }
  [[nodiscard]] std::size_t size() const { return bytes_.size(); }
  /// A part of these bytes, kept alive by the same owner.
  [[nodiscard]] Buffer part(std::size_t offset, std::size_t length) const {
    return {owner_, bytes_.subspan(offset, length)};
  }

 private:
  std::shared_ptr<const void> owner_;
  std::span<const std::byte> bytes_;
};

/// What a plane shows. On the wire as a byte; values never change.
enum class PlaneKind : std::uint8_t {
  Range = 0,        ///< along the pixel's ray, metres, NaN where invalid
  Depth = 1,        ///< along the optical axis (z), metres, NaN where invalid
  Amplitude = 2,    ///< of the demodulated signal, in the device's own unit (electrons if simulated)
  Ambient = 3,      ///< unmodulated part, same unit as amplitude
  Flags = 4,        ///< PixelFlag bits, U8
  Samples = 5,      ///< raw correlation samples; channel = frequency × steps + step
  Phasors = 6,      ///< demodulated; channel = 2 × frequency (real) and 2 × frequency + 1 (imaginary)
  TruthRange = 7,   ///< of the first surface on the central ray, metres, NaN where none
  TruthNormal = 8,  ///< unit normal in the camera frame, three channels
  Exposure = 9,     ///< which of several exposures a pixel is of, counted from 0, U8
  Color = 10,       ///< what a colour camera sees there: red, green, blue (sRGB), three channels of U8
  LightSigma = 11,  ///< simulated: what the light's own noise leaves in the range, metres, NaN where not
                    ///< known; channel = frequency
};
inline constexpr PlaneKind kLastPlaneKind = PlaneKind::LightSigma;

enum class ElementType : std::uint8_t { U8 = 0, U16 = 1, F32 = 2 };

constexpr std::size_t sizeOf(ElementType type) {
  return type == ElementType::U8 ? 1 : type == ElementType::U16 ? 2 : 4;
}

/// Why a pixel is not to be trusted. `Invalid` alone decides; the others say why or warn.
enum class PixelFlag : std::uint8_t {
  Invalid = 1 << 0,
  Saturated = 1 << 1,
  Asymmetric = 1 << 2,  ///< samples contradict each other: motion or interference
  LowAmplitude = 1 << 3,
  UnwrapUnreliable = 1 << 4,
  Mixed = 1 << 5,  ///< straddles an edge (flying pixel)
  OutOfRange = 1 << 6,
  Interpolated = 1 << 7,
};

/// One image of a frame: `channels` images of width × height, one after the other (planar).
struct Plane {
  PlaneKind kind = PlaneKind::Range;
  ElementType type = ElementType::F32;
  int width = 0;
  int height = 0;
  int channels = 1;
  Buffer data;

  [[nodiscard]] std::size_t byteSize() const {
    return sizeOf(type) * static_cast<std::size_t>(width) * static_cast<std::size_t>(height) *
           static_cast<std::size_t>(channels);
  }
  /// The elements as T, which must be the plane's element type. Planes are aligned to 64 bytes when
  /// they came over the wire and by `Buffer::adopt` otherwise.
  template <class T>
  [[nodiscard]] std::span<const T> as() const {
    return {reinterpret_cast<const T*>(data.bytes().data()), data.size() / sizeof(T)};
  }
};

/// Takes an image over as a one-channel plane without copying it.
Plane toPlane(PlaneKind kind, Image<float> image);
Plane toPlane(PlaneKind kind, Image<std::uint8_t> image);
Plane toPlane(PlaneKind kind, Image<std::uint16_t> image);

/// One raw exposure: when it began on the device's clock, how long, at which modulation.
struct Exposure {
  DeviceTime start;
  Duration duration;
  Frequency modulation;
  bool operator==(const Exposure&) const = default;
};

struct NamedTemperature {
  std::string where;  ///< "illumination", "sensor", "housing", …
  Temperature value;
  bool operator==(const NamedTemperature&) const = default;
};

/// The state of the world and of the device when a frame was taken, as far as it is known.
struct Moment {
  std::vector<Exposure> exposures;  ///< in the order taken; empty where unknown
  HostTime received;                ///< when the daemon had the whole frame
  ClockRelation clock;
  std::optional<Duration> since_power_on;
  std::vector<NamedTemperature> temperatures;
  std::optional<Illuminance> ambient;
  std::optional<Transform<World, Camera>> world_from_camera;
  bool operator==(const Moment&) const = default;
};

/// On the wire as a byte; values never change.
enum class FrameKind : std::uint8_t { Real = 0, Simulated = 1, Replayed = 2, Faulted = 3 };

/// Where a frame comes from, enough to make it again if it was simulated. Ids are content hashes of
/// 32 hex digits, empty where there is none.
struct Provenance {
  FrameKind kind = FrameKind::Real;
  std::string calibration_id;
  std::string scene_id;
  std::string model_id;
  std::uint64_t seed = 0;
  std::vector<std::string> effects;  ///< names of the effects that were on, in the order applied
  bool operator==(const Provenance&) const = default;
};

/// One frame of one source.
struct Frame {
  std::string source;
  std::uint64_t sequence = 0;            ///< counts up by one per source, without gaps
  std::uint64_t dropped_before = 0;      ///< frames of this subscription dropped since the last one
  std::uint64_t dropped_by_device = 0;   ///< lost between device and daemon since the last one
  std::string dropped_because;           ///< why those of the device were lost, for people; empty: not said
  Moment moment;
  Provenance provenance;
  CameraInfo camera;  ///< of the planes as they are: region and decimation applied
  std::vector<Plane> planes;

  /// The first plane of that kind, or null.
  [[nodiscard]] const Plane* find(PlaneKind kind) const {
    for (const Plane& plane : planes) {
      if (plane.kind == kind) return &plane;
    }
    return nullptr;
  }
};

}  // namespace toftwin
