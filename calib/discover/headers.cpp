// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/headers.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <map>
#include <set>
#include <string_view>

#include <fmt/format.h>

namespace toftwin::discover {
namespace {

constexpr std::array<std::string_view, 20> kUnits{"mm", "cm",  "um", "m",      "s",   "ms",  "us",
                                                  "ns", "min", "h",  "c",      "deg", "rad", "klx",
                                                  "lx", "mhz", "hz", "counts", "px",  "mw"};

/// Words of a header, in small letters: "Reference [mm]" → reference, mm.
std::vector<std::string> wordsOf(const std::string& header) {
  std::vector<std::string> words(1);
  for (const char c : header) {
    const auto letter = static_cast<unsigned char>(c);
    if (std::isalnum(letter) || letter >= 0x80) {
      words.back() += static_cast<char>(std::tolower(letter));
    } else if (!words.back().empty()) {
      words.emplace_back();
    }
  }
  if (words.back().empty()) words.pop_back();
  return words;
}

using Known = std::vector<std::string_view>;

bool hasWord(const std::string& header, const Known& known) {
  return std::ranges::any_of(wordsOf(header), [&](const std::string& word) {
    return std::ranges::find(known, word) != known.end();
  });
}

// English and German; of the groups the likelier word first.
const Known kMeasured{"measured", "measurement", "value",    "reading", "output",
                      "observed", "messwert",    "gemessen", "istwert", "ist"};
const Known kReference{"reference", "ref",     "truth",  "true",     "groundtruth", "ground",
                       "expected",  "nominal", "actual", "referenz", "soll",        "sollwert"};
const Known kTarget{"target", "plane", "distance", "wall", "nominal", "laser",   "rail",      "board",
                    "plate",  "ziel",  "ebene",    "wand", "abstand", "entfernung"};
const Known kError{"error", "residual", "deviation",  "bias",     "difference",
                   "minus", "fehler",   "abweichung", "differenz"};
const Known kSigma{"sigma",       "std",   "stddev",   "sd",       "noise",
                   "uncertainty", "stdev", "rauschen", "streuung", "standardabweichung"};
const Known kSession{"session", "sitzung", "run", "lauf", "series", "messreihe", "campaign", "day"};
const Known kCapture{"capture", "aufnahme", "pose", "shot", "burst"};
const Known kLocked{"locked", "held", "heldout", "holdout", "gesperrt"};
const Known kLength{"depth", "range", "distance", "z", "tiefe", "abstand", "entfernung"};
const Known kTime{"time",    "timestamp", "t",    "uptime",      "elapsed", "age",   "minutes",
                  "seconds", "date",      "zeit", "zeitstempel", "uhrzeit", "datum", "alter"};
const Known kDistance{"distance", "range", "depth", "z", "dist", "d", "tiefe", "abstand", "entfernung"};
const Known kAngle{"angle", "incidence", "tilt", "theta", "winkel", "einfallswinkel"};
const Known kIndex{"frame", "index", "number", "sequence", "seq",        "counter",
                   "count", "n",     "row",    "bild",     "bildnummer", "zeile"};
const Known kLabel{"id", "name", "number", "nr", "no", "index", "label"};

/// Columns that have a role, and which.
using Taken = std::map<std::string, std::string>;

/// The one column whose header has one of these words; nothing if there are none or several.
std::string onlyOne(const std::vector<std::string>& header, const Known& known, const Taken& taken) {
  std::string found;
  for (const std::string& name : header) {
    if (taken.contains(name) || !hasWord(name, known)) continue;
    if (!found.empty()) return {};
    found = name;
  }
  return found;
}

/// Columns without a role that name a group by this word; "run_time_s" is a time. `is_all`: a header that
/// says nothing else ("session", "session_id").
std::vector<std::string> groupsNamed(const std::vector<std::string>& header, std::string_view word,
                                     bool is_all, const Taken& taken) {
  std::vector<std::string> found;
  for (const std::string& name : header) {
    const auto isOther = [&](const std::string& one) {
      return one != word && std::ranges::find(kLabel, one) == kLabel.end();
    };
    const bool says_more = std::ranges::any_of(wordsOf(name), isOther);
    if (!taken.contains(name) && unitOf(name).empty() && hasWord(name, {word}) && !(is_all && says_more))
      found.push_back(name);
  }
  return found;
}

Error badMap(const std::filesystem::path& file, const std::string& what) {
  return {Error::Code::InvalidArgument, fmt::format("{}: {}", file.string(), what)};
}

/// Columns that are free for a role; what the map names is taken.
class Assignment {
 public:
  Assignment(const std::vector<std::string>& header, const std::filesystem::path& file)
      : header_(header), file_(file) {}

