// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <toftwin/frame.h>
#include <toftwin/result.h>

#include <array>
#include <cstdint>
#include <vector>

#include "daemon/facades/gige_vision/features.h"
#include "daemon/facades/gige_vision/gvcp.h"

/// A frame as the images that a GigE Vision camera sends.
namespace toftwin::daemon::gige_vision {

/// What is sent, and how.
struct ImageSetup {
  std::uint32_t x = 0, y = 0, width = 0, height = 0;  ///< the part of the source's image
  std::array<std::uint32_t, Component::kCount> formats{};
  std::array<bool, Component::kCount> is_sent{};
  std::array<bool, 3> has_chunk{};  ///< time stamp, exposure time, frame's number
  bool is_spherical = false;        ///< a single C is along the pixel's ray
  bool is_multipart = false;
  double scale_mm = 1.0;
  double amplitude_per_count = 1.0;
};

/// How a format's counts become coordinates: scale · count + offset, in millimetres.
struct Axis {
  double scale_mm = 1.0, offset_mm = 0.0;
  double invalid = 0.0;  ///< the count where there is no value
};
/// Of coordinate A, B or C.
Axis axisOf(std::uint32_t format, std::uint32_t coordinate, double scale_mm);

/// Bytes of a frame with that setup, chunks included.
std::uint32_t payloadSizeOf(const ImageSetup& setup);

/// One image of a frame, or its chunks.
struct Part {
  std::uint16_t component = 0;  ///< GenICam's ComponentIDValue
  std::uint16_t data_type = 0;  ///< GigE Vision's: 1 image, 5 3D image, 9 confidence, 10 chunks
  std::uint32_t format = 0, width = 0, height = 0, x = 0, y = 0;
  std::size_t offset = 0, size = 0;  ///< in the payload's bytes
};
struct Payload {
  std::vector<Part> parts;
  Bytes bytes;
  bool has_chunks = false;
};

/// Unit vectors of the camera's pixels.
struct Rays {
  CameraInfo camera;
  std::vector<float> unit_vectors;  ///< three per pixel
};
Rays raysOf(const CameraInfo& camera);

/// `rays` of the frame's camera; `stamp_ns` for the chunk. Unsupported: nothing is to be sent, or the frame has
/// not what is, or is smaller than the region. So a payload has an image at least.
Result<Payload> payloadOf(const Frame& frame, const Rays& rays, const ImageSetup& setup,
                          std::int64_t stamp_ns);

}  // namespace toftwin::daemon::gige_vision
