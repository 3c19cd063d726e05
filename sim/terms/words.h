// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>
#include <string_view>

#include "sim/terms/term.h"

/// The words of the language, a row each: parser, writer, evaluators and documents follow these tables.
namespace toftwin::terms {

inline constexpr int kAnyCount = -1;

struct BasisWord {
  std::string_view word;
  Basis basis;
  int numbers;                ///< how many follow the argument; kAnyCount: pairs
  std::string_view numbered;  ///< what they are called, as in "exponent"
  std::string_view formula;
};
inline constexpr std::array kBasisWords{
    BasisWord{"power", Basis::Power, 1, "n", "x^n"},
    BasisWord{"log", Basis::Log, 0, "", "ln x"},
    BasisWord{"decay", Basis::Decay, 1, "tau", "exp(-x/tau)"},
    BasisWord{"sine", Basis::Sine, 1, "period", "sin(2 pi x/period)"},
    BasisWord{"cosine", Basis::Cosine, 1, "period", "cos(2 pi x/period)"},
    BasisWord{"sawtooth", Basis::Sawtooth, 2, "period, a", "(x - a)/period - floor((x - a)/period) - 1/2"},
    BasisWord{"step", Basis::Step, 1, "a", "1 from x = a on, else 0"},
    BasisWord{"sigmoid", Basis::Sigmoid, 2, "a, w", "1/(1 + exp(-(x - a)/w))"},
    BasisWord{"hinge", Basis::Hinge, 1, "a", "max(0, x - a)"},
    BasisWord{"bump", Basis::Bump, 2, "a, w", "exp(-((x - a)/w)^2/2)"},
    BasisWord{"hat", Basis::Hat, 3, "a, b, c", "1 at b, falling linearly to 0 at a and c; an infinite a or c: 1 on that side"},
    BasisWord{"curve", Basis::Curve, kAnyCount, "x0, y0, x1, y1, ...", "straight between the points, constant beyond"},
    BasisWord{"class", Basis::Class, 2, "m, k", "1 where floor(x) mod m = k, else 0"},
    BasisWord{"level", Basis::Level, 0, "'name'", "1 where the category has that name, else 0"},
    BasisWord{"secant", Basis::Secant, 0, "", "1/cos x - 1, x in degrees"},
    BasisWord{"tangent2", Basis::Tangent2, 0, "", "tan^2 x, x in degrees"}};

struct QuantityWord {
  std::string_view word;
  Quantity quantity;
  Stage stage;
};
inline constexpr std::array kQuantityWords{
    QuantityWord{"value", Quantity::Value, Stage::Range},
    QuantityWord{"range_mm", Quantity::RangeMm, Stage::Range},
    QuantityWord{"amplitude_percent", Quantity::AmplitudePercent, Stage::Range},
    QuantityWord{"noise_mm", Quantity::NoiseMm, Stage::Range},
    QuantityWord{"invalid_percent", Quantity::InvalidPercent, Stage::Range},
    QuantityWord{"delay_mm", Quantity::DelayMm, Stage::Light},
    QuantityWord{"light_percent", Quantity::LightPercent, Stage::Light},
    QuantityWord{"outward_px", Quantity::OutwardPx, Stage::Light},
    QuantityWord{"in_phase_e", Quantity::InPhaseE, Stage::Samples},
    QuantityWord{"quadrature_e", Quantity::QuadratureE, Stage::Samples},
    QuantityWord{"charge_percent", Quantity::ChargePercent, Stage::Samples}};

/// Carrier::One has no word.
struct CarrierWord {
  std::string_view word;
  Carrier carrier;
  int numbers;
  std::string_view numbered;
  Quantity of;  ///< the only quantity that it carries
};
inline constexpr std::array kCarrierWords{
    CarrierWord{"square", Carrier::Square, 1, "reach", Quantity::LightPercent},
    CarrierWord{"row_mean", Carrier::Row, 0, "", Quantity::LightPercent},
    CarrierWord{"column_mean", Carrier::Column, 0, "", Quantity::LightPercent},
    CarrierWord{"mirror", Carrier::Mirror, 3, "reach, right, down", Quantity::LightPercent},
    CarrierWord{"across", Carrier::Across, 0, "", Quantity::RangeMm},
    CarrierWord{"along", Carrier::Along, 0, "", Quantity::RangeMm},
    CarrierWord{"around", Carrier::Around, 0, "", Quantity::RangeMm},
    CarrierWord{"before", Carrier::Before, 0, "", Quantity::RangeMm}};

const BasisWord& wordOf(Basis basis);
const QuantityWord& wordOf(Quantity quantity);
/// Not of Carrier::One.
const CarrierWord& wordOf(Carrier carrier);

/// What is wrong with a factor's numbers, as "needs a period other than 0", or nothing.
std::string problemOf(const Factor& factor);
/// The same of a whole term: its factors, its carrier's numbers and whether the quantity can be carried so.
std::string problemOf(const Term& term);

}  // namespace toftwin::terms
