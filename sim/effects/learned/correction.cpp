// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/learned/correction.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <toftwin/nan.h>

#include "sim/effects/learned/covariates.h"
#include "sim/effects/learned/sums.h"
#include "sim/images/rows.h"
#include "sim/images/simd.h"

namespace toftwin::sim {
namespace {

using terms::ImageTerms;
using terms::Quantity;

/// Why a term cannot be undone in a pixel of a decoded image; empty if it can.
std::string whyNot(const terms::Term& term) {
  switch (term.quantity) {
    case Quantity::RangeMm:
    case Quantity::AmplitudePercent:
      break;
    case Quantity::Value:
      return "it is of a table's values, which are no ranges";
    case Quantity::NoiseMm:
      return "noise cannot be taken off";
    case Quantity::InvalidPercent:
      return "a reading that is lost cannot be brought back";
    default:
      return fmt::format("it acts on the camera's {}, before decoding", wordOf(stageOf(term.quantity)));
  }
  if (term.carrier == terms::Carrier::One) return {};
  return term.carrier == terms::Carrier::Before ? "it goes with the frame before" : "it goes with what other pixels see";
}

/// Where pixels of a row are on their way to r of r_m = r + t(r), in millimetres, and to A. All lists are as long as each
/// other; without columns they are the row, pixel for pixel.
struct Steps {
  std::vector<int> column{};
  std::vector<double> measured_mm{}, measured_amplitude{}, at_mm{}, at_amplitude{}, off{}, before_mm{}, off_before{};

  [[nodiscard]] std::size_t size() const { return at_mm.size(); }
  void add(int x, const Steps& from, std::size_t k) {
    column.push_back(x);
    measured_mm.push_back(from.measured_mm[k]), measured_amplitude.push_back(from.measured_amplitude[k]);
    at_mm.push_back(from.at_mm[k]), at_amplitude.push_back(from.at_amplitude[k]), off.push_back(from.off[k]);
    before_mm.push_back(from.before_mm[k]), off_before.push_back(from.off_before[k]);
  }
};

/// See RowSolver::move().
TOFTWIN_SIMD void moveAll(bool is_plain, const double* __restrict off, double* __restrict at_mm,
                          double* __restrict before_mm, double* __restrict off_before, std::size_t count) {
  const double least = is_plain ? std::numeric_limits<double>::infinity() : 0.2;
  constexpr double kMost = 5.0;
  for (std::size_t k = 0; k < count; ++k) {
    const double slope = (off[k] - off_before[k]) / (at_mm[k] - before_mm[k]);
    const double by = off[k] / ((slope > least) & (slope < kMost) ? slope : 1.0);
    before_mm[k] = at_mm[k], off_before[k] = off[k];
    at_mm[k] -= by;
  }
}

/// A secant's steps: all pixels of the row together for the first three, which are mostly enough, and those that are not
/// there yet by themselves.
class RowSolver {
 public:
  /// A tenth of a micrometre: half a float's rounding at 4 m.
  static constexpr double kClose_mm = 1e-4;
  static constexpr int kTogether = 3, kMostSteps = 30;

  RowSolver(const ImageTerms* range, const ImageTerms* amplitude, int y) : range_(range), amplitude_(amplitude), y_(y) {}

  void solve(float* range_m, float* amplitude_e, std::size_t width) {
    Steps row = begun(range_m, amplitude_e, width);
    for (int step = 0; step < kTogether; ++step) {
      if (step > 0) move(row, step);
      evaluate(row);
    }
    Steps open;
    for (std::size_t x = 0; x < width; ++x) {
      range_m[x] = static_cast<float>(1e-3 * row.at_mm[x]);
      if (amplitude_ != nullptr) amplitude_e[x] = static_cast<float>(row.at_amplitude[x]);
      if (isOpen(row, x)) open.add(static_cast<int>(x), row, x);
    }
    if (open.size() > 0) finish(std::move(open), range_m, amplitude_e);
  }

 private:
  static Steps begun(const float* range_m, const float* amplitude_e, std::size_t width) {
    Steps row;
    row.measured_mm.resize(width), row.measured_amplitude.assign(width, kNaN);
    for (std::size_t x = 0; x < width; ++x) row.measured_mm[x] = 1e3 * static_cast<double>(range_m[x]);
    for (std::size_t x = 0; x < width && amplitude_e != nullptr; ++x)
      row.measured_amplitude[x] = static_cast<double>(amplitude_e[x]);
    row.at_mm = row.before_mm = row.measured_mm, row.at_amplitude = row.measured_amplitude;
    row.off.assign(width, 0.0), row.off_before.assign(width, 0.0);
    return row;
  }

  /// How far r + t(r) is off, and what A would be there.
  void evaluate(Steps& pixels) {
    sums_.assign(pixels.size(), 0.0);
    if (range_ != nullptr) addTo(sums_, *range_, pixels);
    for (std::size_t k = 0; k < pixels.size(); ++k) pixels.off[k] = pixels.at_mm[k] + sums_[k] - pixels.measured_mm[k];
    if (amplitude_ == nullptr) return;
    gains_.assign(pixels.size(), 0.0);
    addTo(gains_, *amplitude_, pixels);
    amplitude_before_ = pixels.at_amplitude;
    for (std::size_t k = 0; k < pixels.size(); ++k)
      pixels.at_amplitude[k] = pixels.measured_amplitude[k] / (1.0 + 1e-2 * gains_[k]);
  }

