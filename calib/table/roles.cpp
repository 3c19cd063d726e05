// SPDX-License-Identifier: Apache-2.0
#include "calib/table/roles.h"

#include <algorithm>
#include <array>
#include <map>
#include <set>
#include <string_view>
#include <tuple>

#include <fmt/format.h>

#include "calib/table/units.h"
#include "calib/table/words.h"

namespace toftwin::table {
namespace {

Error badMap(const Table& table, const std::string& what) {
  return {Error::Code::InvalidArgument, fmt::format("{}: {}", table.file.string(), what)};
}

bool isLengthOrNone(const TableColumn& column) {
  const Unit* unit = findUnit(column.unit);
  return column.unit.empty() || (unit != nullptr && unit->quantity == Quantity::Length);
}

std::string namesOf(const Table& table, const std::vector<std::size_t>& columns) {
  std::string words;
  for (const std::size_t column : columns)
    words += (words.empty() ? "" : ", ") + table.columns[column].header;
  return words;
}

/// Columns that are free for a role; what the map names is taken.
class Assignment {
 public:
  explicit Assignment(const Table& table) : table_(table) {}

  Result<> take(std::optional<std::size_t>& role, const std::string& said, const char* key) {
    if (said.empty()) return {};
    const auto at = table_.find(said);
    if (!at && at.error().code == Error::Code::NotFound) {
      return Error{Error::Code::NotFound,
                   fmt::format("{}: has no column \"{}\" for `{}`, only: {}", table_.file.string(), said, key,
                               fmt::join(table_.headers(), ", "))};
    }
    if (!at) return at.error();
    if (const auto [other, is_new] = taken_.try_emplace(*at, key); !is_new) {
      return badMap(table_, fmt::format("column \"{}\" has two roles, `{}` and `{}`: it can have one", said,
                                        other->second, key));
    }
    role = *at;
    return {};
  }
  void take(std::size_t column) { taken_.try_emplace(column, "guessed"); }
  [[nodiscard]] bool isTaken(std::size_t column) const { return taken_.contains(column); }

  /// The columns whose words say this the most strongly, of those that `may` have the role.
  template <class May>
  [[nodiscard]] std::vector<std::size_t> likeliest(Meaning meaning, May may) const {
    std::vector<std::size_t> found;
    int most = 1;
    for (std::size_t c = 0; c < table_.columns.size(); ++c) {
      const int strength = strengthOf(table_.columns[c].stem, meaning);
      if (isTaken(c) || strength < most || !may(table_.columns[c])) continue;
      if (strength > most) found.clear();
      most = strength;
      found.push_back(c);
    }
    return found;
  }

 private:
  const Table& table_;
  std::map<std::size_t, std::string> taken_{};
};

bool mayBeError(const TableColumn& column) {
  return column.kind == Kind::Number && isLengthOrNone(column) && !says(column.stem, Meaning::Sigma);
}
bool mayBeMeasured(const TableColumn& column) {
  return column.kind == Kind::Number && !says(column.stem, Meaning::Sigma) &&
         !says(column.stem, Meaning::Error) && strengthOf(column.stem, Meaning::Reference) < 2;
}
bool mayBeReference(const TableColumn& column) {
  return column.kind == Kind::Number && isLengthOrNone(column) && !says(column.stem, Meaning::Sigma) &&
         !says(column.stem, Meaning::Error);
}

/// "reference_minus_measured": the word before "minus" says which is taken from which.
bool isReversed(const std::string& header) {
  const auto words = wordsOf(header);
  const auto minus = std::ranges::find(words, "minus");
  return minus != words.end() && minus != words.begin() && says(*(minus - 1), Meaning::Reference);
}

/// Of the likeliest columns those that are lengths, where only some are.
std::vector<std::size_t> lengthsFirst(const Table& table, std::vector<std::size_t> columns) {
  std::vector<std::size_t> lengths;
  for (const std::size_t c : columns)
    if (!table.columns[c].unit.empty() && isLengthOrNone(table.columns[c])) lengths.push_back(c);
  return lengths.empty() ? columns : lengths;
}

class Guesser {
 public:
  Guesser(const Table& table, Roles& roles, Assignment& free) : table_(table), roles_(roles), free_(free) {}

  /// Of the locked rows, sessions and captures.
  Result<> guessGroups() {
    guessOne(roles_.locked, Meaning::Locked, [](const TableColumn&) { return true; });
    if (auto done = guessGroup(roles_.session, Meaning::Session, "session", true); !done) return done;
    return guessGroup(roles_.capture, Meaning::Capture, "capture", false);
  }

