// SPDX-License-Identifier: Apache-2.0
// What terms of covariates add to a campaign's rows.
#include <algorithm>
#include <cmath>
#include <deque>
#include <optional>
#include <set>

#include <toftwin/nan.h>

#include "calib/discover/campaign/captures/light_delay.h"
#include "calib/discover/campaign/rows/carriers.h"
#include "calib/discover/campaign/rows/covariates.h"
#include "calib/discover/campaign/rows/pose_errors.h"
#include "calib/discover/campaign/rows/refit.h"
#include "calib/discover/campaign/rows/repeating_columns.h"
#include "calib/discover/campaign/rows/rows.h"
#include "calib/discover/campaign/rows/smeared_ranges.h"
#include "calib/discover/campaign/rows/spilled_light.h"
#include "sim/images/rows.h"

namespace toftwin::discover {
namespace {

/// Values of factors at a capture's cells, each computed once.
class Factors {
 public:
  explicit Factors(const CaptureCovariates& covariates) : covariates_(covariates) {}

  /// A term without those of its factors that are the same in all cells, and what these come to; 0 where a
  /// covariate is not known.
  [[nodiscard]] std::pair<Term, double> split(const Term& term) const {
    Term rest{{}, term.stage, term.carrier};
    double scale = 1.0;
    for (const Factor& factor : term.factors) {
      const auto places = placesOf(factor);
      if (!places) return {rest, 0.0};
      if (std::ranges::all_of(*places, [&](std::size_t place) { return covariates_.is_same[place]; }))
        scale *= known(terms::valueOf(factor, argumentOf(factor, *places)(0)));
      else
        rest.factors.push_back(factor);
    }
    return {std::move(rest), scale};
  }

  /// What varies of a term.
  [[nodiscard]] Eigen::VectorXf of(const Term& rest) {
    Eigen::VectorXf product = Eigen::VectorXf::Ones(covariates_.values.rows());
    for (const Factor& factor : rest.factors) product = product.cwiseProduct(valuesOf(factor));
    return product;
  }

 private:
  static double known(double value) { return std::isfinite(value) ? value : 0.0; }
  /// Of the covariates of its argument; nothing where one is not known.
  [[nodiscard]] std::optional<std::vector<std::size_t>> placesOf(const Factor& factor) const {
    std::vector<std::size_t> places;
    for (const terms::Argument::Part& part : factor.of.parts) {
      const auto found = std::ranges::find(covariates_.names, part.covariate);
      if (found == covariates_.names.end() || covariates_.values.rows() == 0) return std::nullopt;
      places.push_back(static_cast<std::size_t>(found - covariates_.names.begin()));
    }
    return places;
  }
  [[nodiscard]] Eigen::VectorXd argumentOf(const Factor& factor, const std::vector<std::size_t>& places) const {
    Eigen::VectorXd x = Eigen::VectorXd::Zero(covariates_.values.rows());
    for (std::size_t i = 0; i < places.size(); ++i)
      x += factor.of.parts[i].weight * covariates_.values.col(static_cast<Eigen::Index>(places[i])).cast<double>();
    return x;
  }
  const Eigen::VectorXf& valuesOf(const Factor& factor) {
    for (const auto& [other, values] : known_)
      if (other == factor) return values;
    const Eigen::VectorXd x = argumentOf(factor, *placesOf(factor));
    Eigen::VectorXf values(x.size());
    for (Eigen::Index i = 0; i < values.size(); ++i)
      values[i] = static_cast<float>(known(terms::valueOf(factor, x[i])));
    return known_.emplace_back(factor, std::move(values)).second;
  }

