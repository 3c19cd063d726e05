// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <toftwin/result.h>

/// The schema: what a frame consists of, asked for by each PCIC connection in JSON.
namespace toftwin::o3d303 {

struct SchemaElement {
  enum class Type { Text, Blob, UInt32, Float32 };
  Type type = Type::Blob;
  std::string id;     ///< of a blob: what it shows
  std::string value;  ///< of a text: the text itself
  bool operator==(const SchemaElement&) const = default;
};
using Schema = std::vector<SchemaElement>;

/// Blobs that a camera can be asked for.
inline constexpr std::string_view kDistanceBlob = "distance_image",
                                  kAmplitudeBlob = "normalized_amplitude_image",
                                  kRawAmplitudeBlob = "amplitude_image", kXBlob = "x_image",
                                  kYBlob = "y_image", kZBlob = "z_image",
                                  kConfidenceBlob = "confidence_image", kDiagnosticBlob = "diagnostic_data",
                                  kUnitVectorsBlob = "all_unit_vector_matrices",
                                  kExtrinsicsBlob = "extrinsic_calibration",
                                  kIntrinsicsBlob = "intrinsic_calibration",
                                  kInverseIntrinsicsBlob = "inverse_intrinsic_calibration",
                                  kJsonBlob = "json_model";

/// Those blobs between "star" and "stop", with exposure times and illumination temperature.
Schema schemaOf(const std::vector<std::string_view>& blobs);

std::string toJson(const Schema& schema);
/// Any text is safe. Element types other than the four above are Unsupported.
Result<Schema> readSchema(std::string_view json);

}  // namespace toftwin::o3d303
