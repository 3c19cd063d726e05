// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/learned/ready_correction.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <toftwin/nan.h>

#include "sim/effects/learned/covariates.h"
#include "sim/images/rows.h"
#include "sim/images/simd.h"

namespace toftwin::sim {
namespace {

using terms::ImageTerms;
using terms::Quantity;
using terms::Term;

// ---- Loops over a row ----------------------------------------------------------------------------------------------

TOFTWIN_SIMD void toMillimetres(const float* __restrict metres, double* __restrict mm, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) mm[i] = 1e3 * static_cast<double>(metres[i]);
}
TOFTWIN_SIMD void toMetres(const double* __restrict mm, float* __restrict metres, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) metres[i] = static_cast<float>(1e-3 * mm[i]);
}
TOFTWIN_SIMD void takeOff(const double* __restrict sums, double* __restrict mm, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) mm[i] -= sums[i];
}
/// off = r + t(r) − r_m; says how many are farther off than that.
TOFTWIN_SIMD std::size_t findOff(const double* __restrict at_mm, const double* __restrict sums, const double* __restrict measured_mm, double close_mm,
                                 double* __restrict off, std::size_t count) {
  std::size_t open = 0;
  for (std::size_t i = 0; i < count; ++i) {
    off[i] = at_mm[i] + sums[i] - measured_mm[i];
    open += std::abs(off[i]) > close_mm ? 1 : 0;
  }
  return open;
}
/// A = A_m / (1 + g); says how many change by more than that share.
TOFTWIN_SIMD std::size_t findAmplitude(const double* __restrict measured, const double* __restrict gains, double close_share, double* __restrict at,
                                       double* __restrict change, std::size_t count) {
  std::size_t open = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const double next = measured[i] / (1.0 + 1e-2 * gains[i]);
    change[i] = next - at[i], at[i] = next;
    open += std::abs(change[i]) > close_share * std::abs(next) ? 1 : 0;
  }
  return open;
}
/// See RowSolver::move().
TOFTWIN_SIMD void moveAll(bool is_plain, const double* __restrict off, double* __restrict at_mm, double* __restrict before_mm,
                          double* __restrict off_before, std::size_t count) {
  const double least = is_plain ? std::numeric_limits<double>::infinity() : 0.2;
  constexpr double kMost = 5.0;
  for (std::size_t k = 0; k < count; ++k) {
    const double slope = (off[k] - off_before[k]) / (at_mm[k] - before_mm[k]);
    const double by = off[k] / ((slope > least) & (slope < kMost) ? slope : 1.0);
    before_mm[k] = at_mm[k], off_before[k] = off[k];
    at_mm[k] -= by;
  }
}

/// Where pixels of a row are on their way to r of r_m = r + t(r), in millimetres, and to A. All lists are as long as each
/// other; without columns they are the row, pixel for pixel.
struct Steps {
  std::vector<int> column{};
  std::vector<double> measured_mm{}, measured_amplitude{}, at_mm{}, at_amplitude{}, change{}, off{}, before_mm{}, off_before{};

  [[nodiscard]] std::size_t size() const { return at_mm.size(); }
  void clear() {
    column.clear();
    for (auto* list : {&measured_mm, &measured_amplitude, &at_mm, &at_amplitude, &change, &off, &before_mm, &off_before}) list->clear();
  }
  void add(int x, const Steps& from, std::size_t k) {
    column.push_back(x);
    measured_mm.push_back(from.measured_mm[k]), at_mm.push_back(from.at_mm[k]), off.push_back(from.off[k]);
    before_mm.push_back(from.before_mm[k]), off_before.push_back(from.off_before[k]);
    if (from.at_amplitude.empty()) return;
    measured_amplitude.push_back(from.measured_amplitude[k]), at_amplitude.push_back(from.at_amplitude[k]), change.push_back(from.change[k]);
  }
};

/// The terms of one effect, ready for a frame.
struct Parts {
  const ImageTerms *fixed, *moving, *amplitude;  ///< null: none
  const RangeGuess* guess;
  bool has_amplitude;  ///< whether any of them asks for it
};

/// Begins at a guess and goes by a secant's steps: all pixels of the row together while most are not there yet, then those by themselves. One
/// for the rows of a thread.
class RowSolver {
 public:
  /// A tenth of a micrometre: half a float's rounding at 4 m.
  static constexpr double kClose_mm = 1e-4, kCloseShare = 1e-8;
  static constexpr int kMostSteps = 30;

  explicit RowSolver(const Parts& parts) : parts_(parts) {}

