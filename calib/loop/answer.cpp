// SPDX-License-Identifier: Apache-2.0
#include "calib/loop/answer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include <fmt/format.h>

#include "calib/compare/report.h"
#include "calib/loop/written_model.h"
#include "protocol/types/counted.h"

namespace toftwin::loop {
namespace {

/// What is left counts as noise where it is at most this much above it: two standard errors of a deviation from 150 rows.
constexpr double kAsNoise = 1.12;

std::string shown(double value) {
  const double size = std::abs(value);
  return compare::shown(value, size >= 100.0 ? 0 : size >= 10.0 ? 1 : size >= 1.0 ? 2 : 3);
}
std::string percent(double share) { return compare::shown(100.0 * share, std::abs(share) >= 0.1 ? 1 : 2) + " %"; }

std::string joined(const std::vector<std::string>& parts, const std::string& last = " and ") {
  std::string all;
  for (std::size_t i = 0; i < parts.size(); ++i) all += (i == 0 ? "" : i + 1 == parts.size() ? last : ", ") + parts[i];
  return all;
}

const Covariate* covariateOf(const Discovery& d, const std::string& name) { return d.open.evidence.find(name); }

/// From the least to the largest, without the rows' extreme hundredth.
std::pair<double, double> spanOf(const Eigen::VectorXd& curve) {
  std::vector<double> sorted(curve.begin(), curve.end());
  std::ranges::sort(sorted);
  const auto at = [&](double share) { return sorted[static_cast<std::size_t>(share * static_cast<double>(sorted.size() - 1))]; };
  return {at(0.005), at(0.995)};
}

// ---- One effect ----------------------------------------------------------------------------------------------------

/// "whole", "half", "third", or how often it goes into the nearest known period.
std::string partWord(const Covariate& c, double length) {
  static constexpr std::array<std::string_view, 9> kWords{"", "whole", "half", "third", "quarter", "fifth", "sixth", "seventh", "eighth"};
  for (const double period : c.periods)
    for (std::size_t k = 1; k < kWords.size(); ++k)
      if (std::abs(length * static_cast<double>(k) - period) < 1e-6 * period) return std::string{kWords[k]};
  return "part";
}

/// What a coefficient of a single part says: "wave of 1409 mm, ±3.2 mm".
std::string partText(const Discovery& d, const Effect& effect, const Family& family, const double* inner, const double* c) {
  const std::string& unit = d.readings.unit;
  const Covariate* covariate = covariateOf(d, effect.shape.covariates.front());
  const std::string of = covariate ? covariate->unit : "";
  const auto at = [&](double x) { return quantityText(x, of); };
  if (family.name == "straight line") return fmt::format("{} per {}", quantityText(c[0], unit), of.empty() ? "unit" : of);
  if (family.name == "power") return fmt::format("proportional to its power {}", shown(inner[0]));
  if (family.name == "decay") return fmt::format("a decay of {} with a time constant of {}", quantityText(c[0] * std::exp(-covariate->low() / inner[0]), unit), at(inner[0]));
  if (family.name == "two decays")
    return fmt::format("decays of {} and {} with constants of {} and {}", quantityText(c[0] * std::exp(-covariate->low() / inner[0]), unit),
                       quantityText(c[1] * std::exp(-covariate->low() / inner[1]), unit), at(inner[0]), at(inner[1]));
  if (family.name == "step") return fmt::format("a step of {} at {}", quantityText(c[0], unit), at(inner[0]));
  if (family.name == "sigmoid") return fmt::format("a smooth step of {} at {}", quantityText(c[0], unit), at(inner[0]));
  if (family.name == "hinge") return fmt::format("from {} on {} per {}", at(inner[0]), quantityText(c[0], unit), of.empty() ? "unit" : of);
  if (family.name == "bump") return fmt::format("a bump of {} at {}", quantityText(c[0], unit), at(inner[0]));
  if (family.name == "harmonic")
    return fmt::format("a wave of {}, a {} of the unambiguous range, with an amplitude of {}", at(inner[0]), partWord(*covariate, inner[0]), quantityText(std::hypot(c[0], c[1]), unit));
  if (family.name == "wave") return fmt::format("a wave of {} with an amplitude of {}", at(inner[0]), quantityText(std::hypot(c[0], c[1]), unit));
  if (family.name == "sawtooth") return fmt::format("a sawtooth of {} with {} a period", at(inner[0]), quantityText(c[0], unit));
  if (family.name == "repeating classes") return fmt::format("it repeats every {}", shown(inner[0]));
  return std::string{family.name};
}

/// How many coefficients a family has, by what its shape has of columns in all.
std::size_t columnsOfFamily(const Discovery& d, const Effect& effect, const Family& family, const Inner& inner) {
  std::vector<const Covariate*> arguments;
  for (const std::string& name : effect.shape.covariates) arguments.push_back(covariateOf(d, name));
  return family.make(arguments, inner).size();
}

std::string partsText(const Discovery& d, const Effect& effect) {
  std::vector<std::string> parts;
  std::size_t column = 0;
  for (const Part& part : partsOf(effect.shape)) {
    parts.push_back(partText(d, effect, *part.family, part.inner.data(), effect.coefficient.data() + column));
    column += columnsOfFamily(d, effect, *part.family, part.inner);
  }
  return joined(parts);
}

/// An error that is proportional to a speed is a time.
std::string latencyText(const Discovery& d, const Effect& effect) {
  const Covariate* covariate = covariateOf(d, effect.shape.covariates.front());
  if (!covariate || effect.shape.name() != "straight line" || d.readings.unit != "mm") return {};
  const bool per_second = covariate->unit == "m/s" || covariate->unit == "m_per_s" || covariate->name.find("m_per_s") != std::string::npos;
  const bool mm_per_second = covariate->name.find("mm_per_s") != std::string::npos || covariate->unit == "mm/s";
  if (!per_second && !mm_per_second) return {};
  const double ms = std::abs(effect.coefficient[0]) * (mm_per_second ? 1000.0 : 1.0);
  return fmt::format("a latency of {} ms", shown(ms));
}

/// Offsets of names: each by its name, if they are few.
std::string levelsText(const Discovery& d, const Effect& effect) {
  const Covariate* names = covariateOf(d, effect.shape.covariates.front());
  const Eigen::VectorXd curve = columnsOf(d.open.evidence, effect.shape.columns) * effect.coefficient;
  double constant = 0.0;
  for (const LearnedEffect& learned : d.model.effects)
    if (learned.role == "constant") constant = learned.terms.front().coefficient;
  std::vector<std::string> each;
  for (std::size_t k = 0; k < names->words.size() && each.size() < 12; ++k) {
    for (Eigen::Index i = 0; i < curve.size(); ++i) {
      if (names->x[i] != static_cast<double>(k)) continue;
      each.push_back(fmt::format("{} {}", names->words[k], quantityText(curve[i] + constant, d.readings.unit)));
      break;
    }
  }
  return "an offset for each: " + joined(each, ", ");
}

std::string seriesText(const Discovery& d, const Effect& effect) {
  std::vector<std::string> parts;
  for (std::size_t i = 0; i < effect.shape.inner.size(); ++i) {
    const auto line = static_cast<std::size_t>(std::ceil(effect.shape.inner[i]));
    // Among lines that were locked or set aside the first may be some lines off.
    const bool begins = std::ranges::any_of(d.all.begins, [&](std::size_t b) { return std::max(b, line) - std::min(b, line) <= 1 + d.open.row.size() / 40; });
    parts.push_back(fmt::format("from line {} on{} the error is {} {}", line, begins ? ", where the reference begins anew," : "",
                                quantityText(std::abs(effect.coefficient[static_cast<Eigen::Index>(i)]), d.readings.unit),
                                effect.coefficient[static_cast<Eigen::Index>(i)] > 0.0 ? "higher" : "lower"));
  }
  return "A new series begins: " + joined(parts) + ".";
}

/// Names of the effects that are told together, in the order they are told; of the first `count` of them.
std::string namesOf(const Discovery& d, const Told& told, std::size_t count) {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < count; ++i) names.push_back(joined(headersOf(d.readings, d.mean.effects[told.with[i]].shape.covariates), " with "));
  return joined(names);
}

/// Of effects that take each other back: the sum, and what this one says beside those before it.
std::string sharedText(const Discovery& d, const Told& told, const Effect& effect, const std::string& chance) {
  const std::string& unit = d.readings.unit;
  const auto [low, high] = spanOf(told.curve);
  const auto place = static_cast<std::size_t>(std::ranges::find(told.with, static_cast<std::size_t>(&effect - d.mean.effects.data())) - told.with.begin());
  const std::string name = joined(headersOf(d.readings, effect.shape.covariates), " with ");
  const std::string own = fmt::format("from {} to {}", quantityText(low, unit), quantityText(high, unit));
  if (place > 0) return fmt::format("{}: beside {} it says {} more {}.", name, namesOf(d, told, place), own, chance);
  const auto [least, largest] = spanOf(told.sum);
  return fmt::format("{}: {} together from {} to {} about their mean, of which {} alone says {} {}.", name, namesOf(d, told, told.with.size()), quantityText(least, unit),
                     quantityText(largest, unit), name, own, chance);
}

std::string takenBackText(const Discovery& d, const Told& told) {
  return fmt::format("{} change together: their terms are larger than what they say and take each other back. Only their sum is known{}; to tell them apart, change one while the others stay.",
                     namesOf(d, told, told.with.size()), told.joint > 0.0 ? fmt::format(", of which {} (RMS) is of none alone", quantityText(told.joint, d.readings.unit)) : "");
}

// ---- The whole -----------------------------------------------------------------------------------------------------

/// The offset at the mean reference: what a gain leaves of it there.
double offsetOf(const Discovery& d) { return d.open.evidence.y.mean(); }

/// Whether rows in which all columns are equal are repeats: where they scatter much more than neighbours do, something that no
/// column says differs between them.
bool hasRepeats(const Discovery& d) { return d.repeats.deviation > 0.0 && d.repeats.deviation < 1.3 * d.noise; }
double noiseOf(const Discovery& d) { return hasRepeats(d) ? d.repeats.deviation : d.noise; }
std::string noiseText(const Discovery& d) {
  return fmt::format("{} scatter by {}", hasRepeats(d) ? "repeats" : "neighbouring rows", quantityText(noiseOf(d), d.readings.unit));
}

/// What was found does not hold where it was not fitted: that comes first, and nothing is said to be explained.
std::string notWrittenText(const Discovery& d, const Ladder& ladder, std::vector<std::string> parts, const std::vector<std::string>& names) {
  const std::string& unit = d.readings.unit;
  if (!names.empty()) parts.push_back("curves over " + joined(names));
  return fmt::format("No model is written: with {} {} (RMS) are left on rows that were not used, without any model {}; {}.", parts.empty() ? "a constant" : joined(parts),
                     quantityText(ladder.last(), unit), quantityText(ladder.first(), unit), noiseText(d));
}

std::string headlineOf(const Discovery& d, Answer::Tone tone) {
  const std::string& unit = d.readings.unit;
  const Ladder& ladder = d.unseen.rows > 0 ? d.unseen : d.seen;
  std::vector<std::string> rungs;
  if (ladder.has_truth && std::abs(offsetOf(d)) > 0.3 * ladder.last()) rungs.push_back(quantityText(offsetOf(d), unit) + " constant");
  for (const Effect& effect : d.mean.effects)
    if (isGain(d, effect)) rungs.push_back(percent(effect.coefficient[0]) + " gain");
  const auto count = static_cast<std::size_t>(std::ranges::count_if(d.mean.effects, [&](const Effect& e) { return isSeries(e); }));
  if (count > 0 || d.has_group_offsets) rungs.emplace_back(count > 0 ? "series that begin anew in the file" : "offsets of " + groupColumn(d.readings));
  std::vector<std::string> names;
  for (const Effect& effect : d.mean.effects) {
    if (isSeries(effect) || isGain(d, effect)) continue;
    const auto of = headersOf(d.readings, effect.shape.covariates);
    names.push_back(joined(of, " with "));
  }
  if (!d.is_written && tone != Answer::Tone::Good) return notWrittenText(d, ladder, rungs, names);
  if (!names.empty()) rungs.push_back("what goes with " + joined(names));
  std::string text = ladder.has_truth ? fmt::format("{} raw (RMS)", quantityText(ladder.first(), unit)) : fmt::format("Readings scatter by {}", quantityText(ladder.first(), unit));
  if (tone == Answer::Tone::Good) return text + ": as much as rows scatter by; nothing else is found.";
  text += rungs.empty() ? ": nothing that was tried explains any of it" : ": " + joined(rungs, ", ");
  text += fmt::format("; {} left, {}.", quantityText(ladder.last(), unit), noiseText(d));
  return text;
}

std::vector<std::string> readingsOf(const Discovery& d) {
  std::vector<std::string> out;
  const std::string& unit = d.readings.unit;
  for (const NoReadings& kind : d.no_readings) {
    std::string lines;
    for (std::size_t i = 0; i < kind.rows.size() && i < 5; ++i)
      lines += (i > 0 ? ", " : "") + std::to_string(d.readings.line[d.all.row[static_cast<std::size_t>(kind.rows[i])]]);
    if (kind.rows.size() > 5) lines += " …";
    const std::string rows = counted(kind.rows.size(), "reading");
    const std::string verb = kind.rows.size() == 1 ? "is" : "are";
    switch (kind.kind) {
      case NoReading::Stuck:
        out.push_back(fmt::format("{} {} stuck at {} to {} whatever the reference: set aside (lines {}).", rows, verb, quantityText(kind.low, unit), quantityText(kind.high, unit), lines));
        break;
      case NoReading::Wrapped:
        out.push_back(fmt::format("{} {} too short by {}: they have wrapped, and are set aside (lines {}).", rows, verb, quantityText(kind.low, unit), lines));
        break;
      case NoReading::Jumped:
        out.push_back(fmt::format("{} {} by about {} {}, which no tail of noise does: set aside (lines {}).", rows, kind.rows.size() == 1 ? "jumps" : "jump", quantityText(0.5 * (kind.low + kind.high), unit),
                                  kind.side == 0 ? "to either side" : kind.side > 0 ? "upwards" : "downwards", lines));
        break;
      default:
        out.push_back(fmt::format("{} {} off by {} to {}, far from all others: set aside (lines {}).", rows, verb, quantityText(kind.low, unit), quantityText(kind.high, unit), lines));
    }
  }
  if (d.share)
    for (const Effect& effect : d.share->effects) {
      const auto [low, high] = spanOf(columnsOf(d.all.evidence, effect.shape.columns) * effect.coefficient);
      out.push_back(fmt::format("Their share goes with {}: it changes by {} % (p = {:.4f}).", headerOf(d.readings, effect.shape.covariates.front()), shown(high - low), effect.p));
    }
  for (const table::SetAside& aside : d.readings.aside) {
    if (out.size() >= 12) break;
    out.push_back(fmt::format("Line {}{}: {}.", aside.line, aside.column.empty() ? "" : ", " + aside.column, aside.why));
  }
  for (const Effect& effect : d.spread.effects) {
    const auto [low, high] = spanOf(columnsOf(d.open.evidence, effect.shape.columns) * effect.coefficient);
    const auto of = headersOf(d.readings, effect.shape.covariates);
    out.push_back(fmt::format("The noise goes with {}: it grows {}-fold from its least to its largest (p = {:.4f}).", joined(of, " with "), shown(std::exp(high - low)), effect.p));
  }
  return out;
}

/// Where the reference begins anew, whether or not the errors differ there, and what that says of all that is left.
std::string overlapText(const Discovery& d) {
  std::vector<std::string> lines;
  for (const std::size_t begin : d.all.begins) lines.push_back(std::to_string(begin));
  const std::string& unit = d.readings.unit;
  const Overlap& overlap = *d.overlap;
  return fmt::format("The reference begins anew at line {}: {} series. Where they have the same {} (to {}, {}), a later one reads {} {} in the mean, and row by row "
                     "they differ by {} more: no function of these columns leaves less than {} there.",
                     joined(lines), lines.size() + 1, d.readings.reference_name.empty() ? "reference" : d.readings.reference_name, quantityText(overlap.apart, unit),
                     counted(overlap.rows, "row"), quantityText(std::abs(overlap.mean), unit), overlap.mean < 0.0 ? "lower" : "higher",
                     quantityText(overlap.deviation, unit), quantityText(overlap.least(), unit));
}

std::vector<std::string> cautionsOf(const Discovery& d) {
  std::vector<std::string> out;
  if (d.overlap && !d.all.begins.empty()) out.push_back(overlapText(d));
  if (!d.seen.has_truth) out.emplace_back("The table has no reference: what is constant, and a gain, cannot be known. Add a column of the true value.");
  for (const Effect& effect : d.mean.effects) {
    const Covariate* c = covariateOf(d, effect.shape.covariates.front());
    if (c && c->goes_with_lines && !c->is_order && d.readings.reference_name.empty() == false && c->nature != table::Nature::Time)
      out.push_back(fmt::format("The rows stand in the order of {}: an error that wanders in time would look alike. On blocks of rows that were not used {} become {}. Measure in random order to tell.",
                                headerOf(d.readings, c->name), quantityText(d.unseen.steps.size() > 1 ? d.unseen.steps[1].rms : d.unseen.first(), d.readings.unit), quantityText(d.unseen.last(), d.readings.unit)));
    for (const Alternative& other : effect.alternatives) {
      const auto of = headersOf(d.readings, other.covariates), own = headersOf(d.readings, effect.shape.covariates);
      out.push_back(fmt::format("{} would explain it as well as {} (r = {:.2f}): change one while the other stays.", joined(of, " with "), joined(own, " with "), other.correlation));
    }
    if (effect.rests_on > 0)
      out.push_back(fmt::format("{} changes only between {}s: what is said of it rests on {} of them.", headerOf(d.readings, effect.shape.covariates.front()),
                                groupColumn(d.readings), effect.rests_on));
  }
  for (const Told& told : d.told)
    if (!told.with.empty() && &told == &d.told[told.with.front()]) out.push_back(takenBackText(d, told));
  for (const Score& score : d.mean.unexplained) {
    const auto of = headersOf(d.readings, score.covariates);
    out.push_back(fmt::format("Something goes with {} (it stands out by {} deviations), but none of the shapes tried predicts rows that were not used.", joined(of, " with "), shown(score.deviate)));
  }
  if (!d.is_written) out.emplace_back("The model leaves more on rows that were not used than no model at all: no file is written.");
  // What two effects share is said once.
  std::vector<std::string> each;
  for (std::string& one : out)
    if (std::ranges::find(each, one) == each.end()) each.push_back(std::move(one));
  return each;
}

}  // namespace