  void addTo(std::vector<double>& sums, const ImageTerms& terms, const Steps& pixels) const {
    const auto rows = [&](std::size_t which, std::span<double> row) {
      learnedCovariate(terms.perPixel()[which])->of_decoded(pixels.at_mm, pixels.at_amplitude, row);
    };
    if (pixels.column.empty()) terms.addRow(y_, rows, sums);
    else terms.addAt(pixels.column, y_, rows, sums);
  }

  [[nodiscard]] bool isOpen(const Steps& pixels, std::size_t k) const {
    constexpr double kCloseShare = 1e-8;
    const bool is_amplitude_moving =
        amplitude_ != nullptr &&
        std::abs(pixels.at_amplitude[k] - amplitude_before_[k]) > kCloseShare * std::abs(pixels.at_amplitude[k]);
    return std::abs(pixels.off[k]) > kClose_mm || is_amplitude_moving;
  }

  /// To r − off, which is right where t does not go with the range. With two places known, to where their chord is zero,
  /// unless that is much farther or nearer: beside a jump or a knot. Now and then to r − off again, so that nothing goes in
  /// circles.
  static void move(Steps& pixels, int step) {
    constexpr int kAnew = 5;
    moveAll(step % kAnew == 1, pixels.off.data(), pixels.at_mm.data(), pixels.before_mm.data(), pixels.off_before.data(),
            pixels.size());
  }

  /// Keeps for each pixel the best place that it met, until all are there.
  void finish(Steps open, float* range_m, float* amplitude_e) {
    std::vector<double> best(open.size());
    for (std::size_t k = 0; k < open.size(); ++k) best[k] = std::abs(open.off[k]);
    for (int step = kTogether; step < kMostSteps; ++step) {
      move(open, step);
      evaluate(open);
      bool is_any_open = false;
      for (std::size_t k = 0; k < open.size(); ++k) {
        is_any_open = is_any_open || isOpen(open, k);
        if (!(std::abs(open.off[k]) <= best[k])) continue;
        best[k] = std::abs(open.off[k]);
        const auto x = static_cast<std::size_t>(open.column[k]);
        range_m[x] = static_cast<float>(1e-3 * open.at_mm[k]);
        if (amplitude_ != nullptr) amplitude_e[x] = static_cast<float>(open.at_amplitude[k]);
      }
      if (!is_any_open) return;
    }
  }

  const ImageTerms *range_, *amplitude_;
  int y_;
  std::vector<double> sums_{}, gains_{}, amplitude_before_{};
};

void undo(const Learned& effect, Correction::Images& images, const Conditions& now) {
  const int width = images.range_m.width(), height = images.range_m.height();
  const auto plain = [&](Quantity quantity) { return plainTermsOf(effect.terms.list(), quantity, width, height, now); };
  const auto range = plain(Quantity::RangeMm), amplitude = plain(Quantity::AmplitudePercent);
  if (!range && !amplitude) return;
  const bool has_amplitude = !images.amplitude.empty();
  forRows(height, [&](int first_row, int last_row) {
    for (int y = first_row; y < last_row; ++y) {
      RowSolver solver{range ? &*range : nullptr, amplitude && has_amplitude ? &*amplitude : nullptr, y};
      solver.solve(&images.range_m(0, y), has_amplitude ? &images.amplitude(0, y) : nullptr, static_cast<std::size_t>(width));
    }
  });
}

}  // namespace

Result<Correction> Correction::of(std::vector<Learned> effects) {
  for (const Learned& effect : effects) {
    if (const std::string problem = effect.problem(); !problem.empty() && effect.stage() == terms::Stage::Range)
      return Error{Error::Code::InvalidArgument, problem};
    for (const terms::Term& term : effect.terms.list())
      if (const std::string why = whyNot(term); !why.empty())
        return Error{Error::Code::Unsupported, fmt::format("\"{}\" cannot be undone: {}", toText(term), why)};
  }
  return Correction{std::move(effects)};
}

Correction::Images Correction::undone(Images measured, const Conditions& now) const {
  for (auto effect = effects_.rbegin(); effect != effects_.rend(); ++effect) undo(*effect, measured, now);
  return measured;
}

std::vector<std::string> Correction::covariates() const {
  std::vector<terms::Term> all;
  for (const Learned& effect : effects_) all.insert(all.end(), effect.terms.list().begin(), effect.terms.list().end());
  return terms::covariatesOf(all);
}

std::vector<std::string> Correction::unknownOf(const Conditions& now) const {
  std::vector<std::string> unknown = covariates();
  std::erase_if(unknown, [&](const std::string& name) {
    return learnedCovariate(name)->varies != terms::Varies::Frame || !std::isnan(knownOfFrame(name, now).number);
  });
  return unknown;
}

bool Correction::changesAmplitude() const {
  return std::ranges::any_of(effects_, [](const Learned& effect) {
    return std::ranges::any_of(effect.terms.list(), [](const terms::Term& term) {
      return term.quantity == Quantity::AmplitudePercent;
    });
  });
}

}  // namespace toftwin::sim
