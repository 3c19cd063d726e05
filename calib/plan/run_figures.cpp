// SPDX-License-Identifier: Apache-2.0
#include "calib/plan/run_figures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numeric>
#include <optional>

#include <toftwin/nan.h>

namespace toftwin::plan {
namespace {

using compare::Curve;
using compare::Ink;
using compare::Stroke;

constexpr std::array kOf{"A", "B"};
constexpr std::array kInkOf{Ink::Measured, Ink::Simulated};
constexpr int kCurvePoints = 80;

const RunTrait* traitOf(const RunTraits& traits, std::string_view what, std::string_view of,
                        std::string_view name) {
  const auto found = std::ranges::find_if(traits.traits, [&](const RunTrait& one) {
    return one.what == what && one.of == of && one.trait.name == name;
  });
  return found == traits.traits.end() ? nullptr : &*found;
}

/// Dots of one camera; those that are not finite are left out.
Curve dotsOf(std::size_t camera) {
  return {.name = kOf[camera], .ink = kInkOf[camera], .stroke = Stroke::Dots};
}
void add(Curve& curve, double x, double y) {
  if (std::isfinite(x) && std::isfinite(y)) curve.x.push_back(x), curve.y.push_back(y);
}

/// A fitted law over the range of some dots.
Curve curveThrough(const Curve& dots, std::size_t camera, const std::function<double(double)>& law) {
  Curve curve{.name = std::string{kOf[camera]} + ", fitted", .ink = kInkOf[camera], .stroke = Stroke::Line};
  const auto [first, last] = std::ranges::minmax(dots.x);
  for (int i = 0; i <= kCurvePoints; ++i) {
    curve.x.push_back(first + (last - first) * i / kCurvePoints);
    curve.y.push_back(law(curve.x.back()));
  }
  return curve;
}

/// The law through the dots' mean: traits say how it changes, and not from where. Nothing for models that
/// they do not say in full.
std::optional<Curve> driftCurve(const RunTraits& traits, const Curve& dots, std::size_t camera) {
  const RunTrait* drift = traitOf(traits, "drift", kOf[camera], "drift");
  if (drift == nullptr || dots.x.empty()) return std::nullopt;
  const RunTrait* tau = traitOf(traits, "drift", kOf[camera], "time constant");
  const auto [first, last] = std::ranges::minmax(dots.x);
  const double begin = first, length = last - first;
  std::function<double(double)> law;
  if (drift->detail == "none") law = [](double) { return 0.0; };
  if (drift->detail == "ramp") law = [=](double t) { return drift->trait.value * (t - begin) / length; };
  if (drift->detail == "one exponential" && tau != nullptr) {
    law = [=](double t) {
      return drift->trait.value * std::expm1(-(t - begin) / tau->trait.value) /
             std::expm1(-length / tau->trait.value);
    };
  }
  if (!law) return std::nullopt;
  double offset = 0.0;
  for (std::size_t i = 0; i < dots.x.size(); ++i)
    offset += (dots.y[i] - law(dots.x[i])) / static_cast<double>(dots.x.size());
  return curveThrough(dots, camera, [=](double t) { return offset + law(t); });
}

/// Mean range less that of the camera's first capture, while warming up.
std::optional<compare::Figure> driftFigure(const ComparedRun& run, const RunTraits& traits) {
  compare::Plot plot{.title = "Drift",
                     .x_label = "time since power-on [s]",
                     .y_label = "range less the first capture's [mm]",
                     .zero_line = true,
                     .compact = true};
  for (std::size_t camera : {std::size_t{0}, std::size_t{1}}) {
    Curve dots = dotsOf(camera);
    double first = kNaN;
    for (const ComparedCapture& one : run.captures) {
      if (one.record.kind != "warm_up" || one.pixels == 0) continue;
      const double range = one.range_a_mm + (camera == 1 ? one.difference_mm : 0.0);
      if (!std::isfinite(first)) first = range;
      add(dots, (camera == 0 ? one.record.a : one.record.b).since_power_on_s, range - first);
    }
    if (dots.x.size() < 3) return std::nullopt;
    if (auto curve = driftCurve(traits, dots, camera)) plot.curves.push_back(*std::move(curve));
    plot.curves.push_back(std::move(dots));
  }
  return compare::Figure{
      "Drift of A and of B while warming up: a dot for each capture, and the model that was chosen.",
      toSvg(plot)};
}

/// Cells of the wall, as many of each capture as a page holds.
std::optional<compare::Figure> distanceFigure(const ComparedRun& run) {
  compare::Plot plot{.title = "Error over distance",
                     .x_label = "distance [m]",
                     .y_label = "error against the plan's wall [mm]",
                     .zero_line = true,
                     .compact = true};
  for (std::size_t camera : {std::size_t{0}, std::size_t{1}}) {
    Curve dots = dotsOf(camera);
    for (const ComparedCapture& one : run.captures) {
      if (one.record.kind != "distance") continue;
      const CameraSeen& seen = one.seen[camera];
      // Every n-th cell: what is drawn must fit a page.
      const std::size_t stride = 1 + seen.wall_range_m.size() / 100;
      for (std::size_t i = 0; i < seen.wall_range_m.size(); i += stride)
        add(dots, seen.wall_range_m[i], seen.wall_error_mm[i]);
    }
    if (dots.x.size() < 3) return std::nullopt;
    plot.curves.push_back(std::move(dots));
  }
  return compare::Figure{
      "Error of A and of B over distance: cells of 8 × 8 pixels of the wall, a hundred of each capture.",
      toSvg(plot)};
}

/// floor² + shot²/I + read²/I², I relative to the largest signal; parts that do not show are 0.
std::optional<compare::Figure> noiseFigure(const ComparedRun& run, const RunTraits& traits) {
  compare::Plot plot{.title = "Noise over amplitude",
                     .x_label = "log10 of the amplitude, relative to the largest",
                     .y_label = "noise [mm]",
                     .log_y = true,
                     .compact = true};
  for (std::size_t camera : {std::size_t{0}, std::size_t{1}}) {
    Curve dots = dotsOf(camera);
    for (const ComparedCapture& one : run.captures) {
      if (one.pixels == 0 || one.record.ambient_klx > 0.0) continue;
      add(dots, std::log10(camera == 0 ? one.amplitude_a : one.amplitude_b),
          camera == 0 ? one.noise_a_mm : one.noise_b_mm);
    }
    if (dots.x.size() < 3) return std::nullopt;
    const double most = std::ranges::max(dots.x);
    for (double& x : dots.x) x -= most;
    const auto part = [&](const char* name) {
      const RunTrait* found = traitOf(traits, "noise law", kOf[camera], name);
      return found == nullptr ? 0.0 : found->trait.value;
    };
    const double floor = part("floor"), shot = part("shot"), read = part("read");
    if (floor + shot + read > 0.0) {
      plot.curves.push_back(curveThrough(dots, camera, [=](double log_signal) {
        const double signal = std::pow(10.0, log_signal);
        return std::sqrt(floor * floor + shot * shot / signal + read * read / (signal * signal));
      }));
    }
    plot.curves.push_back(std::move(dots));
  }
  return compare::Figure{
      "Temporal noise of A and of B over amplitude: a dot for each capture, and the noise law.", toSvg(plot)};
}

}  // namespace

std::vector<compare::Figure> characteristicFigures(const ComparedRun& run, const RunTraits& traits) {
  std::vector<compare::Figure> figures;
  for (auto& one : {driftFigure(run, traits), distanceFigure(run), noiseFigure(run, traits)}) {
    if (one) figures.push_back(*one);
  }
  return figures;
}

}  // namespace toftwin::plan
