// SPDX-License-Identifier: Apache-2.0
// What `toftwin discover` finds in tables with hidden effects, by strength. λ is the noncentrality of the
// hidden effect after the nuisances. Usage: discover_bench [seeds] [loud|nulls]
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <vector>

#include <fmt/format.h>

#include "calib/discover/find_in_table.h"
#include "calib/discover/table_source.h"
#include "tests/discover/planted.h"

namespace {

using namespace toftwin::discover;
using Seconds = std::chrono::duration<double>;

struct Score {
  int runs = 0, detected = 0, named = 0, spurious = 0, offered = 0;
  std::vector<double> removed;
};

/// Share of the hidden effect's energy that the found ones remove, offset and gain aside.
double removedOf(const TableSource& source, const Finding& finding, const Planted& planted) {
  Eigen::VectorXd found = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(planted.effect_mm.size()));
  for (const Effect& effect : finding.effects) {
    const auto columns = columnsOf(source.data(), termsOf(effect));
    for (Eigen::Index t = 0; t < columns.cols(); ++t)
      found += effect.coefficient[static_cast<std::size_t>(t)] * columns.col(t);
  }
  const Eigen::VectorXd hidden = Eigen::Map<const Eigen::VectorXd>(planted.effect_mm.data(), found.size());
  Eigen::MatrixXd x(found.size(), 0);
  for (const auto& [group, columns] : source.nuisanceColumns(source.data())) {
    x.conservativeResize(Eigen::NoChange, x.cols() + columns.cols());
    x.rightCols(columns.cols()) = columns;
  }
  const auto solver = x.completeOrthogonalDecomposition();
  const auto left = [&](const Eigen::VectorXd& y) { return (y - x * solver.solve(y)).eval(); };
  return 1.0 - left(hidden - found).squaredNorm() / left(hidden).squaredNorm();
}

/// Many sessions with two headers that could name them: what is understood of the file decides.
bool isReadAnew(const Errors& errors) { return errors.sessions > 4; }
TableData readAnew(const TableData& data) {
  TableMap map;
  map.reference = data.reference_name;
  const auto csv = parseCsv(csvOf(data, true), "planted.csv");
  if (!csv) throw std::runtime_error{csv.error().message};
  auto read = readTable(*csv, map, "planted.csv");
  if (!read) throw std::runtime_error{read.error().message};
  return *std::move(read);
}

void run(const std::vector<Hidden>& hidden, double lambda, std::uint64_t seed, const Errors& errors,
         Score& score, bool is_loud) {
  const Planted planted = plant(seed, hidden, lambda, errors);
  TableSource source{isReadAnew(errors) ? readAnew(planted.data) : planted.data, true};
  const Finding finding = findInTable(source, {.seed = seed});
  ++score.runs;
  score.detected += !finding.effects.empty();
  int right = 0;
  bool is_offered = false;
  for (const Hidden one : hidden) {
    const auto names = covariatesOf(one);
    right += std::ranges::any_of(finding.effects, [&](const Effect& e) { return e.covariates == names; });
    for (const Effect& e : finding.effects) {
      is_offered |= e.covariates == names;
      for (const auto& a : e.alternatives) is_offered |= a.covariates == names;
    }
  }
  const bool is_named = hidden[0] != Hidden::Nothing && right == static_cast<int>(hidden.size());
  score.named += is_named, score.offered += is_offered;
  score.spurious +=
      std::max(0, static_cast<int>(finding.effects.size()) - (hidden[0] == Hidden::Nothing ? 0 : right));
  if (hidden[0] != Hidden::Nothing) score.removed.push_back(removedOf(source, finding, planted));
  if (!is_loud) return;
  std::string words;
  for (const Effect& e : finding.effects)
    words += fmt::format(" [{} p={:.4f} f={:.2f} gain {:.0f}±{:.0f}]", e.name, e.p, e.frequency, e.gain.mean,
                         e.gain.error);
  fmt::print("   seed {}: p {:.4f}{}\n", seed, finding.first_p, words);
}

/// How often the 95 % interval of a time constant and of a place holds the truth, where the formula was
/// found.
void coverage(Hidden hidden, const char* name, double truth, double lambda, int seeds) {
  int formulas = 0, held = 0;
  for (int seed = 1; seed <= seeds; ++seed) {
    const Planted planted = plant(static_cast<std::uint64_t>(seed + 300), {hidden}, lambda);
    TableSource source{planted.data, true};
    const Finding finding = findInTable(source, {.seed = static_cast<std::uint64_t>(seed)});
    if (finding.effects.size() != 1 || finding.effects[0].name != name) continue;
    const Estimate& inner = finding.effects[0].numbers.back();
    ++formulas, held += std::abs(inner.value - truth) <= 1.96 * inner.error;
  }
  fmt::print("95 % interval of {} in \"{}\", lambda {:.0f}: holds the truth in {} of {} (of {} seeds)\n",
             truth, name, lambda, held, formulas, seeds);
}

