// SPDX-License-Identifier: Apache-2.0
// What `toftwin discover` finds in tables with hidden effects, and how often it finds something where there is nothing.
//   loop_bench nulls COUNT [seed]            COUNT tables of each of ten kinds of noise, with nothing in them
//   loop_bench effects COUNT [lambda] [seed] COUNT tables with one hidden effect: one in four of two columns
//   loop_bench coverage COUNT [seed]         COUNT tables with one hidden law of the grammar: how often 95 % intervals hold the truth
//   loop_bench speed                         tables of 400 × 6, 40,000 × 10 and 76,000 × 8
// λ is the hidden effect's energy over the noise's variance. Shapes are drawn here and know nothing of the grammar: some are in it,
// some are not (Lorentzians, chirps, triangles, products of hyperbolic tangents). What is removed is of the hidden effect, by the
// written model at rows that were drawn anew.
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <numbers>
#include <random>
#include <set>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "calib/loop/discover.h"

namespace {

using namespace toftwin;
using Random = std::mt19937_64;
using Function = std::function<double(double)>;

double between(Random& random, double low, double high) { return std::uniform_real_distribution<double>{low, high}(random); }
double normal(Random& random) { return std::normal_distribution<double>{}(random); }
std::size_t oneOf(Random& random, std::size_t count) { return static_cast<std::size_t>(random() % count); }

// ---- Rows ----------------------------------------------------------------------------------------------------------

/// Name, nature, and the span that values are drawn from.
struct Drawn {
  std::string header;
  table::Nature nature;
  double low, high;
};
const std::array<Drawn, 7> kColumns{{{"range_mm", table::Nature::Length, 600.0, 4500.0},
                                     {"time_s", table::Nature::Time, 0.0, 600.0},
                                     {"temperature_c", table::Nature::Number, 18.0, 42.0},
                                     {"ambient_klx", table::Nature::Number, 0.5, 60.0},
                                     {"column", table::Nature::Index, 0.0, 224.0},
                                     {"row", table::Nature::Index, 0.0, 172.0},
                                     {"incidence_deg", table::Nature::Angle, 0.0, 65.0}}};

using Rows = std::vector<std::vector<double>>;  // of each of kColumns
Rows drawRows(Random& random, std::size_t count) {
  Rows rows(kColumns.size());
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t c = 0; c < kColumns.size(); ++c) {
      const Drawn& drawn = kColumns[c];
      double value = between(random, drawn.low, drawn.high);
      if (drawn.nature == table::Nature::Time) value = drawn.high * static_cast<double>(i) / static_cast<double>(count);
      if (drawn.nature == table::Nature::Index) value = std::floor(value);
      rows[c].push_back(value);
    }
  }
  return rows;
}

table::Readings readingsOf(const Rows& rows, const std::vector<double>& error) {
  table::Readings r{.file = "drawn.csv", .unit = "mm", .measured_name = "measured_mm", .reference_name = "reference_mm"};
  r.reference = rows[0], r.error = error;
  for (std::size_t i = 0; i < error.size(); ++i) r.measured.push_back(rows[0][i] + error[i]), r.line.push_back(i + 2);
  for (std::size_t c = 1; c < kColumns.size(); ++c) r.covariates.push_back({.header = kColumns[c].header, .nature = kColumns[c].nature, .values = rows[c]});
  return r;
}

// ---- Noise ---------------------------------------------------------------------------------------------------------

