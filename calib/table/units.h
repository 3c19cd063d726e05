// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

/// Units as people write them, and where a header says one.
namespace toftwin::table {

/// What is converted into each other.
enum class Quantity : std::uint8_t { Length, Time, Illuminance, Speed, Pixels, Angle, Temperature, Frequency, Other };

struct Unit {
  std::string_view name;  ///< as we write it: "ms"
  Quantity quantity;
  double in_base;         ///< millimetres, seconds, kilolux, m/s, pixels, degrees, °C, MHz
};

/// By its name or another spelling, in any case but for a capital M before small letters, which would be mega. Null: none
/// that is known.
const Unit* findUnit(std::string_view name);

/// All names of a quantity's units: "m, cm, mm".
std::string namesOf(Quantity quantity);

/// A header in its parts.
struct HeaderUnit {
  std::string stem{};       ///< without the unit
  std::string unit{};       ///< as written; empty where none is said
  bool is_certain = false;  ///< in brackets, so that it must be a unit
  [[nodiscard]] const Unit* known() const { return unit.empty() ? nullptr : findUnit(unit); }
};
/// "depth_mm", "depth [mm]", "depth (mm)", "depth, mm", "depth / mm", "depth in mm", "depthMm". A name that is a unit
/// itself ("h") has it, with an empty stem.
HeaderUnit unitOfHeader(std::string_view header);

/// What a number in `from` is multiplied with to be in `to`; 1 where one of them is unknown, or they are of different
/// quantities.
double factorBetween(std::string_view from, std::string_view to);

}  // namespace toftwin::table