  Result<> name(std::string& role, const std::string& said, std::string_view key) {
    if (said.empty()) return {};
    if (std::ranges::find(header_, said) == header_.end()) {
      return Error{Error::Code::NotFound, fmt::format("{}: has no column \"{}\" for `{}`, only: {}",
                                                      file_.string(), said, key, fmt::join(header_, ", "))};
    }
    if (const auto [other, is_new] = taken_.try_emplace(said, key); !is_new) {
      return badMap(file_, fmt::format("column \"{}\" has two roles, `{}` and `{}`: it can have one", said,
                                       other->second, key));
    }
    role = said;
    return {};
  }
  void guess(std::string& role, const Known& known) {
    if (!role.empty()) return;
    role = onlyOne(header_, known, taken_);
    if (!role.empty()) taken_.emplace(role, "guessed");
  }
  /// A group's column: the likeliest word decides, and of those that have it the one that says nothing else.
  /// Of sessions every test depends, so that none is left to chance.
  Result<> guessGroup(std::string& role, const Known& known, std::string_view key, bool is_needed) {
    if (!role.empty()) return {};
    for (const std::string_view word : known) {
      auto found = groupsNamed(header_, word, true, taken_);
      if (found.empty()) found = groupsNamed(header_, word, false, taken_);
      if (found.empty()) continue;
      const bool is_plain = groupsNamed(header_, word, true, taken_).size() == found.size();
      if (found.size() > 1 && !is_plain) {
        if (!is_needed) return {};
        return badMap(
            file_, fmt::format("which column names the {}: {}? Write a map: {} = \"…\", or ignore = [\"…\"] "
                               "(docs/discover.md)",
                               key, fmt::join(found, ", "), key));
      }
      role = found.front(), taken_.emplace(role, key);
      return {};
    }
    return {};
  }
  /// Columns that could name sessions, too.
  [[nodiscard]] std::vector<std::string> otherGroups() const {
    std::vector<std::string> others;
    for (const std::string_view word : kSession)
      for (std::string& name : groupsNamed(header_, word, true, taken_))
        if (std::ranges::find(others, name) == others.end()) others.push_back(std::move(name));
    return others;
  }
  [[nodiscard]] bool isTaken(const std::string& name) const { return taken_.contains(name); }