std::string quantityText(double value, const std::string& unit) {
  return shown(value) + (unit.empty() ? "" : " " + unit);
}

Eigen::VectorXd curveOf(const Discovery& d, const Effect& effect) {
  if (const Told* told = toldOf(d, effect)) return told->curve;
  const Eigen::VectorXd curve = columnsOf(d.open.evidence, effect.shape.columns) * effect.coefficient;
  return curve.array() - curve.mean();
}

const Told* toldOf(const Discovery& d, const Effect& effect) {
  const std::less<> isBefore;
  const Effect* const first = d.mean.effects.data();
  const bool is_of_mean = !isBefore(&effect, first) && isBefore(&effect, first + d.mean.effects.size());
  const auto at = is_of_mean ? static_cast<std::size_t>(&effect - first) : d.told.size();
  return at < d.told.size() ? &d.told[at] : nullptr;
}

std::string sentenceOf(const Discovery& d, const Effect& effect) {
  if (isSeries(effect)) return seriesText(d, effect);
  const auto of = headersOf(d.readings, effect.shape.covariates);
  const auto [low, high] = spanOf(curveOf(d, effect));
  const std::string chance = fmt::format("(p {} {:.4f})", effect.p <= 0.0025 ? "≤" : "=", std::max(effect.p, 0.0001));
  if (const Told* told = toldOf(d, effect); told && !told->with.empty()) return sharedText(d, *told, effect, chance);
  std::string what;
  if (isGain(d, effect)) what = fmt::format("a gain of {}", percent(effect.coefficient[0]));
  else if (effect.shape.name() == "levels") what = levelsText(d, effect);
  else if (const std::string latency = latencyText(d, effect); !latency.empty()) what = fmt::format("{} ({})", latency, partsText(d, effect));
  else what = partsText(d, effect);
  return fmt::format("{}: {}; from {} to {} about its mean {}.", joined(of, " with "), what, quantityText(low, d.readings.unit), quantityText(high, d.readings.unit), chance);
}

