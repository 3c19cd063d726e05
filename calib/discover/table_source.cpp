// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/table_source.h"

#include <algorithm>
#include <cmath>
#include <set>

#include <fmt/format.h>

#include "calib/discover/draws.h"
#include "calib/discover/headers.h"

namespace toftwin::discover {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr std::size_t kMostCaptures = 100, kMostLevels = 12, kQuantiles = 33, kManySessions = 20;

double quantileOf(const std::vector<double>& sorted, double q) {
  const double place = q * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<std::size_t>(place);
  const double above = sorted[std::min(below + 1, sorted.size() - 1)];
  return sorted[below] + (place - static_cast<double>(below)) * (above - sorted[below]);
}

double spreadOf(const std::vector<double>& values) {
  double mean = 0.0, squares = 0.0;
  for (const double v : values) mean += v / static_cast<double>(values.size());
  for (const double v : values) squares += (v - mean) * (v - mean);
  return std::sqrt(squares / std::max<double>(1.0, static_cast<double>(values.size()) - 1.0));
}

}  // namespace

std::vector<CovariateInfo> infosOf(const TableData& data) {
  std::vector<CovariateInfo> infos;
  for (const TableCovariate& covariate : data.covariates) {
    CovariateInfo info;
    info.name = covariate.name, info.unit = unitOf(covariate.name), info.nature = covariate.nature;
    info.stage = std::nullopt, info.rows = covariate.values.size();
    std::vector<double> sorted = covariate.values;
    std::ranges::sort(sorted);
    if (sorted.empty()) continue;
    for (std::size_t i = 0; i < kQuantiles; ++i)
      info.quantiles.push_back(quantileOf(sorted, static_cast<double>(i) / (kQuantiles - 1)));
    std::vector<double> levels = sorted;
    levels.erase(std::ranges::unique(levels).begin(), levels.end());
    if (levels.size() <= kMostLevels) info.levels = std::move(levels);
    if (covariate.nature == Nature::Distance && covariate.name == data.reference_name)
      info.period = data.period;
    infos.push_back(std::move(info));
  }
  return infos;
}

MatrixXd columnsOf(const TableData& data, std::span<const Term> terms) {
  MatrixXd columns(static_cast<Index>(data.rows()), static_cast<Index>(terms.size()));
  for (std::size_t t = 0; t < terms.size(); ++t) {
    auto column = columns.col(static_cast<Index>(t));
    column.setOnes();
    for (const Factor& factor : terms[t].factors) {
      const auto at = std::ranges::find(data.covariates, factor.covariate, &TableCovariate::name);
      if (at == data.covariates.end()) {
        column.setZero();
        continue;
      }
      for (Index i = 0; i < column.size(); ++i)
        column(i) *= factor.at(at->values[static_cast<std::size_t>(i)]);
    }
    // A logarithm of nothing, a power of a negative number: such rows say nothing about this term.
    column = column.unaryExpr([](double v) { return std::isfinite(v) ? v : 0.0; });
  }
  return columns;
}

TableSource::TableSource(TableData data, bool fits_gain) : data_(std::move(data)), infos_(infosOf(data_)) {
  error_spread_ = std::max(spreadOf(data_.error), 1e-12);
  if (!data_.reference.empty()) {
    std::vector<double> sorted = data_.reference;
    std::ranges::sort(sorted);
    reference_middle_ = quantileOf(sorted, 0.5);
    reference_spread_ = spreadOf(data_.reference);
    fits_gain_ = fits_gain && reference_spread_ > 0.02 * std::abs(reference_middle_);
  }
  // The variance of an offset is known from many sessions only: then it is a random effect of each, and what
  // changes from session to session is seen. A few sessions' offsets are free, and only what changes within
  // them is.
  const bool are_many = data_.session_names.size() >= kManySessions && !data_.sessions_are_captures;
  if (data_.capture.empty() && are_many) data_.capture = data_.session;
  has_sessions_ = data_.session_names.size() > 1 && !are_many;
  if (data_.capture.empty()) {
    if (auto runs = alikeRuns(data_, infos_, nuisancesOf(data_)))
      runs_of_ = std::move(runs->covariate), data_.capture = std::move(runs->run);
  }
  std::set<std::pair<int, int>> captures;  // one name in two sessions is two
  for (std::size_t i = 0; i < data_.capture.size(); ++i) captures.emplace(data_.session[i], data_.capture[i]);
  has_captures_ = !captures.empty() && 2 * captures.size() <= data_.rows();
  learn({});
}

