// SPDX-License-Identifier: Apache-2.0
#include "drivers/o3d303/wire/frame_writer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

namespace toftwin::o3d303 {
namespace {

template <class T>
void appendImage(Bytes& bytes, const CameraFrame& frame, ChunkType type, ElementFormat format,
                 const T& elements, bool is_image = true) {
  appendChunk(bytes,
              {.type = type,
               .width = is_image ? frame.width : static_cast<std::uint32_t>(std::size(elements)),
               .height = is_image ? frame.height : 1,
               .format = format,
               .time_us = frame.time_us,
               .frame_count = frame.frame_count,
               .status = frame.status,
               .time = frame.time},
              std::as_bytes(std::span{elements}));
}

/// p = e d + t in millimetres, as it is: x right, y down, z forward. Invalid pixels are 0.
std::vector<std::int16_t> coordinate(const CameraFrame& frame, ChunkType type) {
  const std::size_t axis = type == ChunkType::X ? 0 : type == ChunkType::Y ? 1 : 2;
  std::vector<std::int16_t> image(frame.distance_mm.size());
  for (std::size_t i = 0; i < image.size(); ++i) {
    const float distance = frame.distance_mm[i];
    if (distance == 0.0F || (frame.confidence[i] & 1U) != 0) continue;
    const float p = frame.unit_vectors[3 * i + axis] * distance + frame.extrinsics[axis];
    constexpr float kMost = std::numeric_limits<std::int16_t>::max();
    image[i] = static_cast<std::int16_t>(std::lround(std::clamp(p, -kMost, kMost)));
  }
  return image;
}

/// What the camera's application made of the frame: one of type "Camera" only takes it.
std::string modelOf(const CameraFrame& frame) {
  return fmt::format(R"({{"Type":"Camera","FrameCount":{}}})", frame.frame_count);
}

/// How the camera was while it took the frame: temperatures in tenths of a degree, evaluation time in
/// milliseconds, frame rate in hertz, 32 bits each. [ifm/o3d3xx-python, pcic/image_client.py]
std::array<std::int32_t, 6> diagnosticOf(const CameraFrame& f) {
  constexpr float kTenths = 10.0F;
  const auto tenths = [](float celsius) { return static_cast<std::int32_t>(std::lround(kTenths * celsius)); };
  const auto whole = [](double number) { return static_cast<std::int32_t>(std::lround(number)); };
  return {tenths(f.illumination_c), tenths(f.front1_c),     tenths(f.front2_c),
          tenths(f.processor_c),    whole(f.evaluation_ms), whole(f.frame_rate_hz)};
}

bool appendBlob(Bytes& bytes, std::string_view id, const CameraFrame& f) {
  using enum ChunkType;
  using Format = ElementFormat;
  if (id == kDistanceBlob)
    return appendImage(bytes, f, RadialDistance, Format::U16, f.distance_mm), true;
  if (id == kAmplitudeBlob) return appendImage(bytes, f, Amplitude, Format::U16, f.amplitude), true;
  if (id == kRawAmplitudeBlob) {
    return appendImage(bytes, f, RawAmplitude, Format::U16, f.raw_amplitude), true;
  }
  if (id == kConfidenceBlob)
    return appendImage(bytes, f, Confidence, Format::U8, f.confidence), true;
  if (id == kUnitVectorsBlob) {
    return appendImage(bytes, f, UnitVectors, Format::F32x3, f.unit_vectors), true;
  }
  for (const auto& [blob, type] : {std::pair{kXBlob, X}, {kYBlob, Y}, {kZBlob, Z}}) {
    if (id == blob) return appendImage(bytes, f, type, Format::S16, coordinate(f, type)), true;
  }
  if (id == kExtrinsicsBlob)
    return appendImage(bytes, f, Extrinsics, Format::F32, f.extrinsics, false), true;
  if (id == kIntrinsicsBlob)
    return appendImage(bytes, f, Intrinsics, Format::F32, f.intrinsics, false), true;
  if (id == kInverseIntrinsicsBlob) {
    return appendImage(bytes, f, InverseIntrinsics, Format::F32, f.inverse_intrinsics, false), true;
  }
  if (id == kDiagnosticBlob) return appendImage(bytes, f, Diagnostic, Format::S32, diagnosticOf(f), false), true;
  if (id == kJsonBlob) return appendImage(bytes, f, Json, Format::U8, modelOf(f), false), true;
  return false;
}

std::optional<double> numberNamed(std::string_view id, const CameraFrame& f) {
  const std::pair<std::string_view, double> known[] = {{"exposure_time_1", f.exposures_us[0]},
                                                       {"exposure_time_2", f.exposures_us[1]},
                                                       {"exposure_time_3", f.exposures_us[2]},
                                                       {"temp_illu", f.illumination_c},
                                                       {"temp_front1", f.front1_c},
                                                       {"temp_front2", f.front2_c},
                                                       {"temp_imx6", f.processor_c},
                                                       {"evaltime", f.evaluation_ms},
                                                       {"framerate", f.frame_rate_hz},
                                                       {"activeapp_id", f.active_application}};
  for (const auto& [name, number] : known) {
    if (name == id) return number;
  }
  return std::nullopt;
}

/// False if the camera has nothing of that name.
bool appendElement(Bytes& bytes, const SchemaElement& element, const CameraFrame& frame) {
  switch (element.kind) {
    case SchemaElement::Kind::Text:
      appendText(bytes, element.value);
      return true;
    case SchemaElement::Kind::Blob:
      return appendBlob(bytes, element.id, frame);
    case SchemaElement::Kind::Records:
      return element.id == "models";  // of which an application of type Camera has none
    case SchemaElement::Kind::Number:
      break;
  }
  const auto number = numberNamed(element.id, frame);
  if (number) appendFormatted(bytes, *number, element.type, element.format);
  return number.has_value();
}

}  // namespace

Result<Bytes> writeFrameContent(const Schema& schema, const CameraFrame& frame) {
  Bytes bytes;
  for (const SchemaElement& element : schema) {
    if (appendElement(bytes, element, frame)) continue;
    return Error{Error::Code::Unsupported,
                 fmt::format("PCIC schema: \"{}\" is nothing that this camera has", element.id)};
  }
  return bytes;
}

}  // namespace toftwin::o3d303
