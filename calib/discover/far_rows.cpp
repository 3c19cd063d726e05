// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/far_rows.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "calib/discover/candidates.h"
#include "calib/discover/marginal.h"
#include "calib/discover/table_source.h"

namespace toftwin::discover {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kFarDeviations = 20.0, kOddDeviations = 5.0, kGap = 6.0, kMostFarShare = 0.03;

double middleMagnitude(const VectorXd& values) {
  std::vector<double> magnitudes(values.begin(), values.end());
  for (double& v : magnitudes) v = std::abs(v);
  const auto middle = magnitudes.begin() + static_cast<std::ptrdiff_t>(magnitudes.size() / 2);
  std::ranges::nth_element(magnitudes, middle);
  return middle == magnitudes.end() ? 0.0 : *middle;
}

/// Columns of length 1: gain, sessions and hats over each covariate, as long as eight rows are left for each.
MatrixXd slowCourse(const TableData& data) {
  constexpr std::size_t kKnots = 5, kMostSessions = 20;
  const auto n = static_cast<Index>(data.rows()), most = n / 8;
  std::vector<MatrixXd> parts{MatrixXd::Ones(n, 1)};
  Index count = 1;
  const auto add = [&](MatrixXd columns) {
    if (columns.cols() == 0 || count + columns.cols() > most) return;
    count += columns.cols();
    parts.push_back(std::move(columns));
  };
  if (!data.reference.empty()) {
    const VectorXd reference = Eigen::Map<const VectorXd>(data.reference.data(), n);
    add(reference.array() - reference.mean());
  }
  if (const std::size_t sessions = data.session_names.size(); sessions > 1 && sessions <= kMostSessions) {
    MatrixXd of_session = MatrixXd::Zero(n, static_cast<Index>(sessions));
    for (Index i = 0; i < n; ++i) of_session(i, data.session[static_cast<std::size_t>(i)]) = 1.0;
    add(std::move(of_session));
  }
  for (const CovariateInfo& info : infosOf(data)) add(columnsOf(data, smoothIn(info, kKnots).terms));
  MatrixXd all(n, count);
  Index next = 0;
  for (const MatrixXd& part : parts) all.middleCols(next, part.cols()) = part, next += part.cols();
  for (Index k = 0; k < count; ++k) all.col(k) /= std::max(all.col(k).norm(), 1e-300);
  return all;
}

/// What rows err by beside a fit.
struct RowErrors {
  VectorXd left;           ///< in units of `deviation`, and of each row's `relative` one
  double deviation = 0.0;  ///< robust
};

/// Of a fit that outliers hardly move: Huber's weights beyond 1.5 deviations, by iterated least squares.
RowErrors robustlyLeft(const MatrixXd& x, const VectorXd& y, const VectorXd& relative, double smallest) {
  constexpr int kRounds = 12;
  constexpr double kBend = 1.5, kNormal = 1.4826;
  const MatrixXd rows = relative.cwiseInverse().asDiagonal() * x;
  const VectorXd value = y.cwiseQuotient(relative);
  VectorXd weight = VectorXd::Ones(y.size());
  RowErrors out;
  for (int round = 0; round < kRounds; ++round) {
    const MatrixXd weighted = weight.asDiagonal() * rows;
    const MatrixXd inverse = pseudoInverse(rows.transpose() * weighted, 1e-10).inverse;
    out.left = value - rows * (inverse * (weighted.transpose() * value));
    out.deviation = std::max(kNormal * middleMagnitude(out.left), smallest);
    weight = out.left.unaryExpr(
        [&](double v) { return std::min(1.0, kBend * out.deviation / std::max(std::abs(v), 1e-300)); });
  }
  out.left /= out.deviation;
  return out;
}

/// An order in which neighbours may err alike.
struct Order {
  std::vector<double> value, sorted;
  explicit Order(std::vector<double> values) : value(std::move(values)), sorted(value) { std::ranges::sort(sorted); }
  /// How many rows are as near to row i as row j is, to both sides, without i.
  [[nodiscard]] double within(std::size_t i, std::size_t j) const {
    const auto [low, high] = std::ranges::equal_range(sorted, value[i]);
    const auto [low_j, high_j] = std::ranges::equal_range(sorted, value[j]);
    const auto reach = std::max<std::ptrdiff_t>({low - low_j, high_j - high, 0});
    const auto before = std::min(reach, low - sorted.begin()), after = std::min(reach, sorted.end() - high);
    return static_cast<double>(before + (high - low) + after - 1);
  }
};

std::vector<Order> ordersOf(const TableData& data) {
  std::vector<Order> orders;
  for (const TableCovariate& covariate : data.covariates) orders.emplace_back(covariate.values);
  orders.emplace_back(std::vector<double>(data.line.begin(), data.line.end()));
  if (!data.reference.empty()) orders.emplace_back(data.reference);
  if (data.session_names.size() > 1) orders.emplace_back(std::vector<double>(data.session.begin(), data.session.end()));
  if (!data.capture.empty()) orders.emplace_back(std::vector<double>(data.capture.begin(), data.capture.end()));
  return orders;
}

/// Whether so many of the odd rows, which are in this order, stand so near to the one at `place` as chance would have
/// once in a thousand: k of them where λ are expected come by chance with a probability below λᵏ/k!.
bool standsTogether(const Order& order, const std::vector<std::size_t>& odd, std::size_t place) {
  constexpr double kChance = 1e-3;
  constexpr std::size_t kMostNeighbours = 20;
  std::vector<double> within;
  const std::size_t begin = place - std::min(place, kMostNeighbours);
  for (std::size_t k = begin; k < std::min(odd.size(), place + kMostNeighbours + 1); ++k)
    if (k != place) within.push_back(order.within(odd[place], odd[k]));
  std::ranges::sort(within);
  const double share = static_cast<double>(odd.size() - 1) / static_cast<double>(order.value.size());
  for (std::size_t k = 1; k <= std::min(within.size(), kMostNeighbours); ++k) {
    const auto count = static_cast<double>(k);
    if (std::pow(share * within[k - 1], count) / std::tgamma(count + 1.0) < kChance) return true;
  }
  return false;
}

/// The odd rows but for those that are far together with neighbours, the farthest first.
std::vector<std::size_t> strewn(const TableData& data, const VectorXd& left) {
  const auto at = [&](std::size_t i) { return left(static_cast<Index>(i)); };
  std::array<std::vector<std::size_t>, 2> sides;
  for (std::size_t i = 0; i < data.rows(); ++i)
    if (std::abs(at(i)) > kOddDeviations) sides[at(i) > 0.0 ? 1 : 0].push_back(i);
  std::vector<bool> is_together(data.rows(), false);
  for (const Order& order : ordersOf(data)) {
    for (auto& odd : sides) {
      std::ranges::sort(odd, {}, [&](std::size_t i) { return order.value[i]; });
      for (std::size_t place = 0; place < odd.size(); ++place)
        if (std::abs(at(odd[place])) >= kFarDeviations && standsTogether(order, odd, place))
          is_together[odd[place]] = true;
    }
  }
  std::vector<std::size_t> alone;
  for (const auto& odd : sides)
    std::ranges::copy_if(odd, std::back_inserter(alone), [&](std::size_t i) { return !is_together[i]; });
  std::ranges::sort(alone, std::ranges::greater{}, [&](std::size_t i) { return std::abs(at(i)); });
  return alone;
}

/// How many of them are far, with a gap to the next.
std::size_t beforeTheGap(const std::vector<std::size_t>& alone, const VectorXd& left) {
  const auto size = [&](std::size_t k) {
    return k < alone.size() ? std::abs(left(static_cast<Index>(alone[k]))) : 0.0;
  };
  const auto share = static_cast<std::size_t>(kMostFarShare * static_cast<double>(left.size()));
  std::size_t count = 0;
  for (std::size_t k = 1; k <= std::max<std::size_t>(1, share) && size(k - 1) >= kFarDeviations; ++k)
    if (size(k - 1) >= kGap * size(k)) count = k;
  return count;
}

/// Of rounded errors the step: below it nothing is known of how rows err.
double smallestStep(std::vector<double> values) {
  std::ranges::sort(values);
  const double rounding = 1e-9 * std::max(std::abs(values.front()), std::abs(values.back()));
  double step = values.back() - values.front();
  for (std::size_t i = 1; i < values.size(); ++i)
    if (const double here = values[i] - values[i - 1]; here > rounding) step = std::min(step, here);
  return step;
}

std::string farInWords(const TableData& data, const std::vector<std::size_t>& rows, const std::vector<double>& by) {
  constexpr std::size_t kNamed = 8;
  std::string words;
  for (std::size_t k = 0; k < std::min(rows.size(), kNamed); ++k) {
    words += fmt::format("{}line {} by {:.4g}{}{}", k == 0 ? "" : ", ", data.line[rows[k]], by[k],
                         data.unit.empty() ? "" : " ", data.unit);
  }
  if (rows.size() > kNamed) words += fmt::format(" and {} more", rows.size() - kNamed);
  return fmt::format("{} far from all others, set aside as gross errors (flying pixels, wraps, slips): {}",
                     rows.size() == 1 ? "1 row is" : fmt::format("{} rows are", rows.size()), words);
}

/// What the rows err by beside their slow course; nothing where they are too few or never differ.
std::optional<RowErrors> errorsOf(const TableData& data, const VectorXd& relative) {
  constexpr std::size_t kFewest = 20;
  constexpr double kRoundingShare = 0.3;  // 1/√12: the deviation of a step
  if (data.rows() < kFewest) return std::nullopt;
  const double step = smallestStep(data.error);
  if (!(step > 0.0)) return std::nullopt;
  const VectorXd error = Eigen::Map<const VectorXd>(data.error.data(), relative.size());
  return robustlyLeft(slowCourse(data), error, relative, kRoundingShare * step);
}

VectorXd relativeSigma(const TableData& data) {
  const auto n = static_cast<Index>(data.rows());
  if (data.sigma.empty()) return VectorXd::Ones(n);
  const VectorXd sigma = Eigen::Map<const VectorXd>(data.sigma.data(), n);
  return sigma / middleMagnitude(sigma);
}

}  // namespace

void setFarAside(TableData& data) {
  std::vector<bool> is_open = data.locked;
  is_open.flip();
  const TableData open = rowsOf(data, is_open);
  const VectorXd relative = relativeSigma(open);
  const auto errors = errorsOf(open, relative);
  if (!errors) return;
  std::vector<std::size_t> far = strewn(open, errors->left);
  far.resize(beforeTheGap(far, errors->left));
  if (far.empty()) return;
  std::vector<double> by;
  std::vector<bool> is_kept(data.rows(), true);
  for (const std::size_t i : far) {
    const auto row = static_cast<Index>(i);
    by.push_back(errors->left(row) * errors->deviation * relative(row));
    is_kept[static_cast<std::size_t>(std::ranges::find(data.line, open.line[i]) - data.line.begin())] = false;
  }
  data.doubts.push_back(farInWords(open, far, by));
  data = rowsOf(data, is_kept);
}

}  // namespace toftwin::discover