 private:
  const std::vector<std::string>& header_;
  const std::filesystem::path& file_;
  Taken taken_;
};

/// "reference_minus_measured": the second word before "minus" is which.
bool isReversed(const std::string& header) {
  const auto words = wordsOf(header);
  const auto minus = std::ranges::find(words, "minus");
  if (minus == words.end() || minus == words.begin()) return false;
  return std::ranges::find(kReference, *(minus - 1)) != kReference.end();
}

void guessValues(Roles& roles, Assignment& free, bool is_said) {
  if (!is_said) {
    // An error stands for itself; "reference_minus_measured" has the words of all three.
    free.guess(roles.error, kError);
    if (!roles.error.empty()) roles.is_reversed = isReversed(roles.error);
  }
  if (roles.error.empty()) free.guess(roles.measured, kMeasured);
  free.guess(roles.reference, kReference);
  if (roles.error.empty() && roles.measured.empty()) free.guess(roles.measured, kLength);
}

Result<> takeCovariates(const std::vector<std::string>& header, const TableMap& map,
                        const std::filesystem::path& file, const Assignment& used, Roles& roles) {
  const auto isIgnored = [&](const std::string& name) {
    return std::ranges::find(map.ignore, name) != map.ignore.end();
  };
  for (const std::string& name : map.ignore)
    if (std::ranges::find(header, name) == header.end())
      return badMap(file,
                    fmt::format("has no column \"{}\" to ignore, only: {}", name, fmt::join(header, ", ")));
  std::set<std::string> seen;
  for (const MappedCovariate& covariate : map.covariates) {
    if (std::ranges::find(header, covariate.column) == header.end()) {
      return Error{Error::Code::NotFound,
                   fmt::format("{}: has no column \"{}\" for a covariate, only: {}", file.string(),
                               covariate.column, fmt::join(header, ", "))};
    }
    if (!seen.insert(covariate.column).second)
      return badMap(file, fmt::format("column \"{}\" is a covariate twice", covariate.column));
    roles.covariates.emplace_back(covariate.column, covariate.nature);
  }
  const bool is_distance_known =
      std::ranges::any_of(roles.covariates, [&](const auto& one) { return one.first == roles.reference; });
  if (!roles.reference.empty() && !is_distance_known && !isIgnored(roles.reference))
    roles.covariates.emplace_back(roles.reference, MapNature::Distance);
  if (!map.covariates.empty()) return {};
  for (const std::string& name : header)
    if (!used.isTaken(name) && !isIgnored(name)) roles.covariates.emplace_back(name, MapNature::Guessed);
  return {};
}

}  // namespace

std::string Roles::inWords() const {
  std::string words = !error.empty()      ? fmt::format("error = {}{}", is_reversed ? "−" : "", error)
                      : reference.empty() ? fmt::format("error = {} (without a reference)", measured)
                                          : fmt::format("error = {} − {}", measured, reference);
  for (const auto& [name, what] : {std::pair{&sigma, "sigma"}, std::pair{&session, "session"},
                                   std::pair{&capture, "capture"}, std::pair{&locked, "locked"}}) {
    if (!name->empty()) words += fmt::format("; {} = {}", what, *name);
  }
  std::string list;
  for (const auto& [name, nature] : covariates) list += (list.empty() ? "" : ", ") + name;
  words += "; covariates: " + (list.empty() ? "none" : list);
  return left_out.empty() ? words : words + fmt::format("; left out: {}", fmt::join(left_out, ", "));
}

std::string unitOf(const std::string& header) {
  const auto words = wordsOf(header);
  if (words.size() < 2) return {};
  return std::ranges::find(kUnits, words.back()) == kUnits.end() ? std::string{} : words.back();
}

std::optional<double> unitsPerMetre(const std::string& unit) {
  static const std::map<std::string, double, std::less<>> kPerMetre{{"m", 1.0}, {"cm", 1e2}, {"mm", 1e3}, {"um", 1e6}};
  const auto at = kPerMetre.find(unit);
  return at == kPerMetre.end() ? std::nullopt : std::optional{at->second};
}

double lengthFactor(const std::string& from, const std::string& to) {
  const auto a = unitsPerMetre(from), b = unitsPerMetre(to);
  return a && b ? *b / *a : 1.0;
}

bool isLengthOrNone(const std::string& unit) { return unit.empty() || unitsPerMetre(unit); }

bool saysWord(const std::string& header, const std::vector<std::string_view>& words) { return hasWord(header, words); }

bool namesTarget(const std::string& header) { return hasWord(header, kTarget); }

bool isPixelNumber(const std::string& header) {
  const bool is_plain = unitOf(header).empty() || wordsOf(header).back() == "px";
  return is_plain &&
         hasWord(header, {"pixel", "column", "col", "row", "u", "v", "x", "y", "spalte", "zeile"});
}

Nature natureOf(const std::string& header, MapNature said) {
  switch (said) {
    case MapNature::Plain:
      return Nature::Plain;
    case MapNature::Time:
      return Nature::Time;
    case MapNature::Distance:
      return Nature::Distance;
    case MapNature::Angle:
      return Nature::Angle;
    case MapNature::Index:
      return Nature::Index;
    case MapNature::Category:
      return Nature::Category;
    case MapNature::Guessed:
      break;
  }
  if (hasWord(header, {"exposure", "integration"})) return Nature::Plain;  // "exposure_time" is not time
  if (hasWord(header, kTime)) return Nature::Time;
  if (hasWord(header, kDistance)) return Nature::Distance;
  if (hasWord(header, kAngle)) return Nature::Angle;
  return hasWord(header, kIndex) ? Nature::Index : Nature::Plain;
}

Result<Roles> rolesOf(const std::vector<std::string>& header, const TableMap& map,
                      const std::filesystem::path& file) {
  Roles roles;
  Assignment assignment{header, file};
  const std::array said{std::tuple{&roles.measured, &map.measured, "measured"},
                        std::tuple{&roles.reference, &map.reference, "reference"},
                        std::tuple{&roles.error, &map.error, "error"},
                        std::tuple{&roles.sigma, &map.sigma, "sigma"},
                        std::tuple{&roles.session, &map.session, "session"},
                        std::tuple{&roles.capture, &map.capture, "capture"},
                        std::tuple{&roles.locked, &map.locked, "locked"}};
  for (const auto& [role, column, key] : said)
    if (auto done = assignment.name(*role, *column, key); !done) return done.error();
  roles.is_reversed = map.error_sign == Sign::ReferenceMinusMeasured;
  Assignment guesses = assignment;
  for (const MappedCovariate& covariate : map.covariates) {
    std::string ignored;
    if (covariate.column != roles.reference) (void)guesses.name(ignored, covariate.column, "covariate");
  }
  for (const std::string& name : map.ignore) {
    std::string ignored;
    (void)guesses.name(ignored, name, "ignore");
  }
  guesses.guess(roles.locked, kLocked);
  if (auto done = guesses.guessGroup(roles.session, kSession, "session", true); !done) return done.error();
  if (auto done = guesses.guessGroup(roles.capture, kCapture, "capture", false); !done) return done.error();
  if (map.covariates.empty()) roles.other_groups = guesses.otherGroups();
  guessValues(roles, guesses, !map.measured.empty() || !map.error.empty());
  guesses.guess(roles.sigma, kSigma);
  if (roles.error.empty() && roles.measured.empty()) {
    return Error{Error::Code::InvalidArgument,
                 fmt::format("{}: which column was measured? None of the headers says so alone ({}). Write a map: "
                             "measured = \"…\" and reference = \"…\", or error = \"…\" (docs/discover.md)",
                             file.string(), fmt::join(header, ", "))};
  }
  if (auto done = takeCovariates(header, map, file, guesses, roles); !done) return done.error();
  return roles;
}

}  // namespace toftwin::discover