  Result<> guessValues(bool is_said) {
    if (!is_said && !roles_.error) {
      // An error stands for itself; "reference_minus_measured" has the words of all three.
      guessOne(roles_.error, Meaning::Error, mayBeError);
      if (roles_.error) roles_.is_reversed = isReversed(table_.columns[*roles_.error].stem);
    }
    guessReference();
    if (!roles_.measured) {
      if (auto done = guessMeasured(); !done) return done;
    }
    guessOne(roles_.sigma, Meaning::Sigma, [](const TableColumn& one) { return one.kind == Kind::Number; });
    return {};
  }

 private:
  template <class May>
  void guessOne(std::optional<std::size_t>& role, Meaning meaning, May may) {
    if (role) return;
    const auto found = lengthsFirst(table_, free_.likeliest(meaning, may));
    if (found.size() == 1) role = found.front(), free_.take(*role);
  }
  void guessReference() {
    if (roles_.reference) return;
    const auto found = lengthsFirst(table_, free_.likeliest(Meaning::Reference, [&](const TableColumn& one) {
      return mayBeReference(one) && strengthOf(one.stem, Meaning::Measured) < 3;
    }));
    if (found.empty()) return;
    if (found.size() == 1 && strengthOf(table_.columns[found.front()].stem, Meaning::Reference) > 1) {
      roles_.reference = found.front(), free_.take(*roles_.reference);
    } else {
      roles_.other_references = found;
    }
  }
  /// By the word; else by the word of a range; else the only length that nothing else is said of.
  Result<> guessMeasured() {
    auto found = lengthsFirst(table_, free_.likeliest(Meaning::Measured, mayBeMeasured));
    if (found.size() == 1 && !says(table_.columns[found.front()].stem, Meaning::Device) && roles_.error) {
      roles_.measured = found.front();  // beside an error, a covariate
      return {};
    }
    if (roles_.error) return {};
    if (found.size() == 1 && strengthOf(table_.columns[found.front()].stem, Meaning::Measured) == 1 &&
        !isLength(found.front()))
      found.clear();  // "camera", "sensor": names of devices
    if (found.empty()) found = lengthsFirst(table_, free_.likeliest(Meaning::Range, mayBeMeasured));
    if (found.empty()) found = plainLengths();
    if (found.size() == 1) {
      roles_.measured = found.front(), free_.take(*roles_.measured);
      std::erase(roles_.other_references, *roles_.measured);
      return {};
    }
    const std::string map =
        "Write a map: measured = \"…\" and reference = \"…\", or error = \"…\" (docs/discover.md)";
    if (found.empty()) {
      return badMap(table_,
                    fmt::format("which column was measured? None of the headers says so alone ({}). {}",
                                fmt::join(table_.headers(), ", "), map));
    }
    return badMap(table_, fmt::format("which column was measured: {}? {}", namesOf(table_, found), map));
  }
  [[nodiscard]] bool isLength(std::size_t c) const {
    return !table_.columns[c].unit.empty() && isLengthOrNone(table_.columns[c]);
  }
  [[nodiscard]] std::vector<std::size_t> plainLengths() const {
    std::vector<std::size_t> found;
    for (std::size_t c = 0; c < table_.columns.size(); ++c) {
      const TableColumn& one = table_.columns[c];
      if (!free_.isTaken(c) && isLength(c) && mayBeMeasured(one) && !says(one.stem, Meaning::Target))
        found.push_back(c);
    }
    return found;
  }

  /// Of sessions every test depends, so that none is left to chance: of several that say it alike the one
  /// that says nothing else.
  Result<> guessGroup(std::optional<std::size_t>& role, Meaning meaning, const char* key, bool is_needed) {
    if (role) return {};
    auto found = free_.likeliest(meaning, [&](const TableColumn& one) {
      const bool says_other =
          says(one.stem, Meaning::Time) || says(one.stem, Meaning::Device);  // "run_time_s"
      return one.unit.empty() && (saysOnly(one.stem, meaning) || (one.kind != Kind::Time && !says_other));
    });
    std::vector<std::size_t> plain;
    std::ranges::copy_if(found, std::back_inserter(plain),
                         [&](std::size_t c) { return saysOnly(table_.columns[c].stem, meaning); });
    if (!plain.empty()) found = plain;
    if (found.size() > 1 && plain.empty()) {
      if (!is_needed) return {};
      return badMap(table_,
                    fmt::format("which column names the {}: {}? Write a map: {} = \"…\", or ignore = [\"…\"] "
                                "(docs/discover.md)",
                                key, namesOf(table_, found), key));
    }
    if (!found.empty()) role = found.front(), free_.take(*role);
    return {};
  }

