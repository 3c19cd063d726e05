// SPDX-License-Identifier: Apache-2.0
// What terms of covariates add to a campaign's rows.
#include <algorithm>
#include <cmath>
#include <set>

#include "calib/discover/campaign/carriers.h"
#include "calib/discover/campaign/covariates.h"
#include "calib/discover/campaign/refit.h"
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

CampaignRows::PerChannel CampaignRows::columnsOf(const Fixed& fixed, const Term& term) {
  const Eigen::VectorXf values = valuesOf(term, fixed.covariates);
  PerChannel columns;  // empty: nothing is added
  if (!term.carrier.empty()) {
    const auto carrier = fixed.carriers.find(term.carrier);
    if (carrier == fixed.carriers.end()) return columns;
    for (std::size_t c = 0; c < kChannels; ++c) {
      if (carrier->second[c].size() != 0) columns[c] = values.cwiseProduct(carrier->second[c]);
    }
    return columns;
  }
  if (term.stage.value_or(Stage::Range) == Stage::Range)
    columns[kRange] = 1e-3F * values.cwiseProduct(fixed.cells.rootWeights(Channel::Range));
  else if (fixed.cells.has(Channel::LogAmplitude))
    columns[kLog] = 1e-2F * values.cwiseProduct(fixed.cells.rootWeights(Channel::LogAmplitude));
  return columns;
}

CampaignRows::Terms CampaignRows::termsOf(const Fixed& fixed, std::span<const TermGroup> groups) {
  Terms terms;
  for (const TermGroup& group : groups) terms.count += static_cast<Eigen::Index>(group.terms.size());
  Eigen::Index next = 0;
  for (const TermGroup& group : groups) {
    for (const Term& term : group.terms) {
      const PerChannel columns = columnsOf(fixed, term);
      for (std::size_t c = 0; c < kChannels; ++c) {
        if (columns[c].size() == 0) continue;
        if (terms.columns[c].size() == 0)
          terms.columns[c] =
              Eigen::MatrixXf::Zero(static_cast<Eigen::Index>(fixed.cells.size()), terms.count);
        terms.columns[c].col(next) = columns[c];
      }
      ++next;
    }
  }
  return terms;
}

CaptureEvidence CampaignRows::ownEvidence(const CaptureRows& rows) {
  WhitenedCapture both = rows.base;
  for (std::size_t c = 0; c < kChannels; ++c) {
    const Eigen::MatrixXf& more = rows.fixed->catalogue[c];
    if (both.columns[c].size() == 0) continue;
    const Eigen::Index old = both.columns[c].cols();
    both.columns[c].conservativeResize(Eigen::NoChange, old + more.cols());
    both.columns[c].rightCols(more.cols()) = more;
  }
  return both.evidence(rows.fixed->name, rows.fixed->block);
}

CaptureEvidence CampaignRows::evidenceOf(const CaptureRows& rows, std::span<const TermGroup> extra,
                                         bool with_catalogue) const {
  const auto in_base = static_cast<Eigen::Index>(base_columns_);
  const Eigen::Index old = with_catalogue ? rows.evidence.gram.rows() : in_base;
  const Terms terms = termsOf(*rows.fixed, extra);
  const Eigen::Index added = terms.count;
  CaptureEvidence evidence{.gram = Eigen::MatrixXd::Zero(old + added, old + added),
                           .moment = Eigen::VectorXd::Zero(old + added),
                           .energy = rows.evidence.energy,
                           .rows = rows.evidence.rows,
                           .name = rows.evidence.name,
                           .block = rows.evidence.block};
  evidence.gram.topLeftCorner(old, old) = rows.evidence.gram.topLeftCorner(old, old);
  evidence.moment.head(old) = rows.evidence.moment.head(old);
  for (std::size_t c = 0; c < kChannels; ++c) {
    const Eigen::MatrixXf& own = terms.columns[c];
    if (own.size() == 0) continue;
    Eigen::MatrixXd cross(old, added);
    cross.topRows(in_base) = (rows.base.columns[c].transpose() * own).cast<double>();
    if (with_catalogue)
      cross.bottomRows(old - in_base) =
          (rows.fixed->catalogue[c].transpose() * own).cast<double>();
    evidence.gram.topRightCorner(old, added) += cross;
    evidence.gram.bottomLeftCorner(added, old) += cross.transpose();
    Eigen::MatrixXf squares = Eigen::MatrixXf::Zero(added, added);
    squares.selfadjointView<Eigen::Lower>().rankUpdate(own.transpose());
    evidence.gram.bottomRightCorner(added, added) +=
        Eigen::MatrixXf{squares.selfadjointView<Eigen::Lower>()}.cast<double>();
    evidence.moment.tail(added) += (own.transpose() * rows.base.residual[c]).cast<double>();
  }
  return evidence;
}

