// SPDX-License-Identifier: Apache-2.0
#include "tools/validate/held_out.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include <fmt/format.h>

#include "calib/compare/report.h"

namespace toftwin::validate {

using compare::Running;
using compare::shown;
using compare::summarise;

namespace {

using SquareMatrix = std::vector<std::vector<double>>;

/// Solves the symmetric positive system a x = b by Cholesky's factors.
std::vector<double> solvePositive(SquareMatrix a, std::vector<double> b) {
  const std::size_t n = b.size();
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      double sum = a[i][j];
      for (std::size_t k = 0; k < j; ++k) sum -= a[i][k] * a[j][k];
      a[i][j] = i == j ? std::sqrt(std::max(sum, std::numeric_limits<double>::min())) : sum / a[j][j];
    }
  }
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t k = 0; k < i; ++k) b[i] -= a[i][k] * b[k];
    b[i] /= a[i][i];
  }
  for (std::size_t i = n; i-- > 0;) {
    for (std::size_t k = i + 1; k < n; ++k) b[i] -= a[k][i] * b[k];
    b[i] /= a[i][i];
  }
  return b;
}

/// Least squares over the rows that `uses` accepts.
std::vector<double> solveRows(std::span<const double> y, std::span<const Term> terms,
                              const std::function<bool(std::size_t)>& uses) {
  const std::size_t n = terms.size();
  SquareMatrix normal(n, std::vector<double>(n));
  std::vector<double> right(n);
  for (std::size_t row = 0; row < y.size(); ++row) {
    if (!uses(row)) continue;
    for (std::size_t i = 0; i < n; ++i) {
      right[i] += terms[i].column[row] * y[row];
      for (std::size_t j = 0; j < n; ++j) normal[i][j] += terms[i].column[row] * terms[j].column[row];
    }
  }
  for (std::size_t i = 0; i < n; ++i) normal[i][i] *= 1.0 + 1e-9;
  return n == 0 ? std::vector<double>{} : solvePositive(std::move(normal), std::move(right));
}

std::vector<double> evaluate(std::span<const Term> terms, const std::vector<double>& value,
                             std::size_t rows) {
  std::vector<double> sum(rows);
  for (std::size_t i = 0; i < terms.size(); ++i)
    for (std::size_t row = 0; row < rows; ++row) sum[row] += value[i] * terms[i].column[row];
  return sum;
}

Blocks withoutGaps(std::span<const double> y, std::span<const Term> terms, Blocks blocks) {
  for (std::size_t row = 0; row < y.size(); ++row) {
    bool finite = std::isfinite(y[row]);
    for (const Term& term : terms) finite = finite && std::isfinite(term.column[row]);
    if (!finite) blocks[row] = -1;
  }
  return blocks;
}

std::set<int> fittedBlocks(const Blocks& blocks) {
  std::set<int> all;
  for (const int block : blocks)
    if (isFitted(block)) all.insert(block);
  return all;
}

/// √Σ (θ₋ᵢ − θ̄)² (n − 1)/n over the left-out blocks.
std::vector<double> jackknife(const std::vector<std::vector<double>>& left_out, std::size_t numbers) {
  std::vector<double> error(numbers, std::nan(""));
  if (left_out.size() < 2) return error;
  const auto n = static_cast<double>(left_out.size());
  for (std::size_t i = 0; i < numbers; ++i) {
    Running values;
    for (const auto& one : left_out) values.add(one[i]);
    error[i] = (n - 1.0) / std::sqrt(n) * std::sqrt(values.variance());
  }
  return error;
}

template <class Fit>
void judge(Fit& fit, std::span<const double> y, const Blocks& blocks) {
  double fitted = 0.0, judged = 0.0;
  for (std::size_t row = 0; row < y.size(); ++row) {
    const double left = y[row] - fit.prediction[row];
    if (isFitted(blocks[row])) fitted += left * left, ++fit.fitted_n;
    if (isJudged(blocks[row])) judged += left * left, ++fit.judged_n;
  }
  fit.fitted_rms = std::sqrt(fitted / static_cast<double>(fit.fitted_n));
  fit.judged_rms = std::sqrt(judged / static_cast<double>(fit.judged_n));
}

/// Cross-validated root mean square within the fitted half.
double crossValidated(std::span<const double> y, std::span<const Term> terms, const Blocks& blocks) {
  double sum = 0.0;
  std::size_t n = 0;
  for (int fold = 0; fold < 4; ++fold) {
    const auto isLeftOut = [&](std::size_t row) { return (blocks[row] / 2) % 4 == fold; };
    const auto value =
        solveRows(y, terms, [&](std::size_t row) { return isFitted(blocks[row]) && !isLeftOut(row); });
    const auto prediction = evaluate(terms, value, y.size());
    for (std::size_t row = 0; row < y.size(); ++row) {
      if (!isFitted(blocks[row]) || !isLeftOut(row)) continue;
      sum += (y[row] - prediction[row]) * (y[row] - prediction[row]), ++n;
    }
  }
  return std::sqrt(sum / static_cast<double>(std::max<std::size_t>(n, 1)));
}

