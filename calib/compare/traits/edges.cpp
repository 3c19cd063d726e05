// SPDX-License-Identifier: Apache-2.0
// What happens at an edge: flying pixels, its width, the light's shadow.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>

#include "calib/compare/traits/bursts.h"
#include "calib/compare/traits/least_squares.h"

namespace toftwin::compare {
namespace {

constexpr double kJump = 0.03;   ///< of a range between two surfaces, relative
constexpr double kHangs = 0.15;  ///< of the step that a pixel must be away from both surfaces

double at(const Image<float>& image, int x, int y) { return static_cast<double>(image(x, y)); }

/// A step in a row: surfaces at x − 2 and x + 2 that differ, and each of which goes on beyond.
struct Step {
  double left = 0.0, right = 0.0;
};
std::optional<Step> stepAt(const Image<float>& range, int x, int y) {
  if (x < 3 || x + 3 >= range.width()) return std::nullopt;
  const double left = at(range, x - 2, y), right = at(range, x + 2, y);
  const double step = std::abs(right - left);
  if (!(step > kJump * std::min(left, right))) return std::nullopt;
  const bool is_flat =
      std::abs(at(range, x - 3, y) - left) < 0.2 * step && std::abs(at(range, x + 3, y) - right) < 0.2 * step;
  return is_flat ? std::optional{Step{left, right}} : std::nullopt;
}

double normalShare(double z) { return 0.5 * std::erfc(-z / std::numbers::sqrt2); }

/// Where a row crosses from one surface to another.
struct Crossing {
  std::size_t edge = 0;  ///< the how manieth of its row
  double offset = 0.0;   ///< where its pixel hangs, 0 near to 1 far; NaN: none does
};

/// By rows, and within a row by place.
std::vector<Crossing> crossingsOf(const Image<float>& range_m) {
  std::vector<Crossing> all;
  for (int y = 0; y < range_m.height(); ++y) {
    std::size_t edge = 0;
    for (int x = 0; x < range_m.width(); ++x) {
      if (!stepAt(range_m, x, y)) continue;
      // One crossing, however many places of it see the step.
      double offset = std::nan("");
      for (; x < range_m.width() && stepAt(range_m, x, y); ++x) {
        const auto there = *stepAt(range_m, x, y);
        const double near = std::min(there.left, there.right), far = std::max(there.left, there.right);
        const double share = (at(range_m, x, y) - near) / (far - near);
        if (share > kHangs && share < 1.0 - kHangs && std::isnan(offset)) offset = share;
      }
      all.push_back({edge++, offset});
    }
  }
  return all;
}

/// The same along one edge after the other.
std::vector<Crossing> alongEdges(std::vector<Crossing> crossings) {
  std::ranges::stable_sort(crossings, {}, &Crossing::edge);
  return crossings;
}

/// The share of those that are so. Rows err in runs, be it as a whole or at one of their edges: by what is longer.
template <class Is>
Trait shareOf(const char* name, const std::vector<Crossing>& by_rows, const Is& is) {
  const auto trialsOf = [&](const std::vector<Crossing>& crossings) {
    Trials trials;
    for (const Crossing& one : crossings) trials.add(is(one));
    return trials;
  };
  Trials along_edges;  // each a series of its own
  std::size_t edge = 0;
  for (const Crossing& one : alongEdges(by_rows)) {
    if (std::exchange(edge, one.edge) != one.edge) along_edges.endSeries();
    along_edges.add(is(one));
  }
  return trialsOf(by_rows).share(name, along_edges.together());
}

/// Where they hang on the mean, neighbours alike.
Trait meanOffset(const std::vector<Crossing>& by_rows) {
  std::vector<double> offsets, along_edges(by_rows.size());
  std::vector<std::size_t> order(by_rows.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, {}, [&](std::size_t i) { return by_rows[i].edge; });
  for (std::size_t i = 0; i < order.size(); ++i) along_edges[order[i]] = static_cast<double>(i);
  for (const Crossing& one : by_rows) offsets.push_back(one.offset);
  const auto fit = fitInOrder([](std::span<const double> p, std::size_t) { return p[0]; }, offsets, {0.5}, along_edges);
  return fit ? fit->trait("offset", "1", 0) : meanTrait("offset", "1", offsets);
}

}  // namespace

Traits flyingTraits(const Image<float>& range_m) {
  std::vector<Crossing> crossings = crossingsOf(range_m);
  if (crossings.size() < 4)
    return undetermined("flying pixels", "fewer than four rows cross an edge between two surfaces");
  std::vector<Trait> traits{shareOf("flying", crossings, [](const Crossing& one) { return !std::isnan(one.offset); })};
  // What does not fly hangs nowhere; of one pixel there is no interval.
  std::erase_if(crossings, [](const Crossing& one) { return std::isnan(one.offset); });
  if (crossings.size() > 1) {
    traits.push_back(meanOffset(crossings));
    traits.push_back(shareOf("near side", crossings, [](const Crossing& one) { return one.offset < 0.5; }));
  }
  return traits;
}

Traits edgeTraits(Column x_px, Column value) {
  const auto rows = finiteRows({x_px, value}, 8, "edge");
  if (!rows) return rows.error();
  const auto &x = (*rows)[0], &v = (*rows)[1];
  const auto [low, high] = std::ranges::minmax(x);
  if (!(high > low)) return undetermined("edge", "all values are of one place");
  const Model model = [&](std::span<const double> p, std::size_t i) {
    return p[0] + p[1] * normalShare((x[i] - p[2]) / std::exp(p[3]));
  };
  double left = 0.0, right = 0.0, left_count = 0.0, right_count = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const bool is_left = x[i]<low + 0.25 * (high - low), is_right = x[i]> high - 0.25 * (high - low);
    left += is_left ? v[i] : 0.0, left_count += is_left ? 1.0 : 0.0;
    right += is_right ? v[i] : 0.0, right_count += is_right ? 1.0 : 0.0;
  }
  left /= std::max(1.0, left_count), right /= std::max(1.0, right_count);
  std::optional<Fit> fit;
  for (const double place : {0.35, 0.5, 0.65}) {
    for (const double width : {0.02, 0.08, 0.2}) {
      auto tried = fitLeastSquares(
          model, v, {left, right - left, low + place * (high - low), std::log(width * (high - low))});
      if (tried && (!fit || tried->squares < fit->squares)) fit = std::move(tried);
    }
  }
  if (fit) fit = fitInOrder(model, v, fit->at, x);
  if (!fit)
    return undetermined("edge", "there is no step, or it is sharper than the places of the values tell");
  const Trait log_width = fit->trait("width", "px", 3);
  std::vector<Trait> traits{fit->trait("edge", "px", 2)};
  if (!(log_width.high - log_width.low < 2.0 * std::numbers::ln10)) {
    traits[0].doubt = "how wide the edge is the values do not tell, not by a factor of ten";
    return traits;
  }
  const auto scaled = [&](const char* name, const char* unit, double factor) {
    return Trait{name,
                 unit,
                 factor * std::exp(log_width.value),
                 factor * std::exp(log_width.low),
                 factor * std::exp(log_width.high),
                 log_width.n};
  };
  // Contrast of a Gaussian blur: e^(−2π² w² f²) = 1/2.
  const double half = std::sqrt(0.5 * std::numbers::ln2) / std::numbers::pi;
  traits.push_back(scaled("width", "px", 1.0));
  traits.push_back(scaled("10-90 width", "px", 2.5631031310892));
  traits.push_back({"resolution", "1/px", half / std::exp(log_width.value), half / std::exp(log_width.high),
                    half / std::exp(log_width.low), log_width.n});
  return traits;
}

