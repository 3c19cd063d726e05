// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <toftwin/result.h>

#include "calib/discover/table_map.h"

/// What headers say.
namespace toftwin::discover {

/// Which column is what.
struct Roles {
  std::string measured{}, reference{}, error{}, sigma{}, session{}, capture{}, locked{};
  bool is_reversed = false;  ///< error is reference − measured
  std::vector<std::pair<std::string, MapNature>> covariates{};
  /// Covariates whose header could name the session, too: finer than it, they name captures.
  std::vector<std::string> other_groups{};
  std::vector<std::string> left_out{};  ///< columns that have no part
  /// "error = depth_mm − reference_mm; covariates time_s, temperature_c".
  [[nodiscard]] std::string inWords() const;
};

/// By the map, and where it is silent by the headers' words. Errors: a column of the map that is not there,
/// or one with two roles; neither measured values nor errors to be found.
Result<Roles> rolesOf(const std::vector<std::string>& header, const TableMap& map,
                      const std::filesystem::path& file);

/// The unit that a header ends in: "depth_mm" → "mm"; "depth [mm]" and "depth (mm)", too. Empty: none is
/// known.
std::string unitOf(const std::string& header);

/// What a length in the one unit is multiplied with to be in the other; 1 where one of them is none.
double lengthFactor(const std::string& from, const std::string& to);
/// Units of length in a metre; nothing of another unit.
std::optional<double> unitsPerMetre(const std::string& unit);
bool isLengthOrNone(const std::string& unit);

/// Whether one of a header's words, in small letters, is one of these.
bool saysWord(const std::string& header, const std::vector<std::string_view>& words);
/// Whether a header says what was looked at: "target_m", "plane", "nominal_mm".
bool namesTarget(const std::string& header);

/// "pixel_column", "u", "row": with whole numbers they count, and odd ones may differ from even ones.
bool isPixelNumber(const std::string& header);

Nature natureOf(const std::string& header, MapNature said);

}  // namespace toftwin::discover