/// Gauss-Newton with numeric derivatives and Levenberg's damping, inside the bounds.
std::vector<double> minimise(std::span<const double> y, std::span<const Bounded> numbers,
                             const Predict& predict, std::vector<double> value,
                             const std::function<bool(std::size_t)>& uses) {
  const auto squares = [&](const std::vector<double>& prediction) {
    double sum = 0.0;
    for (std::size_t row = 0; row < y.size(); ++row)
      if (uses(row)) sum += (y[row] - prediction[row]) * (y[row] - prediction[row]);
    return sum;
  };
  std::vector<double> prediction = predict(value);
  double best = squares(prediction), damping = 1e-3;
  for (int iteration = 0; iteration < 60 && damping < 1e9; ++iteration) {
    std::vector<Term> slopes;
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      const double span = numbers[i].high - numbers[i].low;
      const double step = value[i] + 1e-4 * span > numbers[i].high ? -1e-4 * span : 1e-4 * span;
      std::vector<double> moved = value;
      moved[i] += step;
      Term slope{"", predict(moved)};
      for (std::size_t row = 0; row < y.size(); ++row)
        slope.column[row] = (slope.column[row] - prediction[row]) / step;
      slopes.push_back(std::move(slope));
    }
    SquareMatrix normal(numbers.size(), std::vector<double>(numbers.size()));
    std::vector<double> right(numbers.size());
    for (std::size_t row = 0; row < y.size(); ++row) {
      if (!uses(row)) continue;
      for (std::size_t i = 0; i < numbers.size(); ++i) {
        right[i] += slopes[i].column[row] * (y[row] - prediction[row]);
        for (std::size_t j = 0; j < numbers.size(); ++j)
          normal[i][j] += slopes[i].column[row] * slopes[j].column[row];
      }
    }
    for (std::size_t i = 0; i < numbers.size(); ++i) normal[i][i] = normal[i][i] * (1.0 + damping) + 1e-12;
    const std::vector<double> step = solvePositive(normal, right);
    std::vector<double> next = value;
    for (std::size_t i = 0; i < numbers.size(); ++i)
      next[i] = std::clamp(value[i] + step[i], numbers[i].low, numbers[i].high);
    std::vector<double> there = predict(next);
    const double sum = squares(there);
    if (sum < best) {
      const bool is_done = best - sum < 1e-12 * best;
      value = std::move(next), prediction = std::move(there), best = sum, damping *= 0.3;
      if (is_done) break;
    } else {
      damping *= 10.0;
    }
  }
  return value;
}

}  // namespace

Blocks blocksOfRows(std::size_t rows, std::size_t size) {
  Blocks blocks;
  for (std::size_t row = 0; row < rows; ++row) blocks.push_back(static_cast<int>(row / size));
  return blocks;
}

Blocks blocksAlong(std::span<const double> x, double size) {
  Blocks blocks;
  for (const double value : x)
    blocks.push_back(std::isfinite(value) ? static_cast<int>(std::floor(value / size)) : -1);
  return blocks;
}

double judgedRms(std::span<const double> y, std::span<const double> prediction, const Blocks& blocks) {
  std::vector<double> left;
  for (std::size_t row = 0; row < y.size(); ++row)
    if (isJudged(blocks[row]) && std::isfinite(y[row] - prediction[row]))
      left.push_back(y[row] - prediction[row]);
  return summarise(left).rms;
}

LinearFit fitLinear(std::span<const double> y, std::span<const Term> terms, const Blocks& all) {
  const Blocks blocks = withoutGaps(y, terms, all);
  LinearFit fit;
  fit.value = solveRows(y, terms, [&](std::size_t row) { return isFitted(blocks[row]); });
  fit.prediction = evaluate(terms, fit.value, y.size());
  std::vector<std::vector<double>> left_out;
  for (const int block : fittedBlocks(blocks)) {
    left_out.push_back(
        solveRows(y, terms, [&](std::size_t row) { return isFitted(blocks[row]) && blocks[row] != block; }));
  }
  fit.error = jackknife(left_out, terms.size());
  judge(fit, y, blocks);
  return fit;
}

std::vector<std::size_t> chooseGroups(std::span<const double> y, const std::vector<Term>& always,
                                      const std::vector<std::vector<Term>>& groups, const Blocks& all,
                                      std::size_t at_most) {
  const Blocks blocks = withoutGaps(y, always, all);
  std::vector<std::size_t> chosen;
  std::vector<Term> terms = always;
  double now = crossValidated(y, terms, blocks);
  while (chosen.size() < at_most) {
    double best = 0.98 * now;
    std::size_t which = groups.size();
    for (std::size_t g = 0; g < groups.size(); ++g) {
      if (std::find(chosen.begin(), chosen.end(), g) != chosen.end()) continue;
      std::vector<Term> with = terms;
      with.insert(with.end(), groups[g].begin(), groups[g].end());
      const double rms = crossValidated(y, with, blocks);
      if (rms < best) best = rms, which = g;
    }
    if (which == groups.size()) break;
    chosen.push_back(which), now = best;
    terms.insert(terms.end(), groups[which].begin(), groups[which].end());
  }
  return chosen;
}

CurveFit fitCurve(std::span<const double> y, std::span<const Bounded> numbers, const Predict& predict,
                  const Blocks& all) {
  std::vector<double> start;
  for (const Bounded& number : numbers) start.push_back(number.start);
  const std::vector<Term> anywhere{{"", predict(start)}};
  const Blocks blocks = withoutGaps(y, anywhere, all);
  CurveFit fit;
  fit.value = minimise(y, numbers, predict, start, [&](std::size_t row) { return isFitted(blocks[row]); });
  fit.prediction = predict(fit.value);
  std::vector<std::vector<double>> left_out;
  const std::set<int> fitted = fittedBlocks(blocks);
  for (const int block : fitted) {
    if (fitted.size() < 2) break;  // nothing would be left to fit, and no error to tell
    left_out.push_back(minimise(y, numbers, predict, fit.value, [&](std::size_t row) {
      return isFitted(blocks[row]) && blocks[row] != block;
    }));
  }
  fit.error = jackknife(left_out, numbers.size());
  judge(fit, y, blocks);
  return fit;
}

std::string shownFitted(double value, double error, int decimals) {
  return fmt::format("{} ± {}", shown(value, decimals), shown(error, decimals));
}

}  // namespace toftwin::validate