Traits shadowTraits(const Image<float>& range_m, double split_m) {
  std::vector<double> left, right, difference;
  for (int y = 0; y < range_m.height(); ++y) {
    int first = -1, last = -1;
    for (int x = 0; x < range_m.width(); ++x) {
      if (!(at(range_m, x, y) < split_m)) continue;
      if (first < 0) first = x;
      last = x;
    }
    if (first < 0) continue;
    int before = first - 1, after = last + 1;
    while (before >= 0 && std::isnan(range_m(before, y))) --before;
    while (after < range_m.width() && std::isnan(range_m(after, y))) ++after;
    if (before < 0 || after == range_m.width()) continue;  // nothing of the background is seen there
    left.push_back(first - 1 - before);
    right.push_back(after - last - 1);
    difference.push_back(right.back() - left.back());
  }
  if (left.size() < 4)
    return undetermined("emitter shadow", "fewer than four rows show an object before a background");
  std::vector<Trait> traits{meanTrait("left", "px", left), meanTrait("right", "px", right),
                            meanTrait("asymmetry", "px", difference)};
  // Rows that all count the same say nothing within the pixel that they are counted in.
  for (Trait& one : traits) {
    const double least = &one == &traits.back() ? one.value - 0.5 : std::max(0.0, one.value - 0.5);
    if (one.low == one.high) one.low = least, one.high = one.value + 0.5;
  }
  return traits;
}

}  // namespace toftwin::compare
