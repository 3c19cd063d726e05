// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <compare>
#include <numbers>

namespace toftwin {

/// A number with a dimension. It enters with a literal (`15_mm`) or a unit (`3.0 * second`) and
/// leaves only by naming a unit: `exposure.in(millisecond)`. Stored in the SI unit of its dimension
/// (degrees Celsius for temperatures). Dimensions never mix, and only the operations that keep
/// the dimension exist; whoever needs another one leaves with `.in(unit)`.
template <class Dimension>
class Quantity;

/// A unit of a dimension: how many SI units it is, and the suffix that keys and fields carry.
template <class Dimension>
struct Unit {
  double in_si;
  const char* suffix;
};

template <class Dimension>
class Quantity {
 public:
  constexpr Quantity() = default;
  constexpr Quantity(double value, Unit<Dimension> unit) : si_(value * unit.in_si) {}

  [[nodiscard]] constexpr double in(Unit<Dimension> unit) const { return si_ / unit.in_si; }

  constexpr auto operator<=>(const Quantity&) const = default;
  constexpr Quantity operator-() const { return fromSi(-si_); }
  constexpr Quantity& operator+=(Quantity other) { return *this = *this + other; }
  constexpr Quantity& operator-=(Quantity other) { return *this = *this - other; }

  friend constexpr Quantity operator+(Quantity a, Quantity b) { return fromSi(a.si_ + b.si_); }
  friend constexpr Quantity operator-(Quantity a, Quantity b) { return fromSi(a.si_ - b.si_); }
  friend constexpr Quantity operator*(Quantity a, double factor) { return fromSi(a.si_ * factor); }
  friend constexpr Quantity operator*(double factor, Quantity a) { return a * factor; }
  friend constexpr Quantity operator/(Quantity a, double divisor) { return fromSi(a.si_ / divisor); }
  friend constexpr double operator/(Quantity a, Quantity b) { return a.si_ / b.si_; }

 private:
  static constexpr Quantity fromSi(double si) {
    Quantity q;
    q.si_ = si;
    return q;
  }
  double si_ = 0.0;
};

template <class Dimension>
constexpr Quantity<Dimension> operator*(double value, Unit<Dimension> unit) {
  return {value, unit};
}

namespace dimension {
struct Length {};
struct Duration {};
struct Frequency {};
struct Angle {};
struct Temperature {};
struct Illuminance {};
}  // namespace dimension

using Length = Quantity<dimension::Length>;
using Duration = Quantity<dimension::Duration>;
using Frequency = Quantity<dimension::Frequency>;
using Angle = Quantity<dimension::Angle>;
using Temperature = Quantity<dimension::Temperature>;
using Illuminance = Quantity<dimension::Illuminance>;

inline constexpr Unit<dimension::Length> metre{1.0, "m"};
inline constexpr Unit<dimension::Length> centimetre{1e-2, "cm"};
inline constexpr Unit<dimension::Length> millimetre{1e-3, "mm"};
inline constexpr Unit<dimension::Length> micrometre{1e-6, "um"};
inline constexpr Unit<dimension::Duration> second{1.0, "s"};
inline constexpr Unit<dimension::Duration> millisecond{1e-3, "ms"};
inline constexpr Unit<dimension::Duration> microsecond{1e-6, "us"};
inline constexpr Unit<dimension::Duration> nanosecond{1e-9, "ns"};
inline constexpr Unit<dimension::Frequency> hertz{1.0, "hz"};
inline constexpr Unit<dimension::Frequency> megahertz{1e6, "mhz"};
inline constexpr Unit<dimension::Angle> radian{1.0, "rad"};
inline constexpr Unit<dimension::Angle> degree{std::numbers::pi / 180.0, "deg"};
inline constexpr Unit<dimension::Temperature> celsius{1.0, "c"};
inline constexpr Unit<dimension::Illuminance> kilolux{1.0, "klx"};

inline namespace literals {
// clang-format off
constexpr Length operator""_m(long double v) { return {static_cast<double>(v), metre}; }
constexpr Length operator""_m(unsigned long long v) { return {static_cast<double>(v), metre}; }
constexpr Length operator""_cm(long double v) { return {static_cast<double>(v), centimetre}; }
constexpr Length operator""_cm(unsigned long long v) { return {static_cast<double>(v), centimetre}; }
constexpr Length operator""_mm(long double v) { return {static_cast<double>(v), millimetre}; }
constexpr Length operator""_mm(unsigned long long v) { return {static_cast<double>(v), millimetre}; }
constexpr Length operator""_um(long double v) { return {static_cast<double>(v), micrometre}; }
constexpr Length operator""_um(unsigned long long v) { return {static_cast<double>(v), micrometre}; }
constexpr Duration operator""_s(long double v) { return {static_cast<double>(v), second}; }
constexpr Duration operator""_s(unsigned long long v) { return {static_cast<double>(v), second}; }
constexpr Duration operator""_ms(long double v) { return {static_cast<double>(v), millisecond}; }
constexpr Duration operator""_ms(unsigned long long v) { return {static_cast<double>(v), millisecond}; }
constexpr Duration operator""_us(long double v) { return {static_cast<double>(v), microsecond}; }
constexpr Duration operator""_us(unsigned long long v) { return {static_cast<double>(v), microsecond}; }
constexpr Duration operator""_ns(long double v) { return {static_cast<double>(v), nanosecond}; }
constexpr Duration operator""_ns(unsigned long long v) { return {static_cast<double>(v), nanosecond}; }
constexpr Frequency operator""_Hz(long double v) { return {static_cast<double>(v), hertz}; }
constexpr Frequency operator""_Hz(unsigned long long v) { return {static_cast<double>(v), hertz}; }
constexpr Frequency operator""_MHz(long double v) { return {static_cast<double>(v), megahertz}; }
constexpr Frequency operator""_MHz(unsigned long long v) { return {static_cast<double>(v), megahertz}; }
constexpr Angle operator""_rad(long double v) { return {static_cast<double>(v), radian}; }
constexpr Angle operator""_rad(unsigned long long v) { return {static_cast<double>(v), radian}; }
constexpr Angle operator""_deg(long double v) { return {static_cast<double>(v), degree}; }
constexpr Angle operator""_deg(unsigned long long v) { return {static_cast<double>(v), degree}; }
constexpr Temperature operator""_degC(long double v) { return {static_cast<double>(v), celsius}; }
constexpr Temperature operator""_degC(unsigned long long v) { return {static_cast<double>(v), celsius}; }
constexpr Illuminance operator""_klx(long double v) { return {static_cast<double>(v), kilolux}; }
constexpr Illuminance operator""_klx(unsigned long long v) { return {static_cast<double>(v), kilolux}; }
// clang-format on
}  // namespace literals

/// Exact by definition of the metre (SI brochure, 9th edition).
inline constexpr double kSpeedOfLight_m_per_s = 299'792'458.0;

/// The range after which a phase at `modulation` repeats: c / 2f.
constexpr Length unambiguousRange(Frequency modulation) {
  return Length{kSpeedOfLight_m_per_s / (2.0 * modulation.in(hertz)), metre};
}

}  // namespace toftwin