void TableSource::learn(std::span<const Term> known) {
  const MatrixXd nuisances = nuisancesOf(data_);
  MatrixXd columns = columnsOf(data_, known);
  columns.conservativeResize(Eigen::NoChange, columns.cols() + nuisances.cols());
  columns.rightCols(nuisances.cols()) = nuisances;
  noise_ = estimateNoise(data_, infos_, columns, has_captures_ ? std::vector<RowClock>{} : clocksOf(data_));
  whitening_.reset();
  if (noise_.dependence) whitening_.emplace(noise_.dependence->clock, noise_.dependence->best.correlation);
  makeCaptures();
}

MatrixXd TableSource::nuisancesOf(const TableData& rows) const {
  MatrixXd columns(static_cast<Index>(rows.rows()), 0);
  for (const auto& [group, more] : nuisanceColumns(rows)) {
    columns.conservativeResize(Eigen::NoChange, columns.cols() + more.cols());
    columns.rightCols(more.cols()) = more;
  }
  return columns;
}

std::vector<std::pair<Group, MatrixXd>> TableSource::nuisanceColumns(const TableData& rows) const {
  const auto n = static_cast<Index>(rows.rows());
  std::vector<std::pair<Group, MatrixXd>> all;
  if (!has_sessions_) all.push_back({Group{.name = "offset", .kind = Kind::Nuisance}, MatrixXd::Ones(n, 1)});
  if (fits_gain_) {
    MatrixXd gain(n, 1);
    for (Index i = 0; i < n; ++i)
      gain(i, 0) = rows.reference[static_cast<std::size_t>(i)] - reference_middle_;
    all.push_back({Group{.name = "gain", .kind = Kind::Nuisance}, std::move(gain)});
  }
  if (has_sessions_) {
    MatrixXd offsets = MatrixXd::Zero(n, static_cast<Index>(data_.session_names.size()));
    for (Index i = 0; i < n; ++i) offsets(i, rows.session[static_cast<std::size_t>(i)]) = 1.0;
    all.push_back({Group{.name = "session", .kind = Kind::Nuisance}, std::move(offsets)});
  }
  return all;
}

/// Captures of a column; else blocks of rows within a session.
void TableSource::makeCaptures() {
  names_.clear(), blocks_.clear();
  const std::size_t rows = data_.rows();
  capture_.assign(rows, 0);
  std::map<std::pair<int, std::size_t>, int> known;
  const std::size_t size = (rows + kMostCaptures - 1) / kMostCaptures;
  std::map<int, std::size_t> seen;  // rows of each session so far
  for (std::size_t i = 0; i < rows; ++i) {
    const int session = data_.session[i];
    const std::size_t block =
        has_captures_ ? static_cast<std::size_t>(data_.capture[i]) : seen[session]++ / size;
    const auto [at, is_new] = known.try_emplace({session, block}, static_cast<int>(known.size()));
    capture_[i] = at->second;
    if (!is_new) continue;
    names_.push_back(fmt::format("line {}", data_.line[i]));
    blocks_.push_back(data_.session_names[static_cast<std::size_t>(session)]);
  }
}

Evidence TableSource::evidence(std::span<const TermGroup> extra) const {
  return evidenceOf(extra, capture_, names_.size());
}

/// Without captures' own offsets, one capture of all rows says the same as their sum.
Evidence TableSource::summed(std::span<const TermGroup> extra, std::span<const double> scales) const {
  if (has_captures_) return RowSource::summed(extra, scales);
  return evidenceOf(extra, std::vector<int>(data_.rows(), 0), 1);
}

