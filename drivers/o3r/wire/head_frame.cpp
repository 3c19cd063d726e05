// SPDX-License-Identifier: Apache-2.0
#include "drivers/o3r/wire/head_frame.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "drivers/o3d303/wire/frame_content.h"

namespace toftwin::o3r {
namespace {

using toftwin::o3d303::ChunkHeader;
using toftwin::o3d303::ChunkType;
using toftwin::o3d303::ElementFormat;
using toftwin::o3d303::Schema;
using toftwin::o3d303::SchemaElement;

ChunkHeader headerOf(const HeadFrame& frame, ChunkType type, ElementFormat format) {
  return {.type = type,
          .width = frame.width,
          .height = frame.height,
          .format = format,
          .time_us = frame.time_us,
          .frame_count = frame.frame_count,
          .time = frame.time};
}

void appendImage(Bytes& bytes, const HeadFrame& frame, ChunkType type, std::span<const std::uint16_t> image) {
  if (image.empty()) return;
  appendChunk(bytes, headerOf(frame, type, ElementFormat::U16), std::as_bytes(image));
}

template <class Info>
void appendInfo(Bytes& bytes, const HeadFrame& frame, ChunkType type, const std::optional<Info>& info) {
  if (info) appendBytesChunk(bytes, type, frame, encode(*info));
}

void appendLens(Bytes& bytes, const HeadFrame& frame, ChunkType type, LensModel TofInfo::*lens) {
  if (frame.tof_info) appendBytesChunk(bytes, type, frame, encode((*frame.tof_info).*lens));
}

/// Results of applications and of the inertial sensor, and images that only other heads or settings give.
constexpr std::array<std::string_view, 11> kOthers{"RADIAL_DISTANCE_NOISE",
                                                   "REFLECTIVITY",
                                                   "ALGO_DEBUG",
                                                   "O3R_ODS_INFO",
                                                   "O3R_ODS_OCCUPANCY_GRID",
                                                   "O3R_RESULT_JSON",
                                                   "O3R_RESULT_ARRAY2D",
                                                   "O3R_RESULT_IMU",
                                                   "O3R_ODS_FLAGS",
                                                   "O3R_ODS_POLAR_OCC_GRID",
                                                   "O3R_ODS_EXTRINSIC_CALIBRATION_CORRECTION"};

/// False if no head has it.
bool appendBlob(Bytes& bytes, std::string_view id, const HeadFrame& f) {
  if (id == kDistanceBlob) return appendImage(bytes, f, ChunkType::RadialDistance, f.distance), true;
  if (id == kAmplitudeBlob) return appendImage(bytes, f, ChunkType::Amplitude, f.amplitude), true;
  if (id == kConfidenceBlob) return appendImage(bytes, f, ChunkType::Confidence, f.confidence), true;
  // The second name of each is that of firmware before 1.0.
  if (id == kTofInfoBlob || id == "O3R_DISTANCE_IMAGE_INFO")
    return appendInfo(bytes, f, ChunkTypes::kTofInfo, f.tof_info), true;
  if (id == kRgbInfoBlob || id == "O3R_RGB_IMAGE_INFO")
    return appendInfo(bytes, f, ChunkTypes::kRgbInfo, f.rgb_info), true;
  if (id == kIntrinsicsBlob) return appendLens(bytes, f, ChunkType::Intrinsics, &TofInfo::intrinsics), true;
  if (id == kInverseIntrinsicsBlob)
    return appendLens(bytes, f, ChunkType::InverseIntrinsics, &TofInfo::inverse_intrinsics), true;
  if (id == kJpegBlob) {
    if (!f.jpeg.empty()) appendChunk(bytes, headerOf(f, ChunkTypes::kJpeg, ElementFormat::U8), f.jpeg);
    return true;
  }
  return std::ranges::find(kOthers, id) != kOthers.end();
}

bool appendElement(Bytes& bytes, const SchemaElement& element, const HeadFrame& frame) {
  switch (element.kind) {
    case SchemaElement::Kind::Text:
      toftwin::o3d303::appendText(bytes, element.value);
      return true;
    case SchemaElement::Kind::Blob:
      return appendBlob(bytes, element.id, frame);
    case SchemaElement::Kind::Records:
      return element.id.starts_with("O3R_");  // of applications, of which there are none
    case SchemaElement::Kind::Number:
      break;
  }
  return false;
}

}  // namespace

Schema schemaOf(std::initializer_list<std::string_view> blobs) {
  Schema schema{SchemaElement::text("start_string", std::string{toftwin::o3d303::kFrameBegin})};
  for (const std::string_view blob : blobs) schema.push_back(SchemaElement::blob(blob));
  schema.push_back(SchemaElement::text("end_string", std::string{toftwin::o3d303::kFrameEnd}));
  return schema;
}

void appendBytesChunk(Bytes& to, ChunkType type, const HeadFrame& frame, std::span<const std::byte> bytes) {
  ChunkHeader header = headerOf(frame, type, ElementFormat::U8);
  header.width = static_cast<std::uint32_t>(bytes.size());
  header.height = 1;
  appendChunk(to, header, bytes);
}

Result<Bytes> writeHeadFrame(const Schema& schema, const HeadFrame& frame) {
  Bytes bytes;
  for (const SchemaElement& element : schema) {
    if (appendElement(bytes, element, frame)) continue;
    return Error{Error::Code::Unsupported,
                 fmt::format("PCIC schema: \"{}\" is nothing that a head of an O3R has", element.id)};
  }
  return bytes;
}

}  // namespace toftwin::o3r
