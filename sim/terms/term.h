// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include <toftwin/result.h>

/// The language of effects: what the search finds, what files say and what the simulator adds are the same terms.
namespace toftwin::terms {

/// Function of one number x. `Factor::numbers` holds its parameters, in the order given here.
enum class Basis : std::uint8_t {
  Power,     ///< x^n; n
  Log,       ///< ln x, of x > 0
  Decay,     ///< exp(−x/τ); τ
  Sine,      ///< sin(2π x/Λ); period Λ
  Cosine,    ///< cos(2π x/Λ); period Λ
  Sawtooth,  ///< (x − a)/Λ − floor((x − a)/Λ) − ½; period Λ, place of a jump a
  Step,      ///< 1 from x ≥ a on, else 0; a
  Sigmoid,   ///< 1/(1 + exp(−(x − a)/w)); a, w
  Hinge,     ///< max(0, x − a); a
  Bump,      ///< exp(−½ ((x − a)/w)²); a, w
  Hat,       ///< 1 at b, falling linearly to 0 at a and c; a, b, c. An infinite a or c: 1 on that side
  Curve,     ///< straight between the knots (x₀, y₀), (x₁, y₁) …, constant beyond; x₀, y₀, x₁, y₁, …
  Class,     ///< 1 where floor(x) mod m = k, else 0; m, k
  Level,     ///< 1 where the category's name is `Factor::level`, else 0
  Secant,    ///< 1/cos x − 1, of an angle in degrees
  Tangent2,  ///< tan² x, of an angle in degrees
};

/// x: a weighted sum of covariates, of which most have one: column + row for a checkerboard.
struct Argument {
  struct Part {
    double weight = 1.0;
    std::string covariate;  ///< "range_mm"; of a table, the header
    bool operator==(const Part&) const = default;
  };
  std::vector<Part> parts;
  bool operator==(const Argument&) const = default;
};

struct Factor {
  Basis basis = Basis::Power;
  Argument of;
  std::vector<double> numbers{};
  std::string level{};  ///< of Level only
  bool operator==(const Factor&) const = default;
};

/// What a term adds to. Ranges are of the decoded image, light is what reaches the pixel, charges are samples.
/// The stage is the quantity's own.
enum class Quantity : std::uint8_t {
  Value,             ///< the measured value of a table without a unit of length, in its own unit
  RangeMm,           ///< decoded range, mm
  AmplitudePercent,  ///< decoded amplitude, % of itself
  NoiseMm,           ///< standard deviation of white noise added to the decoded range, mm
  InvalidPercent,    ///< share of readings that are no measurement, %
  DelayMm,           ///< path of the light, as range, mm
  LightPercent,      ///< own light, % of itself or of the carrier
  OutwardPx,         ///< how far out of its place a pixel looks, pixels
  InPhaseE,          ///< charge of the first tap in phase with the reference, electrons: (2/N) cos(2π k/N) of it in raw exposure k of N
  QuadratureE,       ///< the same in quadrature: (2/N) sin(2π k/N)
  ChargePercent,     ///< all charges, % of themselves
};

enum class Stage : std::uint8_t { Light, Samples, Range };
Stage stageOf(Quantity quantity);

/// What a term is a share of, besides 1. Numbers are in `Term::carried`.
enum class Carrier : std::uint8_t {
  One,
  Square,  ///< mean of the light over a square of so many pixels' reach; reach
  Row,     ///< mean of the light over the pixel's row
  Column,  ///< mean of the light over its column
  Mirror,  ///< mean over a square about the mirrored place; reach, right, down (of the point mirrored about)
  Across,  ///< half of the left pixel's range less the right one's
  Along,   ///< half of the upper pixel's range less the lower one's
  Around,  ///< mean range of the eight pixels around less the pixel's own
  Before,  ///< the pixel's range in the frame before less its own
};

/// coefficient × carrier × product of factors, added to a quantity.
struct Term {
  Quantity quantity = Quantity::RangeMm;
  double coefficient = 0.0;
  Carrier carrier = Carrier::One;
  std::vector<double> carried{};
  std::vector<Factor> factors{};
  bool operator==(const Term&) const = default;
};

/// The basis at x. NaN where x is, and outside of what the basis is defined for. Not for Level.
double valueOf(const Factor& factor, double x);

/// What is known of a covariate where a term is evaluated: a number, or of a category its name.
struct Known {
  double number = 0.0;
  std::string_view name{};
};
/// Gives the covariate of that name, NaN if it is not known.
using Lookup = std::function<Known(std::string_view covariate)>;

double valueOf(const Factor& factor, const Lookup& lookup);
/// coefficient × product of factors, without the carrier.
double valueOf(const Term& term, const Lookup& lookup);
/// Sum of the terms, without their carriers. A term that is NaN, because a covariate is not known or lies outside of
/// what a basis is defined for, adds nothing.
double sumOf(const std::vector<Term>& terms, const Lookup& lookup);

/// All covariates of the terms, each once, in the order they come.
std::vector<std::string> covariatesOf(const std::vector<Term>& terms);

/// One line, which parseTerm() reads back to the same bits:
///     range_mm += -5.95 * sine(range_mm, 1250) * decay(time_s, 400)
///     range_mm += 12.5 * level(sensor, 'tof0')
///     range_mm += 1.5 * class(column + row, 2, 1)
///     light_percent += 0.5 * square(15)
///     range_mm += 0.02 * around() * curve(amplitude_e, 500, 1, 2000, 0.2)
/// Words of bases and carriers with their numbers: words.h. A bare covariate is power(covariate, 1). Names that are no word of letters, digits and _ stand between single
/// quotes, in which a quote is doubled. A number before `*` in an argument is a part's weight.
std::string toText(const Term& term);
/// Errors (InvalidArgument) say what was expected at which character, and list the words known there.
Result<Term> parseTerm(std::string_view text);

}  // namespace toftwin::terms
