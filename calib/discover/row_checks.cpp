// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/row_checks.h"

#include <algorithm>
#include <cmath>
#include <map>

#include <Eigen/Core>
#include <fmt/format.h>

#include "calib/discover/headers.h"

namespace toftwin::discover {
namespace {

constexpr double kFar = 20.0, kMostShare = 0.4;
constexpr std::size_t kFewestInvalid = 3;

double middleOf(std::vector<double> values) {
  if (values.empty()) return 0.0;
  std::ranges::nth_element(values, values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2));
  return values[values.size() / 2];
}

struct Spread {
  double middle = 0.0, deviation = 0.0;  ///< median, and 1.4826 times the median distance from it
};
Spread robustSpread(const std::vector<double>& values) {
  Spread spread{middleOf(values), 0.0};
  std::vector<double> distance;
  for (const double v : values) distance.push_back(std::abs(v - spread.middle));
  spread.deviation = 1.4826 * middleOf(std::move(distance));
  return spread;
}

std::string withUnit(const TableData& data, double value) {
  return fmt::format("{:.6g}{}{}", value, data.unit.empty() ? "" : " ", data.unit);
}

/// Rows whose measured value is one that stays while the reference changes.
std::vector<bool> stuckRows(const TableData& data, const Spread& errors, double scale, std::string& values) {
  std::map<double, std::vector<std::size_t>> rows_of;
  for (std::size_t i = 0; i < data.rows(); ++i) {
    // Sum of a difference: equal values differ by rounding.
    const double measured = data.error[i] + scale * data.reference[i];
    const double rounded = std::round(measured / (1e-6 * std::max(errors.deviation, 1e-12)));
    if (std::abs(data.error[i] - errors.middle) > kFar * errors.deviation) rows_of[rounded].push_back(i);
  }
  std::vector<bool> is_stuck(data.rows(), false);
  for (const auto& [rounded, rows] : rows_of) {
    double low = INFINITY, high = -INFINITY;
    for (const std::size_t i : rows)
      low = std::min(low, scale * data.reference[i]), high = std::max(high, scale * data.reference[i]);
    if (rows.size() < kFewestInvalid || high - low < kFar * errors.deviation) continue;
    values +=
        (values.empty() ? "" : ", ") + withUnit(data, data.error[rows[0]] + scale * data.reference[rows[0]]);
    for (const std::size_t i : rows) is_stuck[i] = true;
  }
  return is_stuck;
}

/// c/(2f) in the unit of the error as far as the rows tell: that by which some of them are too short; 0: none
/// is.
double foldIn(const TableData& data, const Spread& errors, double scale) {
  std::vector<double> short_by, folded, others;
  for (std::size_t i = 0; i < data.rows(); ++i) {
    const bool is_short = data.error[i] < errors.middle - kFar * errors.deviation;
    if (is_short) short_by.push_back(errors.middle - data.error[i]);
    (is_short ? folded : others).push_back(scale * data.reference[i]);
  }
  const auto most = static_cast<std::size_t>(kMostShare * static_cast<double>(data.rows()));
  if (folded.size() < kFewestInvalid || folded.size() > most) return 0.0;
  const Spread length = robustSpread(short_by);
  const double slack = kFar * errors.deviation;
  const bool is_one_length =
      std::ranges::all_of(short_by, [&](double one) { return std::abs(one - length.middle) < 0.5 * slack; });
  const bool begins_there = *std::ranges::min_element(folded) > length.middle - slack &&
                            *std::ranges::max_element(others) < length.middle + slack;
  return is_one_length && begins_there ? length.middle : 0.0;
}

std::vector<bool> foldedRows(const TableData& data, const Spread& errors, double fold) {
  std::vector<bool> is_folded(data.rows(), false);
  for (std::size_t i = 0; i < data.rows() && fold > kFar * errors.deviation; ++i) {
    const double times = std::round((data.error[i] - errors.middle) / fold);
    is_folded[i] = times != 0.0 && std::abs(data.error[i] - errors.middle - times * fold) < 0.1 * fold;
  }
  return is_folded;
}

/// Sets them aside unless they are none or too many to be an exception.
std::size_t takeOut(TableData& data, std::vector<bool> which) {
  const auto count = static_cast<std::size_t>(std::ranges::count(which, true));
  if (count == 0 || static_cast<double>(count) > kMostShare * static_cast<double>(data.rows())) return 0;
  which.flip();
  data = rowsOf(data, which);
  return count;
}

}  // namespace

void setInvalidAside(TableData& data, double scale) {
  if (data.reference.size() != data.rows()) return;
  Spread errors = robustSpread(data.error);
  if (!(errors.deviation > 0.0)) return;
  std::string values;
  if (const auto count = takeOut(data, stuckRows(data, errors, scale, values)); count > 0) {
    data.doubts.push_back(
        fmt::format("{} rows hold {} whatever their reference: set aside as invalid", count, values));
    errors = robustSpread(data.error);
  }
  const bool is_known = data.period > 0.0;
  const double fold = is_known ? scale * data.period : foldIn(data, errors, scale);
  if (const auto count = takeOut(data, foldedRows(data, errors, fold)); count > 0) {
    data.doubts.push_back(
        fmt::format("{} rows are off by {}{}: set aside as wrapped; unwrap them, or say `modulation_mhz` if "
                    "that is not c/(2f)",
                    count, withUnit(data, fold),
                    is_known ? ", c/(2f), or a multiple" : " as all beyond that reference are"));
  }
}

void dropCopies(TableData& data, double scale) {
  if (data.reference.size() != data.rows() || data.rows() < 3) return;
  const auto n = static_cast<Eigen::Index>(data.rows());
  const auto centred = [&](const std::vector<double>& values) {
    const Eigen::VectorXd v = Eigen::Map<const Eigen::VectorXd>(values.data(), n);
    return Eigen::VectorXd(v.array() - v.mean());
  };
  const auto leftOf = [](const Eigen::VectorXd& y, const Eigen::VectorXd& x) {
    return (y - x * (x.dot(y) / std::max(x.squaredNorm(), 1e-300))).squaredNorm();
  };
  const Eigen::VectorXd reference = scale * centred(data.reference), error = centred(data.error);
  const Eigen::VectorXd measured = error + reference;
  if (reference.norm() < 3.0 * error.norm())
    return;  // then anything that the error goes with looks like a copy
  const double from_reference = leftOf(error, reference);
  std::erase_if(data.covariates, [&](const TableCovariate& covariate) {
    if (covariate.nature == Nature::Category || covariate.name == data.reference_name) return false;
    const Eigen::VectorXd c = centred(covariate.values);
    // A copy says what was measured, in whatever unit, better than the reference does; what errors go with needs it.
    const bool is_measured = leftOf(measured, c) < 0.05 * from_reference;
    const double decades = std::log10(error.norm() / std::max(c.norm(), 1e-300));  // mm, cm, m
    const bool is_error = isLengthOrNone(unitOf(covariate.name)) && std::abs(decades - std::round(decades)) < 0.02 &&
                          leftOf(error, c) < 1e-3 * error.squaredNorm();
    if (!is_measured && !is_error) return false;
    data.doubts.push_back(fmt::format("column \"{}\" is {} again: left out, it would explain all and nothing",
                                      covariate.name, is_measured ? "the measured value" : "the error"));
    return true;
  });
}

}  // namespace toftwin::discover
