// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/campaign/search/raw_witness.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include <toftwin/nan.h>

#include "calib/discover/campaign/captures/light_delay.h"
#include "calib/discover/campaign/captures/reading.h"
#include "calib/discover/campaign/rows/carriers.h"
#include "calib/discover/cross_validation.h"
#include "sim/images/rows.h"

namespace toftwin::discover {
namespace {

/// Closures are never known better: of rounding, and of what is not alike in two converters.
constexpr double kLeastClosure = 2e-4;
/// A pixel whose closures an effect changes by more than this share of its amplitude sees next to no light.
constexpr float kMostClosure = 1.0F;

/// χ² of each capture of a marginal, offset and gain as they fit best.
std::vector<double> energiesOf(const Marginal& marginal) {
  const Columns common = nuisanceColumns(marginal);
  const Fit fitted = fit(marginal, common);
  std::vector<double> energies;
  for (const CaptureEvidence& capture : marginal.captures)
    energies.push_back(energyLeft(capture, common, fitted.coefficient));
  return energies;
}

/// What is left less, as a gain over nothing.
Gain gainOf(const std::vector<double>& closures, const std::vector<double>* waves) {
  Gain gain;
  for (std::size_t c = 0; c < closures.size(); ++c) {
    gain.by_capture.push_back(-closures[c] - (waves != nullptr ? (*waves)[c] : 0.0));
    gain.total += gain.by_capture.back();
  }
  return gain;
}

/// An image over its variance, and one over that; images add up.
class WeightedSum {
 public:
  WeightedSum() = default;
  WeightedSum(const Image<float>& image, const Image<float>& variance)
      : sum_(image.width(), image.height()), weight_(image.width(), image.height()) {
    for (std::size_t i = 0; i < image.size(); ++i) {
      if (!std::isfinite(image[i])) continue;
      weight_[i] = 1.0 / static_cast<double>(variance[i]);
      sum_[i] = weight_[i] * static_cast<double>(image[i]);
    }
  }
  void add(const WeightedSum& more) {
    if (sum_.empty()) sum_ = Image<double>(more.width(), more.height()), weight_ = sum_;
    for (std::size_t i = 0; i < sum_.size(); ++i) sum_[i] += more.sum_[i], weight_[i] += more.weight_[i];
  }
  [[nodiscard]] int width() const { return sum_.width(); }
  [[nodiscard]] int height() const { return sum_.height(); }
  /// The square of a block's mean in standard deviations; none without a pixel.
  [[nodiscard]] std::optional<double> energyOf(int left, int top, int block_width, int block_height) const {
    double sum = 0.0, weight = 0.0;
    for (int y = top; y < std::min(height(), top + block_height); ++y)
      for (int x = left; x < std::min(width(), left + block_width); ++x) sum += sum_(x, y), weight += weight_(x, y);
    return weight > 0.0 ? std::optional{sum * sum / weight} : std::nullopt;
  }

 private:
  Image<double> sum_, weight_;
};

/// χ² of blocks' means.
struct BlockSum {
  double energy = 0.0, blocks = 0.0;