namespace {

/// Groups of terms behind `groups`, whose columns end at `next`.
void appendTerms(std::span<const TermGroup> extra, std::size_t next, std::vector<Group>& groups) {
  for (const TermGroup& term : extra) {
    Group group{.name = term.name,
                .kind = term.kind,
                .stage = Stage::Range,
                .first = next,
                .count = term.terms.size()};
    if (!term.terms.empty()) group.stage = term.terms.front().stage.value_or(Stage::Range);
    group.covariates = discover::covariatesOf(term);
    group.numbers = static_cast<int>(term.terms.size()) + term.inner_numbers;
    next += group.count;
    groups.push_back(std::move(group));
  }
}

}  // namespace

Evidence CampaignRows::evidenceWith(std::span<const TermGroup> extra, bool with_catalogue) const {
  Evidence evidence;
  for (const Group& group : groups_)
    if (with_catalogue || group.first < base_columns_) evidence.groups.push_back(group);
  appendTerms(extra, evidence.columns(), evidence.groups);
  evidence.captures.resize(rows_.size());
  sim::inParallel(static_cast<int>(rows_.size()), 1, [&](int first, int last) {
    for (auto c = static_cast<std::size_t>(first); c < static_cast<std::size_t>(last); ++c)
      evidence.captures[c] = evidenceOf(rows_[c], extra, with_catalogue);
  });
  return evidence;
}

Evidence CampaignRows::evidence(std::span<const TermGroup> extra) const {
  return evidenceWith(extra, true);
}
Evidence CampaignRows::withoutCatalogue(std::span<const TermGroup> extra) const {
  return evidenceWith(extra, false);
}

Result<Evidence> CampaignRows::evidenceLeft(const Left& left) const {
  const auto here = cameraWith(left.effects);
  if (!here) return here.error();
  std::vector<NoiselessCamera> cameras;
  for (const FreeNumber& one : left.free) {
    auto camera = cameraWith(moved(left.effects, one, one.step));
    if (!camera) return camera.error();
    cameras.push_back(*std::move(camera));
  }
  const bool on_light = actsOnLight(left.effects);
  Evidence evidence;
  const std::size_t own = left.with_numbers ? base_columns_ : kCommon;
  for (const Group& group : groups_)
    if (group.first < own) evidence.groups.push_back(group);
  appendTerms(left.terms, own, evidence.groups);
  const std::size_t first_free = evidence.columns();
  for (std::size_t i = 0; i < left.free.size(); ++i) {
    evidence.groups.push_back({.name = left.free[i].key,
                               .kind = Kind::Declared,
                               .first = first_free + i,
                               .count = 1,
                               .numbers = 1});
  }
  evidence.captures.resize(rows_.size());
  sim::inParallel(static_cast<int>(rows_.size()), 1, [&](int first, int last) {
    for (auto c = static_cast<std::size_t>(first); c < static_cast<std::size_t>(last); ++c) {
      const Fixed& fixed = *rows_[c].fixed;
      WhitenedCapture whitened{fixed.cells, first_free + left.free.size()};
      const Reading reading = read(*here, c, on_light);
      const Terms terms = termsOf(fixed, left.terms);
      whitened.putResidual(fixed.cells, fixed.residual, fixed.varied, reading);
      for (std::size_t k = 0; k < kChannels; ++k) {
        if (whitened.columns[k].size() == 0) continue;
        const auto in_base = static_cast<Eigen::Index>(own);
        whitened.columns[k].leftCols(in_base) = rows_[c].base.columns[k].leftCols(in_base);
        if (terms.columns[k].size() != 0)
          whitened.columns[k].middleCols(in_base, terms.count) = terms.columns[k];
      }
      for (std::size_t i = 0; i < left.free.size(); ++i)
        whitened.putChange(fixed.cells, first_free + i, reading, read(cameras[i], c, on_light));
      evidence.captures[c] = whitened.evidence(fixed.name, fixed.block);
    }
  });
  return evidence;
}

std::vector<CovariateInfo> CampaignRows::covariates() const {
  constexpr std::size_t kQuantiles = 33, kMostLevels = 12;
  std::vector<CovariateInfo> all;
  if (rows_.empty()) return all;
  for (std::size_t i = 0; i < rows_.front().fixed->covariates.names.size(); ++i) {
    CovariateInfo info = describe(rows_.front().fixed->covariates.names[i]);
    std::vector<double> values;
    std::set<double> levels;
    info.is_of_capture = true;
    for (const CaptureRows& rows : rows_) {
      const auto column = rows.fixed->covariates.values.col(static_cast<Eigen::Index>(i));
      info.is_of_capture =
          info.is_of_capture && (column.size() == 0 || column.minCoeff() == column.maxCoeff());
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

std::string CampaignRows::wordOfCarrier(const std::string& carrier) const {
  return std::string{discover::wordOfCarrier(carrier)};
}

std::vector<TermGroup> CampaignRows::ownGroups() const { return carrierGroups(covariates(), has_delay_); }

}  // namespace toftwin::discover