constexpr double kSigma = 2.0;
struct Kind {
  const char* name;
  /// Of row i; `state` is what a kind remembers, 0 at first.
  double (*draw)(Random& random, std::size_t i, double range_mm, double& state);
};
const std::array<Kind, 10> kNoise{{
    {"white", [](Random& r, std::size_t, double, double&) { return kSigma * normal(r); }},
    {"AR(0.9) and white", [](Random& r, std::size_t, double, double& s) { s = 0.9 * s + std::sqrt(0.19) * normal(r); return kSigma * std::sqrt(0.5) * (s + normal(r)); }},
    {"AR(0.6)", [](Random& r, std::size_t, double, double& s) { s = 0.6 * s + 0.8 * normal(r); return kSigma * s; }},
    {"Student's t, 3", [](Random& r, std::size_t, double, double&) { return kSigma * std::student_t_distribution<double>{3.0}(r) / std::sqrt(3.0); }},
    {"grows with range", [](Random& r, std::size_t, double range, double&) { return kSigma * normal(r) * (0.5 + range / 2000.0); }},
    {"rounded to 2 mm", [](Random& r, std::size_t, double, double&) { return 2.0 * std::round(0.5 * kSigma * normal(r)); }},
    {"stretches bumped", [](Random& r, std::size_t i, double, double&) { return kSigma * normal(r) + (i / 25 % 17 == 3 ? 6.0 : 0.0); }},
    {"skewed", [](Random& r, std::size_t, double, double&) { return kSigma * (std::exp(0.6 * normal(r)) - std::exp(0.18)); }},
    {"one in twenty six-fold", [](Random& r, std::size_t, double, double&) { return kSigma * normal(r) * (oneOf(r, 20) == 0 ? 6.0 : 1.0); }},
    {"uniform", [](Random& r, std::size_t, double, double&) { return kSigma * between(r, -1.7, 1.7); }},
}};
std::vector<double> drawNoise(Random& random, const Kind& kind, const Rows& rows) {
  std::vector<double> noise;
  double state = 0.0;
  for (std::size_t i = 0; i < rows[0].size(); ++i) noise.push_back(kind.draw(random, i, rows[0][i], state));
  return noise;
}

// ---- Hidden effects ------------------------------------------------------------------------------------------------

struct Shape {
  std::string name;
  Function at;  ///< of a column's share of its span, 0 to 1
};
Shape drawShape(Random& random, const Drawn& column) {
  const double p = between(random, 0.0, 1.0), q = between(random, 0.0, 1.0);
  if (column.nature == table::Nature::Index && oneOf(random, 5) < 2) {
    std::vector<double> levels(2 + oneOf(random, 15));
    for (double& level : levels) level = normal(random);
    const double span = column.high - column.low;
    return {fmt::format("class {}", levels.size()), [=](double x) { return levels[static_cast<std::size_t>(std::lround(x * span)) % levels.size()]; }};
  }
  constexpr double kTurn = 2.0 * std::numbers::pi;
  switch (oneOf(random, 12)) {
    case 0: return {"line", [](double x) { return x; }};
    case 1: return {"square", [=](double x) { return (x - p) * (x - p); }};
    case 2: return {"decay", [=](double x) { return std::exp(-x / (0.05 + 0.4 * p)); }};
    case 3: return {"wave", [=](double x) { return std::sin(kTurn * (x * (1.5 + 12.0 * p) + q)); }};
    case 4: return {"step", [=](double x) { return x > 0.15 + 0.7 * p ? 1.0 : 0.0; }};
    case 5: return {"bump", [=](double x) { return std::exp(-0.5 * std::pow((x - 0.1 - 0.8 * p) / (0.04 + 0.15 * q), 2)); }};
    case 6: return {"hinge", [=](double x) { return std::max(0.0, x - 0.2 - 0.6 * p); }};
    case 7: return {"Lorentzian", [=](double x) { return 1.0 / (1.0 + std::pow((x - p) / (0.05 + 0.2 * q), 2)); }};
    case 8: return {"two tanh", [=](double x) { return std::tanh(8.0 * (x - p)) * std::tanh(3.0 * (x - q)); }};
    case 9: return {"chirp", [=](double x) { return std::sin(kTurn * (x * x * (2.0 + 3.0 * p) + q)); }};
    case 10: return {"triangle", [=](double x) { return std::abs(std::fmod(x * (2.0 + 6.0 * p) + q, 1.0) - 0.5); }};
    default: return {"corner", [=](double x) { return std::abs(x - 0.2 - 0.6 * p); }};
  }
}

struct Hidden {
  std::string name;
  std::set<std::string> columns;
  std::vector<std::pair<std::size_t, Shape>> factors;