namespace {

/// Of squares: a share of 96 % leaves a fifth of the RMS.
std::string removedText(const Discovery& d) {
  if (!d.removed.is_known || d.mean.effects.empty()) return {};
  const auto whole = [](double share) { return compare::shown(100.0 * std::min(share, 1.0), share > 0.99 ? 1 : 0); };
  return fmt::format("Of what is there beside a constant and the noise the model takes off {} % of the squares (95 % interval: {} to {} %).", whole(d.removed.share),
                     whole(d.removed.low), whole(d.removed.high));
}

}  // namespace

Answer answerOf(const Discovery& d) {
  Answer answer;
  const Ladder& ladder = d.unseen.rows > 0 ? d.unseen : d.seen;
  const double noise = noiseOf(d);
  const bool finds_nothing = d.mean.effects.empty() && !d.has_group_offsets && d.mean.unexplained.empty();
  // What stands out and predicts nothing is as open as what no shape was found for.
  if (!d.mean.unexplained.empty() || (!d.is_written && !d.mean.effects.empty())) answer.tone = Answer::Tone::Open;
  else if (finds_nothing && ladder.has_truth && ladder.first() <= kAsNoise * noise) answer.tone = Answer::Tone::Good;
  answer.headline = headlineOf(d, answer.tone);
  answer.removed = removedText(d);
  for (const Effect& effect : d.mean.effects) answer.effects.push_back((d.is_written ? "" : "Not written: ") + sentenceOf(d, effect));
  answer.readings = readingsOf(d);
  answer.cautions = cautionsOf(d);
  return answer;
}

}  // namespace toftwin::loop