double quantile(std::vector<double> values, double q) {
  if (values.empty()) return NAN;
  std::ranges::sort(values);
  return values[static_cast<std::size_t>(q * static_cast<double>(values.size() - 1))];
}

void row(const std::string& name, const Score& s, double seconds) {
  const auto share = [&](int n) { return static_cast<double>(n) / s.runs; };
  fmt::print("{:<34} {:>4} {:>8.3f} {:>8.3f} {:>8.3f} {:>9.3f} {:>8.2f} {:>8.2f} {:>7.2f}\n", name, s.runs,
             share(s.detected), share(s.named), share(s.offered), share(s.spurious), quantile(s.removed, 0.5),
             quantile(s.removed, 0.1), seconds / s.runs);
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  const int seeds = argc > 1 ? std::atoi(argv[1]) : 5;
  const bool is_loud = argc > 2 && std::string{argv[2]} == "loud";
  fmt::print("{:<34} {:>4} {:>8} {:>8} {:>8} {:>9} {:>8} {:>8} {:>7}\n", "tables of 400 rows", "runs",
             "detected", "named", "offered", "spurious", "removed", "worst10", "s/run");
  const bool only_nulls = argc > 2 && std::string{argv[2]} == "nulls";
  for (const int captures : only_nulls ? std::vector<int>{} : std::vector<int>{24, 44}) {
    Score score;
    const auto start = std::chrono::steady_clock::now();
    for (int seed = 1; seed <= 2 * seeds; ++seed)
      run({Hidden::AmbientTimesDistance}, 1500.0, static_cast<std::uint64_t>(seed), {.captures = captures},
          score, is_loud);
    row(fmt::format("{}, {} captures 1500", nameOf(Hidden::AmbientTimesDistance), captures), score,
        Seconds{std::chrono::steady_clock::now() - start}.count());
  }
  for (const double lambda : only_nulls ? std::vector<double>{} : std::vector<double>{150.0, 600.0, 3000.0}) {
    Score all;
    const auto begin = std::chrono::steady_clock::now();
    for (const Hidden hidden : kHidden) {
      Score score;
      const auto start = std::chrono::steady_clock::now();
      for (int seed = 1; seed <= seeds; ++seed)
        run({hidden}, lambda, static_cast<std::uint64_t>(seed), {}, score, is_loud);
      row(fmt::format("{} {:.0f}", nameOf(hidden), lambda), score,
          Seconds{std::chrono::steady_clock::now() - start}.count());
      all.runs += score.runs, all.detected += score.detected, all.named += score.named;
      all.spurious += score.spurious, all.offered += score.offered;
      all.removed.insert(all.removed.end(), score.removed.begin(), score.removed.end());
    }
    row(fmt::format("ALL {:.0f}", lambda), all, Seconds{std::chrono::steady_clock::now() - begin}.count());
  }
  for (const double lambda : only_nulls ? std::vector<double>{} : std::vector{600.0, 3000.0})
    coverage(Hidden::WarmUp, "exponential in time_s", 300.0, lambda, 6 * seeds);
  if (argc > 2 && std::string{argv[2]} == "coverage") return 0;
  const std::pair<const char*, Errors> nulls[]{
      {"nothing", {}},
      {"nothing, t4 tails", {.heavy_tails = true}},
      {"nothing, 10 rows bumped", {.bumped = true}},
      {"nothing, noise +15 %", {.sigma_mm = 1.15}},
      {"nothing, captures without a column", {.logged_mm = 1.0}},
      {"nothing, AR(1) 0.9", {.ar1_mm = 1.0}},
      {"nothing, two session headers", {.session_mm = 1.0, .sessions = 25}},
      {"nothing, 24 captures", {.captures = 24}},
      {"nothing, 44 captures", {.captures = 44}}};
  for (const auto& [name, errors] : nulls) {
    Score score;
    const auto start = std::chrono::steady_clock::now();
    for (int seed = 1; seed <= 10 * seeds; ++seed)
      run({Hidden::Nothing}, 0.0, static_cast<std::uint64_t>(seed + 5000), errors, score, is_loud);
    std::ranges::sort(score.removed);
    row(name, score, Seconds{std::chrono::steady_clock::now() - start}.count());
  }
  Score pairs;
  const auto start = std::chrono::steady_clock::now();
  for (int seed = 1; seed <= seeds; ++seed) {
    run({Hidden::WarmUp, Hidden::Wiggle}, 1500.0, static_cast<std::uint64_t>(seed), {}, pairs, is_loud);
    run({Hidden::Temperature, Hidden::InverseAmplitude}, 1500.0, static_cast<std::uint64_t>(seed), {}, pairs,
        is_loud);
    run({Hidden::Parity, Hidden::AmbientTimesDistance}, 1500.0, static_cast<std::uint64_t>(seed), {}, pairs,
        is_loud);
  }
  row("pairs 1500", pairs, Seconds{std::chrono::steady_clock::now() - start}.count());
}