  const Table& table_;
  Roles& roles_;
  Assignment& free_;
};

Result<> takeCovariates(const Table& table, const TableMap& map, const std::set<std::size_t>& ignored,
                        Roles& roles) {
  std::set<std::size_t> seen;
  for (const MappedCovariate& covariate : map.covariates) {
    const auto at = table.find(covariate.column);
    if (!at) {
      return Error{Error::Code::NotFound,
                   fmt::format("{}: has no column \"{}\" for a covariate, only: {}", table.file.string(),
                               covariate.column, fmt::join(table.headers(), ", "))};
    }
    if (!seen.insert(*at).second)
      return badMap(table, fmt::format("column \"{}\" is a covariate twice", covariate.column));
    roles.covariates.emplace_back(*at, covariate.nature);
  }
  if (!map.covariates.empty()) return {};
  for (std::size_t c = 0; c < table.columns.size(); ++c)
    if (!roles.isUsed(c) && !ignored.contains(c)) roles.covariates.emplace_back(c, MapNature::Guessed);
  return {};
}

Result<std::set<std::size_t>> ignoredIn(const Table& table, const TableMap& map) {
  std::set<std::size_t> ignored;
  for (const std::string& name : map.ignore) {
    bool is_there = false;
    for (std::size_t c = 0; c < table.columns.size(); ++c)
      if (table.columns[c].header == name) ignored.insert(c), is_there = true;
    if (!is_there) {
      return badMap(table, fmt::format("has no column \"{}\" to ignore, only: {}", name,
                                       fmt::join(table.headers(), ", ")));
    }
  }
  return ignored;
}

}  // namespace

bool Roles::isUsed(std::size_t column) const {
  return std::ranges::any_of(std::array{measured, reference, error, sigma, session, capture, locked},
                             [&](const auto& role) { return role == column; });
}

Result<Roles> rolesOf(const Table& table, const TableMap& map) {
  Roles roles;
  Assignment free{table};
  const std::array said{std::tuple{&roles.measured, &map.measured, "measured"},
                        std::tuple{&roles.reference, &map.reference, "reference"},
                        std::tuple{&roles.error, &map.error, "error"},
                        std::tuple{&roles.sigma, &map.sigma, "sigma"},
                        std::tuple{&roles.session, &map.session, "session"},
                        std::tuple{&roles.capture, &map.capture, "capture"},
                        std::tuple{&roles.locked, &map.locked, "locked"}};
  for (const auto& [role, column, key] : said)
    if (auto done = free.take(*role, *column, key); !done) return done.error();
  roles.is_reference_said = roles.reference.has_value();
  const bool is_error_said = roles.error.has_value();
  roles.is_reversed = map.error_sign == Sign::ReferenceMinusMeasured;
  const auto ignored = ignoredIn(table, map);
  if (!ignored) return ignored.error();
  for (const std::size_t c : *ignored) free.take(c);
  for (const MappedCovariate& covariate : map.covariates)
    if (const auto at = table.find(covariate.column); at && at.value() != roles.reference) free.take(*at);
  Guesser guesser{table, roles, free};
  if (auto done = guesser.guessGroups(); !done) return done.error();
  if (auto done = guesser.guessValues(roles.measured || is_error_said); !done) return done.error();
  if (auto done = takeCovariates(table, map, *ignored, roles); !done) return done.error();
  return roles;
}

std::string inWords(const Table& table, const Roles& roles) {
  const auto name = [&](std::size_t column) { return table.columns[column].header; };
  std::string words =
      roles.error        ? fmt::format("error = {}{}", roles.is_reversed ? "−" : "", name(*roles.error))
      : !roles.reference ? fmt::format("error = {} (without a reference)", name(*roles.measured))
                         : fmt::format("error = {} − {}", name(*roles.measured), name(*roles.reference));
  for (const auto& [role, what] : {std::pair{&roles.sigma, "sigma"}, std::pair{&roles.session, "session"},
                                   std::pair{&roles.capture, "capture"}, std::pair{&roles.locked, "locked"}})
    if (*role) words += fmt::format("; {} = {}", what, name(**role));
  std::vector<std::size_t> covariates;
  for (const auto& [column, nature] : roles.covariates) covariates.push_back(column);
  words += "; covariates: " + (covariates.empty() ? "none" : namesOf(table, covariates));
  std::vector<std::size_t> left_out;
  for (std::size_t c = 0; c < table.columns.size(); ++c)
    if (!roles.isUsed(c) && std::ranges::find(covariates, c) == covariates.end()) left_out.push_back(c);
  return left_out.empty() ? words : words + "; left out: " + namesOf(table, left_out);
}

}  // namespace toftwin::table
