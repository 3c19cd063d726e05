// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/campaign_score.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <map>
#include <set>
#include <tuple>

#include <toftwin/nan.h>

#include "calib/compare/statistics.h"
#include "calib/discover/campaign/captures/catalogue.h"
#include "calib/discover/campaign/rows/covariates.h"
#include "calib/discover/campaign/rows/refit.h"
#include "calib/discover/campaign/rows/unequal_exposures.h"

namespace toftwin::discover::bench {
namespace {

/// Whether all that a formula or curve goes with is what the effect goes with.
bool goesWith(const std::vector<std::string>& covariates, const sim::AnyEffect& hidden) {
  const auto words = covariatesOf(hidden);
  bool has_any = false;
  for (const std::string& name : covariates) {
    if (name == "gain" || name == "delay") continue;  // what light does, no covariate
    const bool is_of_exposures = name == kUnequalCarrier || name == kAmplifiedCarrier;
    if (is_of_exposures && !std::holds_alternative<sim::SampleGain>(hidden) &&
        !std::holds_alternative<sim::StepPhase>(hidden))
      return false;  // two cycles per turn, from another cause
    if (std::ranges::find(words, wordOf(name)) == words.end()) return false;
    has_any = true;
  }
  return has_any;
}

bool isOfCatalogue(const Alternative& other) { return other.group.terms.empty(); }

/// What one of the found effects may be: itself and what these data do not tell from it.
struct Answer {
  bool has_undeclared = false, has_name = false, has_covariates = false;
};
Answer answerOf(const Effect& effect, const sim::AnyEffect& hidden, const std::string& name) {
  Answer answer{.has_undeclared = !effect.is_catalogue,
                .has_name = effect.is_catalogue && effect.name == name,
                .has_covariates = !effect.is_catalogue && goesWith(effect.covariates, hidden)};
  for (const Alternative& other : effect.alternatives) {
    if (isOfCatalogue(other)) {
      answer.has_name = answer.has_name || other.name == name;
    } else {
      answer.has_undeclared = true;
      answer.has_covariates = answer.has_covariates || goesWith(other.covariates, hidden);
    }
  }
  return answer;
}

std::vector<std::string> fieldsOf(const std::string& line) {
  std::vector<std::string> fields;
  std::size_t begin = 0;
  for (std::size_t comma; (comma = line.find(',', begin)) != std::string::npos; begin = comma + 1)
    fields.push_back(line.substr(begin, comma - begin));
  fields.push_back(line.substr(begin));
  return fields;
}

constexpr std::size_t kFields = 27;

std::optional<Score> readScore(const std::string& line) {
  const auto fields = fieldsOf(line);
  if (fields.size() < kFields || fields[0] != "score") return std::nullopt;
  const auto number = [&](std::size_t i) { return std::strtod(fields[i].c_str(), nullptr); };
  Score score;
  score.of = {fields[1], number(2), number(3), static_cast<std::uint64_t>(number(4)), number(5) > 0.5};
  score.p = number(6), score.is_detected = number(7) > 0.5, score.is_right = number(8) > 0.5;
  score.is_alone = number(9) > 0.5, score.is_blamed = number(10) > 0.5;
  score.has_covariates = number(11) > 0.5, score.has_stage = number(12) > 0.5;
  score.spurious = static_cast<int>(number(13)), score.rests = static_cast<int>(number(14));
  score.explainable = number(15), score.removed = number(16);
  score.stated = number(17), score.stated_low = number(18), score.stated_high = number(19);
  score.numbers = static_cast<int>(number(20)), score.numbers_in = static_cast<int>(number(21));
  score.before_mm = number(22), score.after_mm = number(23), score.seconds = number(24);
  score.may_have_stage = number(25) > 0.5, score.is_stage_alone = number(26) > 0.5;
  for (std::size_t i = kFields; i < fields.size(); ++i) score.found += (i > kFields ? "," : "") + fields[i];
  return score;
}

double shareOf(const std::vector<Score>& scores, bool Score::*of) {
  const auto count = std::ranges::count_if(scores, [&](const Score& one) { return one.*of; });
  return static_cast<double>(count) / static_cast<double>(scores.size());
}

/// Whether one of the found effects is a set of names that these data do not tell apart.
bool isSet(const Score& score) { return score.found.find(" or ") != std::string::npos; }

std::string rowOf(const std::string& what, const std::vector<Score>& scores, bool is_null, bool is_absent) {
  double spurious = 0.0, rests = 0.0;
  int numbers = 0, numbers_in = 0, stated = 0, stated_in = 0, sets = 0, right_sets = 0, alone = 0, alone_right = 0;
  std::vector<double> removed;
  for (const Score& one : scores) {
    if (!is_null && isSet(one))
      ++sets, right_sets += one.is_right || (is_absent && one.has_covariates) ? 1 : 0;
    if (one.is_stage_alone) ++alone, alone_right += one.has_stage ? 1 : 0;
    spurious += one.spurious, rests += one.rests;
    numbers += one.numbers, numbers_in += one.numbers_in;
    if (!std::isfinite(one.removed)) continue;
    removed.push_back(one.removed);
    if (!std::isfinite(one.stated_low + one.stated_high)) continue;
    ++stated, stated_in += one.removed >= one.stated_low && one.removed <= one.stated_high ? 1 : 0;
  }
  const auto of = [](int in, int all) { return all == 0 ? "" : fmt::format("{} of {}", in, all); };
  const auto n = static_cast<double>(scores.size());
  const auto share = [](double value) { return fmt::format("{:.2f}", value); };
  const bool has_removed = !is_null && !removed.empty();
  return fmt::format("| {} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {:.2f} | {:.2f} | {} | {} | {} | {} |\n",
                     what, scores.size(), fmt::format("{:.3f}", shareOf(scores, &Score::is_detected)),
                     is_null || is_absent ? "" : share(shareOf(scores, &Score::is_right)),
                     is_null || is_absent ? "" : share(shareOf(scores, &Score::is_alone)),
                     is_absent ? share(1.0 - shareOf(scores, &Score::is_blamed)) : "",
                     is_absent ? share(shareOf(scores, &Score::has_covariates)) : "",
                     is_null ? "" : share(shareOf(scores, &Score::has_stage)),
                     is_null ? "" : share(shareOf(scores, &Score::may_have_stage)),
                     is_null ? "" : of(alone_right, alone),
                     of(right_sets, sets),
                     spurious / n, rests / n, has_removed ? share(compare::quantile(removed, 0.5)) : "",
                     has_removed ? share(compare::quantile(removed, 0.1)) : "", of(numbers_in, numbers),
                     of(stated_in, stated));
}

bool isMiss(const Score& one) {
  if (one.of.wanted == 0.0) return one.is_detected;
  return !one.is_detected || one.spurious > 0 || one.is_blamed ||
         (one.of.is_absent ? !one.has_covariates : !one.is_right);
}

/// Whether two effects of one kind are of the same raw exposure, cycle or device: the numbers of others are
/// other numbers. One raw exposure of four that is late is, to first order, the next one that is early by as
/// much.
bool haveSameLabels(const sim::AnyEffect& a, const sim::AnyEffect& b) {
  return std::ranges::all_of(numbersOf(a), [&](const EffectNumber& number) {
    return !number.is_whole || number.value == valueOf(b, number.key);
  });
}

/// Of the effect that was hidden, found by its name.
void countNumbers(const FoundEffect& one, const sim::AnyEffect& hidden, Score& score) {
  if (!one.fitted || one.fitted->effect.index() != hidden.index()) return;
  if (!haveSameLabels(one.fitted->effect, hidden)) return;
  for (const FittedNumber& number : one.fitted->numbers) {
    if (!(number.error > 0.0)) continue;
    ++score.numbers;
    score.numbers_in += std::abs(number.value - valueOf(hidden, number.key)) <= 1.96 * number.error ? 1 : 0;
  }
}

}  // namespace

std::string inWords(const CampaignFinding& finding) {
  std::vector<std::string> words;
  const auto undeclared = [](const std::vector<std::string>& covariates) {
    return fmt::format("f({})", fmt::join(covariates, " "));
  };
  for (const FoundEffect& one : finding.effects) {
    std::string word = one.found.is_catalogue ? one.found.name : undeclared(one.found.covariates);
    for (const Alternative& other : one.found.alternatives)
      word += " or " + (isOfCatalogue(other) ? other.name : undeclared(other.covariates));
    words.push_back(one.found.is_rest ? "(rest: " + word + ")" : std::move(word));
  }
  for (const FittedEffect& one : finding.updates) words.push_back("update " + nameOf(one.effect));
  return words.empty() ? "nothing" : fmt::format("{}", fmt::join(words, " + "));
}

Score scoreOf(const Case& of, const CampaignFinding& finding) {
  Score score{.of = of, .p = finding.leastP(), .removed = kNaN};
  score.is_detected = score.p <= 0.01;
  score.seconds = finding.seconds, score.found = inWords(finding);
  if (const auto& judged = finding.judgement) {
    score.stated = judged->removed;
    score.stated_low = judged->removed_low, score.stated_high = judged->removed_high;
    score.before_mm = judged->before.rms_mm, score.after_mm = judged->after.rms_mm;
  }
  score.spurious = static_cast<int>(finding.updates.size());
  for (const FoundEffect& one : finding.effects) ++score.spurious, score.rests += one.found.is_rest ? 1 : 0;
  return score;
}

Score scoreOf(const Case& of, const sim::AnyEffect& hidden, const Removed& removed,
              const CampaignFinding& finding) {
  Score score = scoreOf(of, finding);
  score.explainable = removed.explainable, score.removed = removed.share;
  bool is_met = false;
  for (const FoundEffect& one : finding.effects) {
    if (one.found.is_rest) continue;
    const Answer answer = answerOf(one.found, hidden, of.hidden);
    const bool is_it = of.is_absent ? answer.has_covariates : answer.has_name || answer.has_covariates;
    score.is_right = score.is_right || answer.has_name;
    score.is_alone = score.is_alone || (one.found.is_catalogue && one.found.name == of.hidden);
    score.has_covariates = score.has_covariates || answer.has_covariates;
    score.is_blamed = score.is_blamed || (!answer.has_name && !answer.has_undeclared);
    if (is_it && !is_met) {
      is_met = true, --score.spurious;
      score.has_stage = one.found.stage == stageOf(hidden);
      score.may_have_stage = score.has_stage || std::ranges::count(one.found.stages_alike, stageOf(hidden)) > 0;
      score.is_stage_alone = !one.found.is_catalogue && one.found.stages_alike.empty();
    }
    countNumbers(one, hidden, score);
  }
  // One wrong name in the right one's place is a wrong name, not an effect too many.
  if (!is_met && score.spurious > 0) --score.spurious;
  return score;
}

std::string header() {
  return "row,hidden,lambda_wanted,lambda,seed,absent,p,detected,named,named_first,blamed,covariates,stage,"
         "spurious,rests,explainable,removed,stated,stated_low,stated_high,numbers,numbers_in,rms_before_mm,"
         "rms_after_mm,seconds,stage_among,stage_alone,found\n";
}

std::string lineOf(const Score& one) {
  const auto yes = [](bool value) { return value ? 1 : 0; };
  return fmt::format(
      "score,{},{:.0f},{:.1f},{},{},{:.4g},{},{},{},{},{},{},{},{},{:.1f},{:.4f},{:.4f},{:.4f},{:.4f},{},{},{"
      ":.4f},"
      "{:.4f},{:.1f},{},{},{}\n",
      one.of.hidden, one.of.wanted, one.of.lambda, one.of.seed, yes(one.of.is_absent), one.p,
      yes(one.is_detected), yes(one.is_right), yes(one.is_alone), yes(one.is_blamed), yes(one.has_covariates),
      yes(one.has_stage), one.spurious, one.rests, one.explainable, one.removed, one.stated, one.stated_low,
      one.stated_high, one.numbers, one.numbers_in, one.before_mm, one.after_mm, one.seconds, yes(one.may_have_stage),
      yes(one.is_stage_alone), one.found);
}

std::string tableOf(const std::vector<std::filesystem::path>& files) {
  std::map<std::tuple<double, bool, std::string>, std::vector<Score>> groups;
  std::map<std::string, std::vector<Score>> by_effect;
  std::vector<Score> misses;
  std::set<std::string> hidden_from_captures;
  std::size_t others = 0;
  for (const auto& file : files) {
    std::ifstream in{file};
    for (std::string line; std::getline(in, line);) {
      if (line.starts_with("row,") && line + "\n" != header())
        return fmt::format("{}: these lines are of another version of this benchmark\n", file.string());
      if (line.starts_with("unseen,")) hidden_from_captures.insert(fieldsOf(line).at(1));
      auto score = readScore(line);
      if (!score) {
        others += line.starts_with("row,") || line.starts_with("unseen,") ? 0 : 1;
        continue;
      }
      if (isMiss(*score)) misses.push_back(*score);
      const bool is_null = score->of.wanted == 0.0;
      groups[{score->of.wanted, score->of.is_absent, is_null ? score->of.hidden : ""}].push_back(*score);
      if (!is_null && !score->of.is_absent) by_effect[score->of.hidden].push_back(*score);
    }
  }
  std::string table =
      "| hidden | runs | detected | named | named first | absent: none blamed | absent: covariates right | "
      "stage right | among those told | told alone, right | sets that have it | spurious a run | of these rests | "
      "removed, median | worst tenth | "
      "numbers in their 95 % | removed in "
      "its 95 % "
      "|\n|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n";
  for (const auto& [key, scores] : groups) {
    const auto& [wanted, is_absent, name] = key;
    table += rowOf(wanted == 0.0 ? name : fmt::format("λ = {:.0f}{}", wanted, is_absent ? ", absent" : ""),
                   scores, wanted == 0.0, is_absent);
  }
  table +=
      "\nBy effect, all λ:\n\n| hidden | runs | detected | named | named first | | | stage | among | alone | sets | "
      "spurious "
      "| rests | "
      "removed, median | worst tenth | numbers | removed "
      "|\n|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n";
  for (const auto& [name, scores] : by_effect) table += rowOf(name, scores, false, false);
  table +=
      "\nMisses:\n\n| hidden | λ | seed | absent | p | found | removed |\n|---|---|---|---|---|---|---|\n";
  for (const Score& one : misses)
    table += fmt::format("| {} | {:.0f} | {} | {} | {:.2g} | {} | {:.2f} |\n", one.of.hidden, one.of.lambda,
                         one.of.seed, one.of.is_absent ? "yes" : "", one.p, one.found, one.removed);
  table += fmt::format(
      "\nNot to be seen in these captures: {}.\n",
      hidden_from_captures.empty() ? "none" : fmt::format("{}", fmt::join(hidden_from_captures, ", ")));
  if (others > 0) table += fmt::format("{} lines were no scores.\n", others);
  return table;
}

}  // namespace toftwin::discover::bench