  void solve(int y, float* range_m, float* amplitude_e, std::size_t width) {
    y_ = y;
    begin(range_m, amplitude_e, width);
    if (parts_.moving == nullptr && parts_.amplitude == nullptr) return toMetres(row_.measured_mm.data(), range_m, width);
    begun();
    std::size_t open = evaluate(row_);
    int step = 1;
    for (constexpr std::size_t kFew = 4; kFew * open > width && step < kMostSteps; ++step) {
      move(row_, step);
      open = evaluate(row_);
    }
    toMetres(row_.at_mm.data(), range_m, width);
    if (parts_.amplitude != nullptr) std::ranges::transform(row_.at_amplitude, amplitude_e, [](double a) { return static_cast<float>(a); });
    if (open > 0) finish(step, range_m, amplitude_e);
  }

 private:
  /// What was measured less what does not change on the way.
  void begin(const float* range_m, const float* amplitude_e, std::size_t width) {
    row_.measured_mm.resize(width);
    toMillimetres(range_m, row_.measured_mm.data(), width);
    if (parts_.has_amplitude) {
      row_.measured_amplitude.assign(width, kNaN);
      if (amplitude_e != nullptr) std::ranges::transform(amplitude_e, amplitude_e + width, row_.measured_amplitude.begin(), [](float a) { return static_cast<double>(a); });
      row_.at_amplitude = row_.measured_amplitude;
    }
    if (parts_.fixed == nullptr) return;
    row_.at_mm = row_.measured_mm;
    sums_.assign(width, 0.0);
    addTo(sums_, *parts_.fixed, row_, fixed_room_);
    takeOff(sums_.data(), row_.measured_mm.data(), width);
  }
  void begun() {
    const std::size_t width = row_.measured_mm.size();
    for (auto* list : {&row_.at_mm, &row_.before_mm, &row_.off, &row_.off_before}) list->resize(width);
    if (parts_.has_amplitude) row_.change.resize(width);
    if (parts_.guess->isEmpty()) std::ranges::copy(row_.measured_mm, row_.at_mm.begin());
    else parts_.guess->of(row_.measured_mm, row_.at_mm);
  }

  /// How far r + t(r) is off, and what A would be there; how many pixels are not there yet.
  std::size_t evaluate(Steps& pixels) {
    sums_.assign(pixels.size(), 0.0);
    if (parts_.moving != nullptr) addTo(sums_, *parts_.moving, pixels, moving_room_);
    const std::size_t open = findOff(pixels.at_mm.data(), sums_.data(), pixels.measured_mm.data(), kClose_mm, pixels.off.data(), pixels.size());
    if (parts_.amplitude == nullptr) return open;
    gains_.assign(pixels.size(), 0.0);
    addTo(gains_, *parts_.amplitude, pixels, amplitude_room_);
    return open + findAmplitude(pixels.measured_amplitude.data(), gains_.data(), kCloseShare, pixels.at_amplitude.data(), pixels.change.data(), pixels.size());
  }

  void addTo(std::vector<double>& sums, const ImageTerms& terms, const Steps& pixels, ImageTerms::Room& room) const {
    const auto rows = [&](std::size_t which, std::span<double> row) {
      learnedCovariate(terms.perPixel()[which])->of_decoded(pixels.at_mm, pixels.at_amplitude, row);
    };
    if (pixels.column.empty()) terms.addRow(y_, rows, sums, room);
    else terms.addAt(pixels.column, y_, rows, sums, room);
  }

  [[nodiscard]] bool isOpen(const Steps& pixels, std::size_t k) const {
    return std::abs(pixels.off[k]) > kClose_mm ||
           (parts_.amplitude != nullptr && std::abs(pixels.change[k]) > kCloseShare * std::abs(pixels.at_amplitude[k]));
  }

  /// To r − off, which is right where t does not go with the range. With two places known, to where their chord is zero,
  /// unless that is much farther or nearer: beside a jump or a knot. Now and then to r − off again, so that nothing goes in
  /// circles.
  static void move(Steps& pixels, int step) {
    constexpr int kAnew = 5;
    moveAll(step % kAnew == 1, pixels.off.data(), pixels.at_mm.data(), pixels.before_mm.data(), pixels.off_before.data(),
            pixels.size());
  }

  /// Keeps for each pixel that is not there the best place that it met, until all are.
  void finish(int first_step, float* range_m, float* amplitude_e) {
    open_.clear();
    for (std::size_t x = 0; x < row_.size(); ++x)
      if (isOpen(row_, x)) open_.add(static_cast<int>(x), row_, x);
    best_.assign(open_.size(), 0.0);
    std::ranges::transform(open_.off, best_.begin(), [](double off) { return std::abs(off); });
    std::size_t still_open = open_.size();
    for (int step = first_step; step < kMostSteps && still_open > 0; ++step) {
      move(open_, step);
      still_open = evaluate(open_);
      for (std::size_t k = 0; k < open_.size(); ++k) {
        if (!(std::abs(open_.off[k]) <= best_[k])) continue;
        best_[k] = std::abs(open_.off[k]);
        const auto x = static_cast<std::size_t>(open_.column[k]);
        range_m[x] = static_cast<float>(1e-3 * open_.at_mm[k]);
        if (parts_.amplitude != nullptr) amplitude_e[x] = static_cast<float>(open_.at_amplitude[k]);
      }
    }
  }