  [[nodiscard]] std::vector<double> over(const Rows& rows) const {
    std::vector<double> values(rows[0].size(), 1.0);
    for (const auto& [c, shape] : factors)
      for (std::size_t i = 0; i < values.size(); ++i) values[i] *= shape.at((rows[c][i] - kColumns[c].low) / (kColumns[c].high - kColumns[c].low));
    return values;
  }
};
Hidden drawHidden(Random& random) {
  Hidden hidden;
  const std::size_t count = oneOf(random, 4) == 0 ? 2 : 1;
  while (hidden.factors.size() < count) {
    const std::size_t c = oneOf(random, kColumns.size());
    if (!hidden.columns.insert(kColumns[c].header).second) continue;
    hidden.factors.emplace_back(c, drawShape(random, kColumns[c]));
    hidden.name += (hidden.name.empty() ? "" : " × ") + hidden.factors.back().second.name + "(" + kColumns[c].header + ")";
  }
  return hidden;
}

double meanOf(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double v : values) sum += v;
  return sum / static_cast<double>(values.size());
}
double energyOf(const std::vector<double>& values) {
  const double mean = meanOf(values);
  double sum = 0.0;
  for (const double v : values) sum += (v - mean) * (v - mean);
  return sum;
}
double quantile(std::vector<double> values, double share) {
  std::ranges::sort(values);
  return values.empty() ? NAN : values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

// ---- The benches ---------------------------------------------------------------------------------------------------

int nulls(int count, std::uint64_t seed) {
  int all = 0;
  for (std::size_t k = 0; k < kNoise.size(); ++k) {
    int found = 0;
    for (int s = 0; s < count; ++s) {
      Random random{seed * 1'000'003 + k * 10'007 + static_cast<std::uint64_t>(s)};
      const Rows rows = drawRows(random, 400);
      const auto d = loop::discover(readingsOf(rows, drawNoise(random, kNoise[k], rows)), {.seed = static_cast<std::uint64_t>(s) + 1});
      if (!d) return fmt::print("{}\n", d.error().message), 1;
      found += d->mean.effects.empty() ? 0 : 1;
      for (const loop::Effect& effect : d->mean.effects) fmt::print("    seed {}: {} over {}\n", s, effect.shape.name(), effect.shape.covariates.front());
    }
    fmt::print("{:<24} something found in {} of {}\n", kNoise[k].name, found, count);
    std::fflush(stdout);
    all += found;
  }
  fmt::print("seed {}: {} of {} tables with nothing in them ({:.2f} %; at α = 0.01 one in a hundred is allowed)\n", seed, all, 10 * count, 10.0 * all / count);
  return 0;
}

int effects(int count, double lambda, std::uint64_t seed) {
  int detected = 0, right = 0, runs = 0;
  std::vector<double> removed;
  for (int s = 0; s < count; ++s) {
    Random random{seed * 7'919 + static_cast<std::uint64_t>(s)};
    const Hidden hidden = drawHidden(random);
    const Rows rows = drawRows(random, 400);
    const std::vector<double> shape = hidden.over(rows);
    const double energy = energyOf(shape);
    if (energy < 1e-9) continue;
    const double amplitude = kSigma * std::sqrt(lambda / energy);
    std::vector<double> error = drawNoise(random, kNoise[s % 3 == 1 ? 3 : 0], rows);
    for (std::size_t i = 0; i < error.size(); ++i) error[i] += 5.0 + amplitude * shape[i];
    const auto d = loop::discover(readingsOf(rows, error), {.seed = static_cast<std::uint64_t>(s) + 1});
    if (!d) return fmt::print("{}\n", d.error().message), 1;
    std::set<std::string> told;
    for (const loop::Effect& effect : d->mean.effects) told.insert(effect.shape.covariates.begin(), effect.shape.covariates.end());
    // Rows drawn anew; the model as its file says it.
    const Rows fresh = drawRows(random, 1000);
    std::vector<double> truth = hidden.over(fresh);
    for (double& t : truth) t *= amplitude;
    const auto model = loop::parseModel(loop::toToml(d->model), "model.toml");
    if (!model) return fmt::print("{}\n", model.error().message), 1;
    const auto evidence = loop::evidenceOf(readingsOf(fresh, truth)).evidence;
    const Eigen::VectorXd predicted = loop::predicted(evidence, loop::termsOf(*model));
    std::vector<double> left;
    for (std::size_t i = 0; i < truth.size(); ++i) left.push_back(truth[i] - predicted[static_cast<Eigen::Index>(i)]);
    ++runs, detected += d->mean.effects.empty() ? 0 : 1, right += told == hidden.columns;
    removed.push_back(1.0 - energyOf(left) / energyOf(truth));
    if (told != hidden.columns || removed.back() < 0.75) {
      std::string what;
      for (const loop::Effect& effect : d->mean.effects) what += fmt::format(" {}({})", effect.shape.name(), fmt::join(effect.shape.covariates, ", "));
      fmt::print("    {:>3} {}: removed {:.2f}{}, told{}\n", s, hidden.name, removed.back(), told == hidden.columns ? "" : ", other columns", what.empty() ? " nothing" : what);
      std::fflush(stdout);
    }
  }
  fmt::print("seed {}, lambda {}: {} tables; detected {:.3f}, columns right {:.3f}; removed at fresh rows: median {:.3f}, worst tenth {:.3f}\n", seed, lambda, runs,
             static_cast<double>(detected) / runs, static_cast<double>(right) / runs, quantile(removed, 0.5), quantile(removed, 0.1));
  return 0;
}

/// A law whose numbers are known: what intervals are held against.
struct Law {
  std::string family;  ///< of the grammar
  std::size_t column;
  Function at;         ///< of the column's value
  std::vector<std::pair<std::string, double>> numbers;  ///< by their names in the answer
};
Law drawLaw(Random& random) {
  constexpr double kTurn = 2.0 * std::numbers::pi;
  const std::size_t c = std::array<std::size_t, 4>{0, 1, 2, 3}[oneOf(random, 4)];
  const Drawn& column = kColumns[c];
  const double span = column.high - column.low, p = between(random, 0.0, 1.0), q = between(random, 0.0, 1.0);
  switch (oneOf(random, 4)) {
    case 0: return {"straight line", c, [](double x) { return x; }, {{column.header, 1.0}}};
    case 1: {
      const double length = span / (1.7 + 8.0 * p);
      return {"wave", c, [=](double x) { return std::sin(kTurn * (x / length + q)); }, {{"wavelength", length}}};
    }
    case 2: {
      const double constant = span * (0.08 + 0.3 * p);
      return {"decay", c, [=](double x) { return std::exp(-x / constant); }, {{"constant of the decay", constant}}};
    }
    default: {
      const double place = column.low + span * (0.2 + 0.6 * p), width = span * (0.05 + 0.1 * q);
      return {"bump", c, [=](double x) { return std::exp(-0.5 * std::pow((x - place) / width, 2)); }, {{"place", place}, {"width", width}}};
    }
  }
}

/// How many intervals hold what they should.
struct Held {
  int in = 0, all = 0;
  void add(double value, double low, double high) { in += value >= low && value <= high ? 1 : 0, ++all; }
  [[nodiscard]] std::string text() const { return fmt::format("{} of {} ({:.1f} %)", in, all, 100.0 * in / std::max(1, all)); }
};

int coverage(int count, std::uint64_t seed) {
  const std::array<std::size_t, 4> kinds{0, 3, 4, 2};  // white, heavy tails, growing with the range, AR(0.6)
  std::array<Held, 4> shares{}, numbers{};
  Held all_shares, all_numbers;
  int other = 0;
  for (int s = 0; s < count; ++s) {
    Random random{seed * 15'485'863 + static_cast<std::uint64_t>(s)};
    const Law law = drawLaw(random);
    const Rows rows = drawRows(random, 300), fresh = drawRows(random, 4000);
    const auto over = [&](const Rows& of) {
      std::vector<double> values;
      for (const double x : of[law.column]) values.push_back(law.at(x));
      return values;
    };
    const std::size_t kind = static_cast<std::size_t>(s) % kinds.size();
    std::vector<double> shape = over(rows), error = drawNoise(random, kNoise[kinds[kind]], rows), truth = over(fresh);
    const double amplitude = kSigma * std::sqrt(between(random, 150.0, 900.0) / energyOf(shape));
    for (std::size_t i = 0; i < error.size(); ++i) error[i] += 5.0 + amplitude * shape[i];
    for (double& t : truth) t = 5.0 + amplitude * t;
    const auto d = loop::discover(readingsOf(rows, error), {.seed = static_cast<std::uint64_t>(s) + 1});
    if (!d) return fmt::print("{}\n", d.error().message), 1;
    if (d->removed.is_known) {
      const Eigen::VectorXd predicted = loop::predicted(loop::evidenceOf(readingsOf(fresh, truth)).evidence, loop::termsOf(d->model));
      double left = 0.0;
      for (std::size_t i = 0; i < truth.size(); ++i) left += std::pow(truth[i] - predicted[static_cast<Eigen::Index>(i)], 2);
      const double share = 1.0 - left / energyOf(truth);
      shares[kind].add(share, d->removed.low, d->removed.high), all_shares.add(share, d->removed.low, d->removed.high);
    }
    const bool is_law = d->mean.effects.size() == 1 && d->mean.effects[0].shape.name() == law.family &&
                        d->mean.effects[0].shape.covariates == std::vector<std::string>{kColumns[law.column].header};
    other += is_law ? 0 : 1;
    for (const auto& [name, value] : law.numbers)
      for (const loop::Number& number : is_law ? d->numbers[0] : std::vector<loop::Number>{})
        if (number.name == name) {
          const double is = number.is_coefficient ? amplitude * value : value;
          numbers[kind].add(is, number.value - number.half(), number.value + number.half());
          all_numbers.add(is, number.value - number.half(), number.value + number.half());
        }
  }
  for (std::size_t k = 0; k < kinds.size(); ++k)
    fmt::print("{:<24} removed shares {:<24} numbers {}\n", kNoise[kinds[k]].name, shares[k].text(), numbers[k].text());
  fmt::print("seed {}: {} tables; 95 % intervals hold removed shares in {}, numbers in {}; of {} tables another shape was told\n", seed, count, all_shares.text(),
             all_numbers.text(), other);
  return 0;
}

int speed() {
  struct Size {
    std::size_t rows, columns;
    double bar_s;
  };
  for (const Size size : {Size{400, 6, 1.0}, Size{40'000, 10, 15.0}, Size{76'000, 8, 30.0}}) {
    Random random{5};
    const Rows rows = drawRows(random, size.rows);
    std::vector<double> error = drawNoise(random, kNoise[0], rows);
    for (std::size_t i = 0; i < error.size(); ++i) error[i] += 0.01 * rows[0][i] + 3.0 * std::sin(rows[0][i] / 80.0) + (std::fmod(rows[4][i], 8.0) == 3.0 ? 5.0 : 0.0);
    table::Readings readings = readingsOf(rows, error);
    // Measured, reference and the rest make up the columns; what is missing is noise.
    readings.covariates.resize(std::min(readings.covariates.size(), size.columns - 2));
    while (readings.covariates.size() + 2 < size.columns) {
      table::Column column{.header = fmt::format("other_{}", readings.covariates.size())};
      for (std::size_t i = 0; i < size.rows; ++i) column.values.push_back(normal(random));
      readings.covariates.push_back(std::move(column));
    }
    const auto start = std::chrono::steady_clock::now();
    const auto d = loop::discover(std::move(readings), {});
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    fmt::print("{} rows × {} columns: {:.2f} s, bar {:.0f} s, {}; {} effects\n", size.rows, size.columns, seconds, size.bar_s, seconds <= size.bar_s ? "met" : "missed",
               d ? d->mean.effects.size() : 0);
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  const std::string what = argc > 1 ? argv[1] : "";
  const int count = argc > 2 ? std::atoi(argv[2]) : 20;
  const auto seedAt = [&](int i) { return argc > i ? std::strtoull(argv[i], nullptr, 10) : 1ULL; };
  if (what == "nulls" && count > 0) return nulls(count, seedAt(3));
  if (what == "effects" && count > 0) return effects(count, argc > 3 ? std::atof(argv[3]) : 600.0, seedAt(4));
  if (what == "coverage" && count > 0) return coverage(count, seedAt(3));
  if (what == "speed") return speed();
  fmt::print("usage: loop_bench nulls COUNT [seed] | effects COUNT [lambda] [seed] | coverage COUNT [seed] | speed\n");
  return 2;
}