/// The columns of nuisances and `extra`, and their groups.
MatrixXd TableSource::designOf(std::span<const TermGroup> extra, std::vector<Group>& groups) const {
  const auto n = static_cast<Index>(data_.rows());
  std::vector<MatrixXd> parts;
  std::size_t count = 0;
  const auto add = [&](Group group, MatrixXd columns) {
    group.first = count, group.count = static_cast<std::size_t>(columns.cols());
    count += group.count;
    groups.push_back(std::move(group));
    parts.push_back(std::move(columns));
  };
  for (auto& [group, columns] : nuisanceColumns(data_)) add(std::move(group), std::move(columns));
  if (has_captures_) {
    add({.name = "capture", .kind = Kind::PerCapture, .scale_class = 0},
        MatrixXd::Constant(n, 1, error_spread_));
  }
  for (const TermGroup& terms : extra) {
    Group group{.name = terms.name, .kind = terms.kind, .stage = std::nullopt};
    group.covariates = covariatesOf(terms);
    group.numbers = static_cast<int>(terms.terms.size()) + terms.inner_numbers;
    add(std::move(group), columnsOf(data_, terms.terms));
  }
  MatrixXd x(n, static_cast<Index>(count));
  for (std::size_t g = 0; g < parts.size(); ++g)
    x.middleCols(static_cast<Index>(groups[g].first), parts[g].cols()) = parts[g];
  return x;
}

/// Rows in units of what they err by, beyond those before them.
MatrixXd TableSource::standardised(MatrixXd rows) const {
  for (Index i = 0; i < rows.rows(); ++i) {
    const auto row = static_cast<std::size_t>(i);
    rows.row(i) *= std::sqrt(noise_.weight[row]) / noise_.sigma[row];
  }
  return whitening_ ? whitening_->whitened(rows) : rows;
}

Evidence TableSource::evidenceOf(std::span<const TermGroup> extra, const std::vector<int>& capture_of,
                                 std::size_t captures) const {
  Evidence out;
  const MatrixXd x = standardised(designOf(extra, out.groups));
  const VectorXd y = standardised(Eigen::Map<const VectorXd>(data_.error.data(), x.rows()));
  std::vector<std::vector<Index>> rows_of(captures);
  for (std::size_t i = 0; i < capture_of.size(); ++i)
    rows_of[static_cast<std::size_t>(capture_of[i])].push_back(static_cast<Index>(i));
  for (std::size_t c = 0; c < captures; ++c) {
    const MatrixXd own = x(rows_of[c], Eigen::all);
    const VectorXd errors = y(rows_of[c]);
    CaptureEvidence capture;
    for (const Index row : rows_of[c]) capture.rows += noise_.weight[static_cast<std::size_t>(row)];
    capture.gram.noalias() = own.transpose() * own;
    capture.moment.noalias() = own.transpose() * errors;
    capture.energy = errors.squaredNorm();
    capture.name = names_[c], capture.block = blocks_[c];
    out.captures.push_back(std::move(capture));
  }
  return out;
}

MatrixXd TableSource::nullMoments(std::span<const TermGroup> extra, int draws, std::uint64_t seed) const {
  if (!whitening_) return {};
  constexpr Index kAtOnce = 32;  // of as many numbers as rows
  std::vector<Group> groups;
  const MatrixXd x = standardised(designOf(extra, groups));
  MatrixXd moments(x.cols(), draws);
  Draws random(seed);
  Index first = 0;
  double weights = 0.0;
  for (const LikelyCorrelation& likely : noise_.dependence->likely) {
    weights += likely.weight;
    const auto end = std::min<Index>(draws, std::lround(weights * draws));
    const RowWhitening noise{noise_.dependence->clock, likely.correlation};
    const double deviation = std::sqrt(likely.variance / noise_.dependence->best.variance);
    for (Index count = 0; first < end; first += count) {
      count = std::min(kAtOnce, end - first);
      moments.middleCols(first, count).noalias() =
          deviation * x.transpose() * whitening_->whitened(noise.coloured(random.normals(x.rows(), count)));
    }
  }
  return moments;
}

}  // namespace toftwin::discover