  Parts parts_;
  int y_ = 0;
  Steps row_{}, open_{};
  std::vector<double> sums_{}, gains_{}, best_{};
  ImageTerms::Room fixed_room_{}, moving_room_{}, amplitude_room_{};
};

// ---- Which terms are which -----------------------------------------------------------------------------------------

/// Whether all, or any, of a term's covariates are such.
template <class Test>
bool allOf(const Term& term, const Test& test) {
  return std::ranges::all_of(terms::covariatesOf({term}), test);
}
bool isOfFrame(const std::string& name) { return learnedCovariate(name)->varies == terms::Varies::Frame; }
bool isRange(const std::string& name) { return learnedCovariate(name)->varies == terms::Varies::Pixel && name != "amplitude_e"; }

}  // namespace

ReadyCorrection::ReadyCorrection(const std::vector<Learned>& effects, int width, int height, const Conditions& now) {
  const auto ready = [&](const std::vector<Term>& some, int columns, int rows) {
    return some.empty() ? std::nullopt : std::optional<ImageTerms>{std::in_place, some, columns, rows, [&](std::string_view name) { return fieldOf(name, now); }};
  };
  for (const Learned& effect : effects) {
    std::vector<Term> fixed, moving, of_range, amplitude;
    for (const Term& term : effect.terms.list())
      if (term.quantity == Quantity::AmplitudePercent) amplitude.push_back(term);
    for (const Term& term : effect.terms.list()) {
      if (term.quantity != Quantity::RangeMm) continue;
      const bool moves = !allOf(term, [&](const std::string& name) { return !isRange(name) && (name != "amplitude_e" || amplitude.empty()); });
      (moves ? moving : fixed).push_back(term);
      if (moves && allOf(term, [](const std::string& name) { return isRange(name) || isOfFrame(name); })) of_range.push_back(term);
    }
    Undo one{.fixed = ready(fixed, width, height), .moving = ready(moving, width, height), .amplitude = ready(amplitude, width, height), .of_range = ready(of_range, 1, 1)};
    one.of_frame = terms::covariatesOf(of_range);
    std::erase_if(one.of_frame, [](const std::string& name) { return !isOfFrame(name); });
    undos_.insert(undos_.begin(), std::move(one));
  }
}

void ReadyCorrection::Undo::setFrame(const Conditions& now) {
  for (auto* part : {&fixed, &moving, &amplitude})
    if (*part) (*part)->setFrame([&](std::string_view name) { return knownOfFrame(name, now); });
  if (of_range) makeGuess(now);
}

/// Anew only where the frame changes what goes with the range.
void ReadyCorrection::Undo::makeGuess(const Conditions& now) {
  std::vector<double> values;
  for (const std::string& name : of_frame) values.push_back(knownOfFrame(name, now).number);
  const auto is_same = [](double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); };
  if (!guess.isEmpty() && std::ranges::equal(values, frame_values, is_same)) return;
  frame_values = std::move(values);
  of_range->setFrame([&](std::string_view name) { return knownOfFrame(name, now); });
  guess = RangeGuess{[&](std::span<const double> range_mm, std::span<double> sums) {
    of_range->addRow(0, [&](std::size_t which, std::span<double> row) {
      learnedCovariate(of_range->perPixel()[which])->of_decoded(range_mm, {}, row);
    }, sums);
  }};
}

void ReadyCorrection::Undo::undo(DecodedImages& images) const {
  const int width = images.range_m.width(), height = images.range_m.height();
  const bool has_amplitude = !images.amplitude.empty();
  const auto asksForAmplitude = [](const std::optional<ImageTerms>& part) { return part && std::ranges::find(part->perPixel(), "amplitude_e") != part->perPixel().end(); };
  const Parts parts{.fixed = fixed ? &*fixed : nullptr, .moving = moving ? &*moving : nullptr, .amplitude = amplitude && has_amplitude ? &*amplitude : nullptr,
                    .guess = &guess, .has_amplitude = (amplitude && has_amplitude) || asksForAmplitude(fixed) || asksForAmplitude(moving) || asksForAmplitude(amplitude)};
  if (parts.fixed == nullptr && parts.moving == nullptr && parts.amplitude == nullptr) return;
  forRows(height, [&](int first_row, int last_row) {
    RowSolver solver{parts};
    for (int y = first_row; y < last_row; ++y)
      solver.solve(y, &images.range_m(0, y), has_amplitude ? &images.amplitude(0, y) : nullptr, static_cast<std::size_t>(width));
  });
}

DecodedImages ReadyCorrection::undone(DecodedImages measured, const Conditions& now) {
  for (Undo& one : undos_) {
    one.setFrame(now);
    one.undo(measured);
  }
  return measured;
}

}  // namespace toftwin::sim