  const CaptureCovariates& covariates_;
  std::deque<std::pair<Factor, Eigen::VectorXf>> known_{};
};

bool isSame(const Term& a, const Term& b) {
  return a.carrier == b.carrier && a.stage == b.stage && a.factors == b.factors;
}

Eigen::MatrixXd squared(const Eigen::MatrixXf& columns) {
  Eigen::MatrixXf squares = Eigen::MatrixXf::Zero(columns.cols(), columns.cols());
  squares.selfadjointView<Eigen::Lower>().rankUpdate(columns.transpose());
  return Eigen::MatrixXf{squares.selfadjointView<Eigen::Lower>()}.cast<double>();
}

}  // namespace

Eigen::MatrixXd CampaignRows::Terms::columnsFor(std::size_t channel, const Eigen::MatrixXd& shared) const {
  Eigen::MatrixXd all = Eigen::MatrixXd::Zero(shared.rows(), count());
  for (Eigen::Index j = 0; j < count(); ++j) {
    const Eigen::Index at = channels[channel].of[static_cast<std::size_t>(j)];
    if (at >= 0) all.col(j) = scale[j] * shared.col(at);
  }
  return all;
}

CampaignRows::PerChannel CampaignRows::columnsOf(const CaptureRows& rows, const Term& term,
                                                 const Eigen::VectorXf& values) {
  PerChannel columns;  // empty: nothing is added
  const Fixed& fixed = *rows.fixed;
  if (!term.carrier.empty()) {
    const auto carrier = fixed.carriers.find(term.carrier);
    const auto pattern = rows.patterns.find(term.carrier);
    if (carrier == fixed.carriers.end() && pattern == rows.patterns.end()) return columns;
    const PerChannel& by = carrier == fixed.carriers.end() ? pattern->second : carrier->second;
    for (std::size_t c = 0; c < kChannels; ++c) {
      if (by[c].size() != 0) columns[c] = values.cwiseProduct(by[c]);
    }
    return columns;
  }
  if (term.stage.value_or(Stage::Range) == Stage::Range)
    columns[kRange] = 1e-3F * values.cwiseProduct(fixed.cells.rootWeights(Channel::Range));
  else if (fixed.cells.has(Channel::LogAmplitude))
    columns[kLog] = 1e-2F * values.cwiseProduct(fixed.cells.rootWeights(Channel::LogAmplitude));
  return columns;
}

CampaignRows::Terms CampaignRows::termsOf(const CaptureRows& rows, std::span<const TermGroup> groups) {
  const Fixed& fixed = *rows.fixed;
  Factors factors{fixed.covariates};
  std::vector<double> scale;
  std::vector<std::optional<std::size_t>> place;  ///< of each term among the parts that vary
  std::vector<Term> parts;
  for (const TermGroup& group : groups) {
    for (const Term& term : group.terms) {
      auto [rest, by] = factors.split(term);
      scale.push_back(by);
      place.emplace_back();
      if (by == 0.0) continue;
      const auto same = std::ranges::find_if(parts, [&](const Term& other) { return isSame(other, rest); });
      place.back() = static_cast<std::size_t>(same - parts.begin());
      if (same == parts.end()) parts.push_back(std::move(rest));
    }
  }
  std::array<std::vector<Eigen::VectorXf>, kChannels> columns;
  std::array<std::vector<Eigen::Index>, kChannels> of_part;
  for (const Term& part : parts) {
    PerChannel both = columnsOf(rows, part, factors.of(part));
    for (std::size_t c = 0; c < kChannels; ++c) {
      of_part[c].push_back(both[c].size() == 0 ? -1 : static_cast<Eigen::Index>(columns[c].size()));
      if (both[c].size() != 0) columns[c].push_back(std::move(both[c]));
    }
  }
  Terms terms;
  terms.scale = Eigen::Map<Eigen::VectorXd>(scale.data(), static_cast<Eigen::Index>(scale.size()));
  for (std::size_t c = 0; c < kChannels; ++c) {
    Terms::Shared& shared = terms.channels[c];
    for (const auto& at : place) shared.of.push_back(at ? of_part[c][*at] : -1);
    shared.columns.resize(static_cast<Eigen::Index>(fixed.cells.size()),
                          static_cast<Eigen::Index>(columns[c].size()));
    for (std::size_t i = 0; i < columns[c].size(); ++i)
      shared.columns.col(static_cast<Eigen::Index>(i)) = columns[c][i];
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
  const Terms terms = termsOf(rows, extra);
  const Eigen::Index added = terms.count();
  CaptureEvidence evidence{.gram = Eigen::MatrixXd::Zero(old + added, old + added),
                           .moment = Eigen::VectorXd::Zero(old + added),
                           .energy = rows.evidence.energy,
                           .rows = rows.evidence.rows,
                           .name = rows.evidence.name,
                           .block = rows.evidence.block};
  evidence.gram.topLeftCorner(old, old) = rows.evidence.gram.topLeftCorner(old, old);
  evidence.moment.head(old) = rows.evidence.moment.head(old);
  for (std::size_t c = 0; c < kChannels; ++c) {
    const Eigen::MatrixXf& own = terms.channels[c].columns;
    if (own.cols() == 0 || rows.base.columns[c].size() == 0) continue;
    Eigen::MatrixXd cross(old, own.cols());
    cross.topRows(in_base) = (rows.base.columns[c].transpose() * own).cast<double>();
    if (with_catalogue)
      cross.bottomRows(old - in_base) =
          (rows.fixed->catalogue[c].transpose() * own).cast<double>();
    evidence.gram.topRightCorner(old, added) += terms.columnsFor(c, cross);
    const Eigen::MatrixXd half = terms.columnsFor(c, squared(own));  // shared × terms
    evidence.gram.bottomRightCorner(added, added) += terms.columnsFor(c, half.transpose()).transpose();
    const Eigen::MatrixXd moment = (rows.base.residual[c].transpose() * own).cast<double>();
    evidence.moment.tail(added) += terms.columnsFor(c, moment).transpose();
  }
  evidence.gram.bottomLeftCorner(added, old) = evidence.gram.topRightCorner(old, added).transpose();
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
  evidence.captures = joined(std::move(evidence.captures), standsOf(lit_->captures));
  return evidence;
}

Evidence CampaignRows::evidence(std::span<const TermGroup> extra) const {
  return evidenceWith(extra, true);
}
Evidence CampaignRows::withoutCatalogue(std::span<const TermGroup> extra) const {
  return evidenceWith(extra, false);
}

Result<Evidence> CampaignRows::evidenceLeft(const Left& left) const {
  const auto cameraOf = [&](std::vector<sim::AnyEffect> effects, double later_mm = 0.0) {
    return cameraWith(withDelay(declared_->model, std::move(effects), left.delay_mm + later_mm));
  };
  const auto here = cameraOf(left.effects), late = cameraOf(left.effects, has_delay_ ? kDelay_mm : 0.0);
  if (!here || !late) return here ? late.error() : here.error();
  std::vector<NoiselessCamera> cameras;
  for (const FreeNumber& one : left.columns == nullptr ? left.free : std::span<const FreeNumber>{}) {
    auto camera = cameraOf(moved(left.effects, one, one.step));
    if (!camera) return camera.error();
    cameras.push_back(*std::move(camera));
  }
  const bool on_light = actsOnLight(left.effects) || left.delay_mm != 0.0;
  Evidence evidence;
  const std::size_t own = left.with_numbers ? base_columns_ : common_columns_;
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
  if (left.made != nullptr) left.made->of_capture.resize(rows_.size());
  sim::inParallel(static_cast<int>(rows_.size()), 1, [&](int first, int last) {
    for (auto c = static_cast<std::size_t>(first); c < static_cast<std::size_t>(last); ++c) {
      const Fixed& fixed = *rows_[c].fixed;
      WhitenedCapture whitened{fixed.cells, first_free + left.free.size()};
      const StagedReading staged = read(*here, c, on_light);
      const Reading& reading = staged.reading();
      const Terms terms = termsOf(rows_[c], left.terms);
      whitened.putResidual(fixed.cells, fixed.residual, fixed.varied, reading);
      for (std::size_t k = 0; k < kChannels; ++k) {
        if (whitened.columns[k].size() == 0) continue;
        const auto in_base = static_cast<Eigen::Index>(own);
        whitened.columns[k].leftCols(in_base) = rows_[c].base.columns[k].leftCols(in_base);
        whitened.columns[k].middleCols(in_base, terms.count()) =
            terms.columnsFor(k, terms.channels[k].columns.cast<double>()).cast<float>();
      }
      if (has_delay_) whitened.putDelay(fixed.cells, reading, staged.by(*late, Stage::Light));
      for (std::size_t i = 0; i < cameras.size(); ++i)
        whitened.putChange(fixed.cells, first_free + i, reading,
                           staged.by(cameras[i], discover::stageOf(left.effects[left.free[i].place])));
      const auto numbers = static_cast<Eigen::Index>(left.free.size());
      for (std::size_t k = 0; k < kChannels; ++k) {
        if (whitened.columns[k].size() == 0) continue;
        if (left.columns != nullptr) whitened.columns[k].rightCols(numbers) = left.columns->of_capture[c][k];
        if (left.made != nullptr) left.made->of_capture[c][k] = whitened.columns[k].rightCols(numbers);
      }
      evidence.captures[c] = whitened.evidence(fixed.name, fixed.block);
    }
  });
  evidence.captures = joined(std::move(evidence.captures), standsOf(lit_->captures));
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

std::map<double, double> CampaignRows::overTime(const std::string& covariate) const {
  std::map<double, double> all;
  for (const CaptureRows& rows : rows_) {
    const CaptureCovariates& known = rows.fixed->covariates;
    const auto valueOf = [&](const std::string& name) {
      const auto place = std::ranges::find(known.names, name);
      if (place == known.names.end() || known.values.rows() == 0) return double{kNaN};
      return static_cast<double>(known.values(0, place - known.names.begin()));
    };
    const double time = valueOf("time_s"), value = valueOf(covariate);
    if (std::isfinite(time) && std::isfinite(value)) all.emplace(time, value);
  }
  return all;
}

std::string CampaignRows::wordOfCarrier(const std::string& carrier) const {
  return std::string{discover::wordOfCarrier(carrier)};
}

std::vector<TermGroup> CampaignRows::ownGroups() const {
  const std::vector<CovariateInfo> infos = covariates();
  std::vector<TermGroup> groups = carrierGroups(infos, has_delay_);
  if (!rows_.empty() && rows_.front().fixed->cells.grid().cell_width == 1)
    for (TermGroup& group : repeatingColumns(infos)) groups.push_back(std::move(group));
  for (TermGroup& group : smearedGroups(infos)) groups.push_back(std::move(group));
  if (hasSpilledLight()) groups.push_back(spilledGroup());
  for (TermGroup& group : poseGroups()) groups.push_back(std::move(group));
  for (TermGroup& group : unequalGroups(unequal_)) groups.push_back(std::move(group));
  for (TermGroup& group : pixelGroups(has_delay_, rows_.empty() ? 0 : rows_.front().fixed->cells.grid().size()))
    groups.push_back(std::move(group));
  return groups;
}

}  // namespace toftwin::discover