  void add(const WeightedSum& image, int block_width, int block_height) {
    for (int top = 0; top < image.height(); top += block_height) {
      for (int left = 0; left < image.width(); left += block_width) {
        if (const auto one = image.energyOf(left, top, block_width, block_height)) energy += *one, blocks += 1.0;
      }
    }
  }
  [[nodiscard]] double deviations() const { return blocks > 0.0 ? (energy - blocks) / std::sqrt(2.0 * blocks) : 0.0; }
};

/// The effect under another of its names.
void rename(Effect& effect, const Alternative& to) {
  effect.name = to.name, effect.covariates = to.covariates, effect.is_catalogue = true;
  effect.fit = to.named, effect.numbers = to.named->numbers;
  effect.stage = discover::stageOf(campaignFitOf(*to.named).effect);
  effect.parts.clear(), effect.coefficient.clear();
  effect.gain.mean -= to.worse.mean;
}

}  // namespace

Result<std::optional<RawWitness>> RawWitness::of(const JudgedCampaign& judged) {
  const Lit& lit = judged.lit;
  if (lit.captures.empty() ||
      std::ranges::any_of(lit.captures, [](const MeasuredCapture& one) { return !one.raw.has_value(); }))
    return std::optional<RawWitness>{};
  auto declared = NoiselessCamera::make(judged.declared.model, declaredEffects(judged.declared), lit.captures);
  if (!declared) return declared.error();
  const RawReading simulated = declared->readRaw(lit.captures.front(), lit.traced.front()->light);
  const RepeatedRaw& measured = *lit.captures.front().raw;
  const bool is_same = simulated.closures.size() == measured.closures.size() &&
                       std::abs(simulated.period_m - measured.period_m) < 1e-3 * measured.period_m;
  if (!is_same) return std::optional<RawWitness>{};
  return std::optional{RawWitness{judged, *std::move(declared)}};
}

RawWitness::RawWitness(const JudgedCampaign& judged, NoiselessCamera declared)
    : judged_(&judged), declared_(std::move(declared)), declared_raw_(judged.lit.captures.size()) {
  const Lit& lit = judged.lit;
  sim::inParallel(static_cast<int>(lit.captures.size()), 1, [&](int first, int last) {
    for (auto c = static_cast<std::size_t>(first); c < static_cast<std::size_t>(last); ++c)
      declared_raw_[c] = {declared_.readRaw(lit.captures[c], lit.traced[c]->light),
                          declared_.readRaw(lit.captures[c], *lit.varied[c])};
  });
}

RawWitness::Simulated RawWitness::simulated(std::size_t c, const NoiselessCamera& camera) const {
  return {declared_raw_[c].traced, declared_raw_[c].varied,
          camera.readRaw(judged_->lit.captures[c], *judged_->lit.varied[c])};
}

/// Of what is left of a capture's waves, as WhitenedCapture wants it: a simulation whose range is off the measured one
/// by what is left of the raw exposures' phase.
Reading RawWitness::asRangeLeft(const MeasuredCapture& capture, const Simulated& raw, Reading simulated) {
  for (std::size_t i = 0; i < simulated.range_m.size(); ++i) {
    const double period_m = raw.traced.period_m;
    const float left = capture.raw->range_m.mean[i] - raw.traced.range_m[i] -
                       nearestRange(raw.to.range_m[i] - raw.from.range_m[i], 0.0F, period_m);
    simulated.range_m[i] = capture.range_m.mean[i] - nearestRange(left, 0.0F, period_m);
  }
  return simulated;
}

std::vector<RawWitness::Closure> RawWitness::closuresLeft(std::size_t c, const Simulated& raw) const {
  const auto& [traced, from, to] = raw;
  const MeasuredCapture& capture = judged_->lit.captures[c];
  const TracedCapture& light = *judged_->lit.traced[c];
  std::vector<Closure> all;
  for (std::size_t k = 0; k < capture.raw->closures.size(); ++k) {
    if (traced.closures[k].empty()) continue;  // light that is not modulated
    const Repeated& measured = capture.raw->closures[k];
    Closure closure{measured.mean, measured.variance};
    for (std::size_t i = 0; i < closure.left.size(); ++i) {
      const float change = to.closures[k][i] - from.closures[k][i];
      closure.left[i] -= traced.closures[k][i] + change;
      closure.variance[i] = closure.variance[i] * static_cast<float>(measured.clumping) +
                            static_cast<float>(kLeastClosure * kLeastClosure);
      const bool counts = light.is_edge[i] == 0 && std::isfinite(capture.range_m.mean[i] + closure.variance[i]) &&
                          std::abs(change) < kMostClosure && std::abs(traced.closures[k][i]) < kMostClosure;
      if (!counts) closure.left[i] = kNaN;
    }
    all.push_back(std::move(closure));
  }
  return all;
}

Result<RawWitness::Left> RawWitness::leftBy(const std::vector<sim::AnyEffect>& effects) const {
  const Lit& lit = judged_->lit;
  const auto here = NoiselessCamera::make(judged_->declared.model, effects, lit.captures);
  if (!here) return here.error();
  const std::vector<std::size_t> stands = standsOf(lit.captures);
  Evidence evidence{commonGroups(), std::vector<CaptureEvidence>(lit.captures.size())};
  std::vector<double> closures(lit.captures.size());
  sim::inParallel(static_cast<int>(lit.captures.size()), 1, [&](int first, int last) {
    for (auto c = static_cast<std::size_t>(first); c < static_cast<std::size_t>(last); ++c) {
      const MeasuredCapture& capture = lit.captures[c];
      const TracedCapture& traced = *lit.traced[c];
      const sim::Light& varied = *lit.varied[c];
      const Simulated raw = simulated(c, *here);
      const Cells cells{capture, traced, declared_.read(capture, traced.light), judged_->most_cells};
      WhitenedCapture whitened{cells, kCommon};
      whitened.putCommon(cells, traced);
      whitened.putResidual(cells, capture, traced,
                           asRangeLeft(capture, raw, readingOf(declared_, *here, capture, traced.light, varied)));
      evidence.captures[c] = whitened.evidence(capture.record.name, capture.record.block);
      for (const Closure& closure : closuresLeft(c, raw)) {
        for (std::size_t i = 0; i < closure.left.size(); ++i) {
          const auto left = static_cast<double>(closure.left[i]);
          if (std::isfinite(left)) closures[c] += left * left / static_cast<double>(closure.variance[i]);
        }
      }
    }
  });
  evidence.captures = joined(std::move(evidence.captures), stands);
  Left left{energiesOf(marginalise(evidence, judged_->scales)), {}};
  left.closures.assign(left.waves.size(), 0.0);
  for (std::size_t c = 0; c < closures.size(); ++c) left.closures[stands[c]] += closures[c];
  return left;
}

std::vector<sim::AnyEffect> RawWitness::listWith(const std::vector<Effect>& effects, std::size_t which,
                                                 const NamedFit* fit) const {
  auto list = declaredEffects(judged_->declared);
  for (std::size_t i = 0; i < effects.size(); ++i) {
    const NamedFit* one = i == which ? fit : effects[i].fit.get();
    if (one != nullptr) list = withInserted(std::move(list), campaignFitOf(*one).effect);
  }
  return list;
}

Result<> RawWitness::chooseNames(std::vector<Effect>& effects) const {
  constexpr double kClear = 9.0, kHundredth = 0.01, kErrors = 2.0;
  for (std::size_t e = 0; e < effects.size(); ++e) {
    Effect& effect = effects[e];
    if (effect.alternatives.empty()) continue;
    struct Name {
      const NamedFit* fit;
      Left left;
    };
    std::vector<Name> names{{effect.fit.get(), {}}};  // the chosen one, then its alternatives
    for (const Alternative& other : effect.alternatives) names.push_back({other.named.get(), {}});
    if (std::ranges::none_of(names, [](const Name& one) { return one.fit != nullptr; })) continue;
    for (Name& one : names) {
      auto left = leftBy(listWith(effects, e, one.fit));
      if (!left) return left.error();
      one.left = *std::move(left);
    }
    const auto isContradictedBy = [&](const Name& one, const Name& by) {
      const bool both = one.fit != nullptr && by.fit != nullptr;
      const auto gain = [&](const Name& of) { return gainOf(of.left.closures, both ? &of.left.waves : nullptr); };
      const Difference better = difference(gain(by), gain(one));
      return better.mean > std::max({kClear, kErrors * better.error, kHundredth * effect.gain.mean});
    };
    std::vector<bool> is_out(names.size());
    for (std::size_t i = 0; i < names.size(); ++i)
      is_out[i] = std::ranges::any_of(names, [&](const Name& by) { return isContradictedBy(names[i], by); });
    if (is_out[0]) {
      // The best name that is left takes its place. A curve would have to be fitted anew: where there is none, all
      // stays as it is.
      std::size_t heir = 1;
      while (heir < names.size() && (is_out[heir] || names[heir].fit == nullptr)) ++heir;
      if (heir == names.size()) continue;
      effect.refused.push_back(effect.name + ": the raw exposures contradict it");
      rename(effect, effect.alternatives[heir - 1]);
      is_out[heir] = true;  // no alternative to itself
    }
    std::vector<Alternative> left;
    for (std::size_t i = 1; i < names.size(); ++i)
      if (!is_out[i]) left.push_back(std::move(effect.alternatives[i - 1]));
    effect.alternatives = std::move(left);
    if (effect.alternatives.empty()) effect.experiment.reset();
  }
  return {};
}

Result<std::vector<std::optional<Difference>>> RawWitness::sharesBeforeDecoding(const Effects& without,
                                                                                const std::vector<Effects>& with,
                                                                                const Effects& all) const {
  const Lit& lit = judged_->lit;
  std::vector<NoiselessCamera> cameras;  // without, with all, then with each
  std::vector<const Effects*> lists{&without, &all};
  for (const Effects& one : with) lists.push_back(&one);
  for (const Effects* list : lists) {
    auto camera = NoiselessCamera::make(judged_->declared.model, *list, lit.captures);
    if (!camera) return camera.error();
    cameras.push_back(*std::move(camera));
  }
  Evidence evidence{commonGroups(), std::vector<CaptureEvidence>(lit.captures.size())};
  for (std::size_t e = 0; e < with.size(); ++e)
    evidence.groups.push_back(
        {.name = "share", .kind = Kind::Generic, .first = kCommon + e, .count = 1, .numbers = 1});
  sim::inParallel(static_cast<int>(lit.captures.size()), 1, [&](int first, int last) {
    for (auto c = static_cast<std::size_t>(first); c < static_cast<std::size_t>(last); ++c) {
      const MeasuredCapture& capture = lit.captures[c];
      const TracedCapture& traced = *lit.traced[c];
      const sim::Light& varied = *lit.varied[c];
      const Cells cells{capture, traced, declared_.read(capture, traced.light), judged_->most_cells};
      WhitenedCapture whitened{cells, kCommon + with.size()};
      whitened.putCommon(cells, traced);
      whitened.putResidual(cells, capture, traced,
                           asRangeLeft(capture, simulated(c, cameras[0]),
                                       readingOf(declared_, cameras[1], capture, traced.light, varied)));
      const Reading read = cameras[0].read(capture, varied);
      for (std::size_t e = 0; e < with.size(); ++e)
        whitened.putChange(cells, kCommon + e, read,
                           {cameras[2 + e].read(capture, varied).range_m, read.log_amplitude});
      evidence.captures[c] = whitened.evidence(capture.record.name, capture.record.block);
    }
  });
  evidence.captures = joined(std::move(evidence.captures), standsOf(lit.captures));
  const Marginal marginal = marginalise(evidence, judged_->scales);
  Columns columns = nuisanceColumns(marginal);
  const auto first = static_cast<Eigen::Index>(columns.size());
  for (const Group& group : marginal.groups)
    if (group.kind == Kind::Generic) append(columns, group);
  const Fit fitted = fit(marginal, columns);
  std::vector<std::optional<Difference>> shares(with.size());
  for (std::size_t e = 0; e < with.size(); ++e) {
    const Eigen::Index at = first + static_cast<Eigen::Index>(e);
    const double variance = fitted.inverse(at, at) * std::max(1.0, fitted.dispersion());
    if (variance > 0.0) shares[e] = Difference{fitted.coefficient[at], std::sqrt(variance)};
  }
  return shares;
}

Result<double> RawWitness::contradiction(const std::vector<sim::AnyEffect>& effects) const {
  const Lit& lit = judged_->lit;
  const auto here = NoiselessCamera::make(judged_->declared.model, effects, lit.captures);
  if (!here) return here.error();
  BlockSum twelfths, columns;
  std::vector<WeightedSum> over_all;  // each closure's image over all captures
  for (std::size_t c = 0; c < lit.captures.size(); ++c) {
    const auto closures = closuresLeft(c, simulated(c, *here));
    over_all.resize(closures.size());
    for (std::size_t k = 0; k < closures.size(); ++k) {
      const WeightedSum one{closures[k].left, closures[k].variance};
      twelfths.add(one, (one.width() + 3) / 4, (one.height() + 2) / 3);
      columns.add(one, 1, one.height());
      over_all[k].add(one);
    }
  }
  BlockSum columns_of_all, pixels_of_all;
  for (const WeightedSum& one : over_all) columns_of_all.add(one, 1, one.height()), pixels_of_all.add(one, 1, 1);
  return std::max({twelfths.deviations(), columns.deviations(), columns_of_all.deviations(),
                   pixels_of_all.deviations()});
}

}  // namespace toftwin::discover
