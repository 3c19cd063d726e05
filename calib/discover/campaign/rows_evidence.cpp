// SPDX-License-Identifier: Apache-2.0
// What terms of covariates add to a campaign's rows.
#include <algorithm>
#include <cmath>
#include <set>

#include "calib/discover/campaign/covariates.h"
#include "calib/discover/campaign/rows.h"
#include "sim/images/rows.h"

namespace toftwin::discover {
namespace {

constexpr std::size_t kRange = static_cast<std::size_t>(Channel::Range);
constexpr std::size_t kLog = static_cast<std::size_t>(Channel::LogAmplitude);

/// A term at each cell; 0 where a covariate of it is not known.
Eigen::VectorXf valuesOf(const Term& term, const CaptureCovariates& covariates) {
  Eigen::VectorXf values = Eigen::VectorXf::Ones(covariates.values.rows());
  for (const Factor& factor : term.factors) {
    const auto found = std::ranges::find(covariates.names, factor.covariate);
    if (found == covariates.names.end()) return Eigen::VectorXf::Zero(covariates.values.rows());
    const auto column = covariates.values.col(found - covariates.names.begin());
    for (Eigen::Index i = 0; i < values.size(); ++i) {
      const double value = factor.at(static_cast<double>(column[i]));
      values[i] *= std::isfinite(value) ? static_cast<float>(value) : 0.0F;
    }
  }
  return values;
}

}  // namespace

std::array<Eigen::VectorXf, kChannels> CampaignRows::columnsOf(const CaptureRows& rows,
                                                               const Term& term) {
  const Eigen::VectorXf values = valuesOf(term, rows.covariates);
  std::array<Eigen::VectorXf, kChannels> columns;  // empty: nothing is added
  const bool has_amplitude = rows.cells.has(Channel::LogAmplitude);
  switch (term.stage.value_or(Stage::Range)) {
    case Stage::Range:
      columns[kRange] = 1e-3F * values.cwiseProduct(rows.cells.rootWeights(Channel::Range));
      break;
    case Stage::Light:
      if (has_amplitude)
        columns[kLog] = 1e-2F * values.cwiseProduct(rows.cells.rootWeights(Channel::LogAmplitude));
      break;
    case Stage::Samples:
      columns[kRange] = values.cwiseProduct(rows.sample[kRange]);
      if (has_amplitude) columns[kLog] = values.cwiseProduct(rows.sample[kLog]);
      break;
  }
  return columns;
}

CaptureEvidence CampaignRows::evidenceOf(const CaptureRows& rows, std::span<const TermGroup> extra,
                                         std::size_t extra_columns) const {
  const Eigen::Index old = rows.evidence.gram.rows(),
                     added = static_cast<Eigen::Index>(extra_columns);
  std::array<Eigen::MatrixXf, kChannels> terms;
  Eigen::Index next = 0;
  for (const TermGroup& group : extra) {
    for (const Term& term : group.terms) {
      const auto columns = columnsOf(rows, term);
      for (std::size_t c = 0; c < kChannels; ++c) {
        if (columns[c].size() == 0) continue;
        if (terms[c].size() == 0)
          terms[c] = Eigen::MatrixXf::Zero(static_cast<Eigen::Index>(rows.cells.size()), added);
        terms[c].col(next) = columns[c];
      }
      ++next;
    }
  }
  CaptureEvidence evidence = rows.evidence;
  if (added == 0) return evidence;
  evidence.gram.conservativeResize(old + added, old + added);
  evidence.gram.rightCols(added).setZero();
  evidence.gram.bottomRows(added).setZero();
  evidence.moment.conservativeResize(old + added);
  evidence.moment.tail(added).setZero();
  for (std::size_t c = 0; c < kChannels; ++c) {
    if (terms[c].size() == 0) continue;
    const Eigen::MatrixXd cross = (rows.whitened.columns[c].transpose() * terms[c]).cast<double>();
    evidence.gram.topRightCorner(old, added) += cross;
    evidence.gram.bottomLeftCorner(added, old) += cross.transpose();
    Eigen::MatrixXf own = Eigen::MatrixXf::Zero(added, added);
    own.selfadjointView<Eigen::Lower>().rankUpdate(terms[c].transpose());
    evidence.gram.bottomRightCorner(added, added) +=
        Eigen::MatrixXf{own.selfadjointView<Eigen::Lower>()}.cast<double>();
    evidence.moment.tail(added) +=
        (terms[c].transpose() * rows.whitened.residual[c]).cast<double>();
  }
  return evidence;
}

Evidence CampaignRows::evidence(std::span<const TermGroup> extra) const {
  Evidence evidence;
  evidence.groups = groups_;
  std::size_t next = evidence.columns(), added = 0;
  for (const TermGroup& term : extra) {
    Group group{.name = term.name,
                .kind = term.kind,
                .stage = Stage::Range,
                .first = next,
                .count = term.terms.size()};
    if (!term.terms.empty()) group.stage = term.terms.front().stage.value_or(Stage::Range);
    group.covariates = discover::covariatesOf(term);
    group.numbers = static_cast<int>(term.terms.size()) + term.inner_numbers;
    next += group.count, added += group.count;
    evidence.groups.push_back(std::move(group));
  }
  evidence.captures.resize(rows_.size());
  sim::inParallel(static_cast<int>(rows_.size()), 1, [&](int first, int last) {
    for (auto c = static_cast<std::size_t>(first); c < static_cast<std::size_t>(last); ++c)
      evidence.captures[c] = evidenceOf(rows_[c], extra, added);
  });
  return evidence;
}

std::vector<CovariateInfo> CampaignRows::covariates() const {
  constexpr std::size_t kQuantiles = 33, kMostLevels = 12;
  std::vector<CovariateInfo> all;
  if (rows_.empty()) return all;
  for (std::size_t i = 0; i < rows_.front().covariates.names.size(); ++i) {
    CovariateInfo info = describe(rows_.front().covariates.names[i]);
    std::vector<double> values;
    std::set<double> levels;
    for (const CaptureRows& rows : rows_) {
      const auto column = rows.covariates.values.col(static_cast<Eigen::Index>(i));
      for (Eigen::Index k = 0; k < column.size(); ++k) {
        const auto value = static_cast<double>(column[k]);
        if (!std::isfinite(value)) continue;
        if (k % 7 == 0) values.push_back(value);
        if (levels.size() <= kMostLevels) levels.insert(value);
      }
    }
    if (values.empty() || levels.size() < 2) continue;
    std::ranges::sort(values);
    for (std::size_t q = 0; q < kQuantiles; ++q)
      info.quantiles.push_back(values[q * (values.size() - 1) / (kQuantiles - 1)]);
    if (levels.size() <= kMostLevels) info.levels.assign(levels.begin(), levels.end());
    if (info.nature == Nature::Distance) info.period = period_m_;
    all.push_back(std::move(info));
  }
  return all;
}

}  // namespace toftwin::discover
