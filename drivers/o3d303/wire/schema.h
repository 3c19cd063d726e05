// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <toftwin/result.h>

#include "drivers/o3d303/wire/number_format.h"

/// The schema: what a frame consists of, asked for by each PCIC connection in JSON.
namespace toftwin::o3d303 {

struct SchemaElement {
  enum class Kind { Text, Blob, Number, Records };
  Kind kind = Kind::Blob;
  std::string id{};     ///< of a blob: what it shows; of a number: what it counts
  std::string value{};  ///< of a text: the text itself
  NumberType type = NumberType::UInt32;
  NumberFormat format{};
  bool operator==(const SchemaElement&) const = default;

  static SchemaElement text(std::string id, std::string value);
  static SchemaElement blob(std::string_view id);
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

/// For schemas of texts without quotes, of blobs, and of numbers in binary, little end first: those that the
/// functions above make.
std::string toJson(const Schema& schema);
/// Any text is safe. Unsupported: a type of elements, a layouter or a format that the camera does not have.
Result<Schema> readSchema(std::string_view json);

}  // namespace toftwin::o3d303
