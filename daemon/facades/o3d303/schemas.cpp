// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/o3d303/schemas.h"

#include <array>
#include <string_view>
#include <vector>

#include "drivers/o3d303/wire/frame_content.h"
#include "drivers/o3d303/wire/frame_writer.h"

namespace toftwin::daemon::o3d303 {

using toftwin::o3d303::Schema;
using toftwin::o3d303::SchemaElement;

/// An empty frame tells.
bool isServed(const Schema& schema) {
  constexpr std::size_t kMostElements = 64;
  toftwin::o3d303::CameraFrame none;
  none.width = none.height = 0;
  return schema.size() <= kMostElements && writeFrameContent(schema, none).ok();
}

Schema schemaOfImage(int number) {
  using namespace toftwin::o3d303;
  using Blobs = std::vector<std::string_view>;
  constexpr int kAllPoints = 11;
  constexpr std::array kOne{kRawAmplitudeBlob, kAmplitudeBlob,  kDistanceBlob,   kXBlob, kYBlob, kZBlob,
                            kConfidenceBlob,   kExtrinsicsBlob, kUnitVectorsBlob};
  Blobs blobs;
  if (number >= 1 && number <= std::ssize(kOne)) blobs = {kOne[static_cast<std::size_t>(number) - 1]};
  if (number == kAllPoints) blobs = {kXBlob, kYBlob, kZBlob};
  Schema schema;
  for (const std::string_view blob : blobs) schema.push_back(SchemaElement::blob(blob));
  return schema;
}

}  // namespace toftwin::daemon::o3d303
