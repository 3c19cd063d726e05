// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/verdict_words.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include <fmt/format.h>

#include "calib/compare/traits/common_reference.h"
#include "calib/compare/traits/difference.h"

namespace toftwin::compare {
namespace {

constexpr std::size_t kShownFirst = 3;  ///< differences that have a card

std::string number(double value) { return shownDigits(value, 3); }

std::string unitBehind(const TraitVerdict& one) {
  return one.difference.unit.empty() || one.difference.unit == "1" ? "" : " " + one.difference.unit;
}

/// What a line is off by hangs on where it is told.
std::string placeOf(const TraitVerdict& one) {
  return one.isOffset() && !one.at.empty() ? " " + one.at : "";
}

std::string nameOf(const TraitVerdict& one) {
  const std::string name = one.difference.name + placeOf(one);
  return one.what == one.difference.name ? name : one.what + ": " + name;
}

bool isWaves(const TraitVerdict& one) { return one.what.starts_with("harmonics"); }

std::string lackInWords(const Trait& lacked, const char* by, const char* other) {
  if (!isLack(lacked)) return "";
  return fmt::format("{} gives no range at {} % of the pixels at which {} does ({} to {} %). ", by,
                     number(100.0 * lacked.value), other, number(100.0 * lacked.low),
                     number(100.0 * lacked.high));
}

/// What wraps or is missing is in few of the other numbers, so that it is said before them.
std::string hiddenInWords(const TraitVerdict& one) {
  if (one.isWraps() && one.a && one.b)
    return fmt::format("B reads {} of the wall whole periods off, A {}. ", shownPercent(one.b->trait.value),
                       shownPercent(one.a->trait.value));
  if (one.isMissingAlike()) return "";
  return lackInWords(one.lacked_by_b, "B", "A") + lackInWords(one.lacked_by_a, "A", "B");
}

std::string hiddenInWords(const std::vector<TraitVerdict>& all) {
  std::string hidden;
  for (const TraitVerdict& one : all) hidden += hiddenInWords(one);
  return hidden;
}

/// What both lack alike is said last: it is no difference of theirs.
std::string lackedAlikeInWords(const std::vector<TraitVerdict>& all) {
  const auto found = std::ranges::find_if(all, &TraitVerdict::isMissingAlike);
  if (found == all.end()) return "";
  return fmt::format(". B gives no range at {} % of the pixels at which A does, and A at {} % of B's, as equal cameras "
                     "do where noise decides which pixels have one",
                     number(100.0 * found->lacked_by_b.value), number(100.0 * found->lacked_by_a.value));
}

/// The amplitude of a wave of B − A: how large it is.
bool isSize(const TraitVerdict& one) {
  const std::string& name = one.difference.name;
  return one.is_size || name == kWavesTogether || (isWaves(one) && !one.b && name.ends_with(" per period"));
}

/// For who has not read how it is made; tables have the name by which a log is searched.
std::string plainNameOf(const TraitVerdict& one) {
  std::string what = one.what, name = one.difference.name;
  if (isWaves(one)) what = one.b ? "error over distance, B's less A's" : "B − A over distance";
  if (what == "noise law") what = "noise over signal";
  if (name == "residual") name = "what no wave explains";
  if (name.ends_with(" per period")) name = "wave, " + name;
  if (name == kWavesTogether) name = "waves together, RMS over the distances";
  return what == name ? what : what + ": " + name + placeOf(one);
}

std::string intervalOf(const Trait& one) {
  if (!std::isfinite(one.value)) return "–";
  const auto end = [&](double value) { return isKnown(value, one.unit) ? number(value) : "not known"; };
  return fmt::format("{} ({} to {})", number(one.value), end(one.low), end(one.high));
}

std::string shownOf(const std::optional<NamedTrait>& one) {
  if (!one) return "";
  return number(one->trait.value) + (one->detail.empty() ? "" : ", " + one->detail) +
         (isUnseenPart(*one) ? ", not seen by itself" : "");
}

std::string sizeOf(const TraitVerdict& one) {
  const double value = one.difference.value;
  return (value > 0.0 && !isSize(one) ? "+" : "") + number(value) + unitBehind(one);
}

std::string farBeyond(const TraitVerdict& one) {
  if (!(one.floor() > 0.0)) return "without a floor";
  constexpr double kFar = 1000.0;  // more digits say nothing
  if (one.timesFloor() > kFar) return fmt::format("over {:.0f} × the floor", kFar);
  return fmt::format("{:.{}f} × the floor", one.timesFloor(), one.timesFloor() < 10.0 ? 1 : 0);
}

std::string signedNumber(double value) { return (value > 0.0 ? "+" : "") + number(value); }

/// Of a scale, where along the range it is how much, and of an offset that has one beside it. Of an offset that a scale
/// alone may make: that it may.
std::string lineOf(const TraitVerdict& one) {
  if (!one.line || !(one.line->from_m < one.line->to_m)) return "";
  const auto at = [&](double distance_m) {
    return fmt::format("{} mm {}", signedNumber(one.offAt(distance_m)), placeInWords(distance_m));
  };
  const auto [from_m, to_m] = std::pair{one.line->from_m, one.line->to_m};
  if (one.isScale()) return fmt::format(", that is {} and {}", at(from_m), at(to_m));
  if (one.has_scale && !one.is_of_scale) {
    return fmt::format(", with a scale of {} mm/m beside it: {} and {}", signedNumber(one.line->slope), at(from_m),
                       at(to_m));
  }
  if (!one.is_of_scale || !(one.line->at_m > 0.0)) return "";
  return fmt::format(", as a scale of {} mm/m alone would make it, too",
                     signedNumber(one.difference.value / one.line->at_m));
}

std::string atOf(const TraitVerdict& one) {
  return one.at.empty() || one.isOffset() ? "" : ", both " + one.at;
}

/// Beside the verdict on shares, which are the same where each lacks as many of the other's.
std::string lacksOf(const TraitVerdict& one) {
  std::string words;
  if (isLack(one.lacked_by_b))
    words += fmt::format("; B lacks {} % of A's", number(100.0 * one.lacked_by_b.value));
  if (isLack(one.lacked_by_a))
    words += fmt::format("; A lacks {} % of B's", number(100.0 * one.lacked_by_a.value));
  return words;
}

std::string verdictOf(const TraitVerdict& one) {
  if (!one.why_not.empty()) return "not told: " + one.why_not + lacksOf(one);
  if (!one.isTold()) return "not told: an end of an interval is not known" + lacksOf(one);
  if (one.differs()) return "differs, " + farBeyond(one) + lineOf(one) + atOf(one) + lacksOf(one);
  const double most = std::max(std::abs(one.difference.low), std::abs(one.difference.high));
  return fmt::format("same, within {}{}{}{}", number(most), unitBehind(one), atOf(one), lacksOf(one));
}

std::size_t countOf(const std::vector<TraitVerdict>& all, bool differs) {
  return static_cast<std::size_t>(
      std::ranges::count_if(all, [&](const auto& one) { return one.isTold() && one.differs() == differs; }));
}

/// Both cameras have it, and that of one of them is in doubt.
bool isDoubted(const TraitVerdict& one) {
  return one.a && one.b && !one.why_not.empty() && !(one.a->trait.doubt.empty() && one.b->trait.doubt.empty());
}

}  // namespace

std::string headlineOf(const std::vector<TraitVerdict>& all) {
  const std::size_t differ = countOf(all, true), same = countOf(all, false);
  const std::string hidden = hiddenInWords(all), alike = lackedAlikeInWords(all);
  if (differ + same == 0) {
    const auto found = std::ranges::find_if(all, isDoubted);
    return hidden +
           (found == all.end() ? "No characteristic is known of both cameras"
                               : fmt::format("No number of B is held against A's: {}", found->why_not)) +
           alike;
  }
  if (differ == 0) {
    const std::string none =
        same == 1 ? "In the one number told B does not" : fmt::format("In none of {} numbers does B", same);
    return hidden + none + " differ from A by more than the noise floor" + alike;
  }
  // The first of the table below, but that what wraps or is missing was said.
  const auto isHidden = [](const TraitVerdict& one) {
    return one.isWraps() || (one.isMissing() && !one.isMissingAlike());
  };
  const auto isNew = [&](const TraitVerdict& one) { return one.isTold() && one.differs() && !isHidden(one); };
  const auto found = std::ranges::find_if(all, isNew);
  const TraitVerdict* first = found == all.end() ? &all.front() : &*found;
  return hidden + fmt::format(
                      "Clearest difference: {}, {} ({} to {}), {}{}. "
                      "{} from A's by more than the noise floor",
                      plainNameOf(*first), sizeOf(*first), number(first->difference.low),
                      number(first->difference.high), farBeyond(*first), lineOf(*first),
                      differ + same == 1
                          ? "The one number told of B differs"
                          : fmt::format("{} of {} numbers of B differ{}", differ, differ + same,
                                        differ == 1 ? "s" : "")) +
         alike;
}

std::string missingInWords(const std::vector<MissingAt>& missing) {
  if (missing.empty()) return "";
  const MissingAt& worst = missing.front();
  const std::string times = worst.captures == 1 ? "its only capture" : fmt::format("all {} captures", worst.captures);
  const std::string more =
      missing.size() == 1 ? "" : fmt::format(", and over 5 % at {} more conditions", missing.size() - 1);
  return fmt::format("At \"{}\" {} gives no range at {} % of the pixels that are seen there, at which {} has one "
                     "in {}{}. ",
                     worst.at, worst.of, number(100.0 * worst.share), worst.of == "A" ? "B" : "A", times, more);
}

TableBlock verdictTable(const std::vector<TraitVerdict>& all) {
  TableBlock table{
      "B against A, number by number. "
      "The floor is what B − A is uncertain by: a smaller difference does not show. "
      "Intervals of B − A hold with 95 % for all rows together",
      {"characteristic", "verdict", "B − A", "floor", "A", "B"},
      {}};
  for (const TraitVerdict& one : all) {
    const std::string unit = unitBehind(one).empty() ? "" : fmt::format(" [{}]", one.difference.unit);
    table.rows.push_back({nameOf(one) + unit, verdictOf(one), intervalOf(one.difference),
                          one.isTold() ? number(one.floor()) : "–", shownOf(one.a), shownOf(one.b)});
  }
  return table;
}

std::pair<TableBlock, TableBlock> verdictTables(const std::vector<TraitVerdict>& all) {
  const auto differs = [](const TraitVerdict& one) { return one.isTold() && one.differs(); };
  const auto first_same = std::ranges::find_if_not(all, differs);  // those that differ come first
  auto differ = verdictTable({all.begin(), first_same}), rest = verdictTable({first_same, all.end()});
  if (!differ.rows.empty())
    rest.caption = "The other numbers: B is the same as A within the noise floor, or it is not told";
  return {std::move(differ), std::move(rest)};
}

std::vector<Card> cardsOf(const std::vector<TraitVerdict>& all, const std::vector<MissingAt>& missing) {
  const std::size_t differ = countOf(all, true), told = differ + countOf(all, false);
  std::vector<Card> cards;
  if (!missing.empty()) {
    cards.push_back({fmt::format("{} gives no range", missing.front().of),
                     shownPercent(missing.front().share), missing.front().at, Tone::Bad});
  }
  if (told == 0) return cards;
  const bool is_good = differ == 0 && missing.empty() && std::ranges::none_of(all, &TraitVerdict::isMissing);
  cards.push_back({"Same as A", fmt::format("{} of {}", told - differ, told),
                   "numbers of B within the noise floor", is_good ? Tone::Good : Tone::Fair});
  const std::size_t most = cards.size() + kShownFirst;
  for (std::size_t i = 0; i < differ && cards.size() < most; ++i) {
    const TraitVerdict& one = all[i];
    // What is told of waves of B − A and again of B's less A's has one card, that of what is clearer.
    const auto isIt = [&](const TraitVerdict& before) {
      return isWaves(before) && isWaves(one) && before.difference.name == one.difference.name;
    };
    if (std::any_of(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(i), isIt)) continue;
    // Nor has an offset that a scale makes one beside the scale's.
    const auto isOfIt = [](const TraitVerdict& scale) { return scale.isScale() && scale.differs(); };
    if (one.isOffset() && one.is_of_scale && std::ranges::any_of(all, isOfIt)) continue;
    cards.push_back({plainNameOf(one), sizeOf(one),
                     fmt::format("B − A, {} to {}; {}{}", number(one.difference.low),
                                 number(one.difference.high), farBeyond(one), lineOf(one)),
                     Tone::Fair});
  }
  return cards;
}

}  // namespace toftwin::compare
