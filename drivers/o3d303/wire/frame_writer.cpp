// SPDX-License-Identifier: Apache-2.0
#include "drivers/o3d303/wire/frame_writer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
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

/// p = e d + t in millimetres; the camera calls z forward X, -x Y and -y Z. Invalid pixels are 0.
std::vector<std::int16_t> coordinate(const CameraFrame& frame, ChunkType type) {
  const std::size_t axis = type == ChunkType::X ? 2 : type == ChunkType::Y ? 0 : 1;
  const float sign = type == ChunkType::X ? 1.0F : -1.0F;
  std::vector<std::int16_t> image(frame.distance_mm.size());
  for (std::size_t i = 0; i < image.size(); ++i) {
    const float distance = frame.distance_mm[i];
    if (distance == 0.0F || (frame.confidence[i] & 1U) != 0) continue;
    const float p = frame.unit_vectors[3 * i + axis] * distance + frame.extrinsics[axis];
    constexpr float kMost = std::numeric_limits<std::int16_t>::max();
    image[i] = static_cast<std::int16_t>(std::lround(std::clamp(sign * p, -kMost, kMost)));
  }
  return image;
}

/// What the camera's application made of the frame: one of type "Camera" only takes it.
std::string modelOf(const CameraFrame& frame) {
  return fmt::format(R"({{"Type":"Camera","FrameCount":{}}})", frame.frame_count);
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
  if (id == kJsonBlob) return appendImage(bytes, f, Json, Format::U8, modelOf(f), false), true;
  return false;
}

}  // namespace

Result<Bytes> writeFrameContent(const Schema& schema, const CameraFrame& frame) {
  Bytes bytes;
  for (const SchemaElement& element : schema) {
    bool is_known = true;
    switch (element.type) {
      case SchemaElement::Type::Text:
        appendText(bytes, element.value);
        break;
      case SchemaElement::Type::Blob:
        is_known = appendBlob(bytes, element.id, frame);
        break;
      case SchemaElement::Type::Float32:
        is_known = element.id == "temp_illu";
        appendNumber(bytes, frame.illumination_c);
        break;
      case SchemaElement::Type::UInt32: {
        constexpr std::string_view ids[] = {"exposure_time_1", "exposure_time_2",
                                            "exposure_time_3"};
        const auto* found = std::ranges::find(ids, element.id);
        is_known = found != std::end(ids);
        if (is_known)
          appendNumber(bytes, frame.exposures_us[static_cast<std::size_t>(found - ids)]);
        break;
      }
    }
    if (!is_known) {
      return Error{Error::Code::Unsupported,
                   fmt::format("PCIC schema: \"{}\" is nothing that this camera has", element.id)};
    }
  }
  return bytes;
}

}  // namespace toftwin::o3d303
