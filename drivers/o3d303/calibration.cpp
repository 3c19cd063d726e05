// SPDX-License-Identifier: Apache-2.0
#include "drivers/o3d303/calibration.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "drivers/logging.h"
#include "drivers/o3d303/wire/extrinsics.h"
#include "drivers/o3d303/wire/frame_content.h"
#include "drivers/ray_fit.h"
#include "sim/images/content_hash.h"

namespace toftwin::drivers::o3d303 {
namespace {

using namespace toftwin::o3d303;

constexpr double kExpectedRms_px = 0.5;

std::string idOf(const CameraInfo& c) {
  const auto& d = c.distortion;
  return sim::contentHash(fmt::format("o3d303 {} {} {} {} {} {} {} {} {} {} {}", c.width, c.height, c.fx,
                                      c.fy, c.cx, c.cy, d[0], d[1], d[2], d[3], d[4]));
}

/// How the unit vectors are rotated against the lens; old firmware may leave the chunk out.
Result<ExtrinsicCalibration> extrinsicsOf(const FrameContent& content) {
  ExtrinsicCalibration extrinsics{};
  const Chunk* chunk = content.find(ChunkType::Extrinsics);
  if (chunk == nullptr) return extrinsics;
  const auto numbers = floatsOf(*chunk);
  if (!numbers) return numbers.error();
  const auto isFinite = [](float number) { return std::isfinite(number); };
  if (numbers->size() < extrinsics.size() || !std::ranges::all_of(*numbers, isFinite)) {
    return Error{Error::Code::Malformed,
                 "o3d303: the extrinsic calibration is not six numbers; export the camera's configuration "
                 "and look at ExtrinsicCalib*"};
  }
  std::ranges::copy_n(numbers->begin(), extrinsics.size(), extrinsics.begin());
  return extrinsics;
}

Result<Calibration> calibrationOf(const FrameContent& content) {
  const Chunk* chunk = content.find(ChunkType::UnitVectors);
  if (chunk == nullptr) {
    return Error{Error::Code::Incompatible,
                 "o3d303: the camera does not say where its pixels look (no unit vectors); update its "
                 "firmware"};
  }
  const auto unit_vectors = floatsOf(*chunk);
  if (!unit_vectors) return unit_vectors.error();
  const auto extrinsics = extrinsicsOf(content);
  if (!extrinsics) return extrinsics.error();
  const std::vector<float> rays = raysFrom(*unit_vectors, *extrinsics);
  const int width = static_cast<int>(chunk->header.width);
  const int height = static_cast<int>(chunk->header.height);
  auto fitted = fitCamera(width, height, rays);
  if (!fitted) return Error{fitted.error().code, "o3d303: " + fitted.error().message};
  if (fitted->rms_px > kExpectedRms_px) {
    logging::warn("o3d303: the camera's rays differ from our lens model by {:.2f} pixels (rms)",
                  fitted->rms_px);
  }
  Calibration calibration{fitted->camera, Image<float>{width, height}};
  calibration.camera.calibration_id = idOf(calibration.camera);
  for (std::size_t i = 0; i < calibration.depth_per_range.size(); ++i) {
    const float x = rays[3 * i], y = rays[3 * i + 1], z = rays[3 * i + 2];
    calibration.depth_per_range[i] = z / std::sqrt(x * x + y * y + z * z);
  }
  return calibration;
}

}  // namespace

Result<Calibration> readCalibration(EventLoop& loop, const Endpoint& pcic, bool must_trigger,
                                    std::chrono::milliseconds within) {
  const auto deadline = std::chrono::steady_clock::now() + within;
  PcicStream stream{loop};
  if (auto opened = stream.open(pcic, schemaOf({kUnitVectorsBlob, kExtrinsicsBlob})); !opened)
    return opened.error();
  if (must_trigger) {
    const auto answer = stream.command("t");
    if (!answer) return answer.error();
  }
  while (true) {
    auto message = stream.next(deadline, {});
    if (!message && message.error().code == Error::Code::Timeout) {
      return Error{Error::Code::Disconnected,
                   fmt::format("o3d303: {}: no frame within {} ms; is another program configuring the "
                               "camera, or is it triggered by hardware?",
                               pcic.address().to_string(), within.count())};
    }
    if (!message) return message.error();
    if (message->message.ticket != kFrameTicket) continue;
    const auto content = readFrameContent(message->message.content);
    // Before the camera has understood our schema it may send frames of its own.
    if (content && content->find(ChunkType::UnitVectors) == nullptr &&
        content->find(ChunkType::RadialDistance) != nullptr) {
      continue;
    }
    if (!content) return Error{Error::Code::Disconnected, "o3d303: " + content.error().message};
    return calibrationOf(*content);
  }
}

}  // namespace toftwin::drivers::o3d303
