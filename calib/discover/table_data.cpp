// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/table_data.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "calib/discover/far_rows.h"
#include "calib/discover/headers.h"
#include "calib/discover/named_columns.h"
#include "calib/discover/reference_column.h"
#include "calib/discover/row_checks.h"
#include "protocol/types/counted.h"

namespace toftwin::discover {
namespace {

constexpr std::size_t kFewestRows = 20, kMostWords = 12;

/// Numbers for names, in the order in which they first stand there.
std::vector<int> numbered(const std::vector<std::string>& words, std::vector<std::string>& names) {
  std::map<std::string, int> known;
  std::vector<int> numbers;
  for (const std::string& word : words) {
    const auto [at, is_new] = known.try_emplace(word, static_cast<int>(known.size()));
    if (is_new) names.push_back(word);
    numbers.push_back(at->second);
  }
  return numbers;
}

Result<> readErrors(const NamedColumns& columns, const Roles& roles, TableData& data) {
  if (!roles.error.empty()) {
    auto error = columns.numbers(roles.error);
    if (!error) return error.error();
    data.error = *std::move(error);
    if (roles.is_reversed)
      for (double& one : data.error) one = -one;
    data.unit = unitOf(roles.error);
  }
  if (!roles.reference.empty()) {
    auto reference = columns.numbers(roles.reference);
    if (!reference) return reference.error();
    data.reference = *std::move(reference), data.reference_name = roles.reference;
  }
  if (roles.error.empty()) {
    auto measured = columns.numbers(roles.measured);
    if (!measured) return measured.error();
    data.error = *std::move(measured);
    data.unit = unitOf(roles.measured);
    const std::string unit = unitOf(roles.reference);
    const double factor = lengthFactor(unit, data.unit);
    if (factor != 1.0)
      data.notes.push_back(
          fmt::format("the reference is in {}, what was measured in {}: converted", unit, data.unit));
    for (std::size_t i = 0; i < data.reference.size(); ++i) data.error[i] -= factor * data.reference[i];
  }
  return {};
}

bool areWhole(const std::vector<double>& values) {
  return std::ranges::all_of(values, [](double v) { return !std::isfinite(v) || v == std::floor(v); });
}

Result<> readCovariate(const NamedColumns& columns, const std::string& name, MapNature said,
                       TableData& data) {
  if (!columns.find(name)) return columns.missing(name);
  TableCovariate covariate{name, natureOf(name, said), {}, {}};
  const bool is_text = columns.isText(name);
  if (is_text || covariate.nature == Nature::Category) {
    if (is_text && said != MapNature::Guessed && said != MapNature::Category) {
      auto error = columns.numbers(name);
      return error.error();
    }
    const auto numbers = numbered(columns.text(name), covariate.words);
    if (covariate.words.size() > kMostWords) {
      data.doubts.push_back(fmt::format("column \"{}\" holds {} different texts, more than {}: left out",
                                        name, covariate.words.size(), kMostWords));
      return {};
    }
    covariate.nature = Nature::Category;
    covariate.values.assign(numbers.begin(), numbers.end());
  } else {
    auto values = columns.numbers(name);
    if (!values) return values.error();
    covariate.values = *std::move(values);
    if (said == MapNature::Guessed && isPixelNumber(name) && areWhole(covariate.values))
      covariate.nature = Nature::Index;
    if (columns.isTime(name)) {
      covariate.first = NamedColumns::firstOf(*columns.asWritten(name));
      if (said == MapNature::Guessed) covariate.nature = Nature::Time;
    }
  }
  data.covariates.push_back(std::move(covariate));
  return {};
}

/// Covariates that cannot show anything: they never change.
void dropConstant(TableData& data) {
  std::erase_if(data.covariates, [&](const TableCovariate& covariate) {
    std::set<double> values(covariate.values.begin(), covariate.values.end());
    if (values.size() > 1) return false;
    data.doubts.push_back(
        fmt::format("column \"{}\" never changes: what goes with it cannot be seen", covariate.name));
    return true;
  });
}

/// Rows in which everything that is used is there.
std::vector<bool> complete(const TableData& data) {
  std::vector<bool> is_complete(data.rows(), true);
  const auto need = [&](const std::vector<double>& values) {
    for (std::size_t i = 0; i < values.size(); ++i)
      if (!std::isfinite(values[i])) is_complete[i] = false;
  };
  need(data.error), need(data.reference), need(data.sigma);
  for (const TableCovariate& covariate : data.covariates) need(covariate.values);
  for (std::size_t i = 0; i < data.sigma.size(); ++i)
    if (!(data.sigma[i] > 0.0)) is_complete[i] = false;
  return is_complete;
}

/// The column that most rows are left out for, in words; empty: none is.
std::string emptiestIn(const TableData& data, const Roles& roles) {
  std::string words;
  std::ptrdiff_t most = 0;
  const auto look = [&](const std::string& name, const std::vector<double>& values) {
    const auto missing = std::ranges::count_if(values, [](double v) { return !std::isfinite(v); });
    if (missing <= most) return;
    most = missing, words = fmt::format("column \"{}\" is empty in {} of {}", name, missing, values.size());
  };
  look(roles.reference, data.reference), look(roles.sigma, data.sigma);
  for (const TableCovariate& covariate : data.covariates) look(covariate.name, covariate.values);
  look(roles.error.empty() ? roles.measured : roles.error, data.error);  // where the reference is, so is this
  return words;
}

/// A column that is empty in most rows would take the rows with it.
void dropSparse(TableData& data) {
  std::erase_if(data.covariates, [&](const TableCovariate& covariate) {
    const auto missing = std::ranges::count_if(covariate.values, [](double v) { return !std::isfinite(v); });
    if (2 * static_cast<std::size_t>(missing) <= covariate.values.size()) return false;
    data.doubts.push_back(fmt::format("column \"{}\" is empty in {} of {} rows: left out", covariate.name,
                                      missing, covariate.values.size()));
    return true;
  });
}

/// Speed of light over twice the frequency, in the unit of the reference; without one in its header in that
/// of what was measured, from which it is subtracted as it is. 0: no header says it.
double periodOf(Frequency modulation, const Roles& roles, TableData& data) {
  if (!(modulation > Frequency{})) return 0.0;
  auto per_metre = unitsPerMetre(unitOf(roles.reference));
  if (!per_metre && roles.error.empty()) per_metre = unitsPerMetre(data.unit);
  if (per_metre) return *per_metre * 299'792'458.0 / (2.0 * modulation.in(hertz));
  data.doubts.push_back(
      "`modulation_mhz` is said, but no header the reference's unit: waves of c/(2f) are not looked for; let "
      "it "
      "end in one, as in `reference_mm`");
  return 0.0;
}

/// Rows were left out: sessions without any count no more.
void dropEmptySessions(TableData& data) {
  std::map<int, int> kept;
  for (const int session : data.session) kept.try_emplace(session, 0);
  std::vector<std::string> names;
  for (auto& [before, now] : kept) {
    now = static_cast<int>(names.size());
    names.push_back(data.session_names[static_cast<std::size_t>(before)]);
  }
  for (int& session : data.session) session = kept[session];
  data.session_names = std::move(names);
}

/// A column that could name sessions, beside one that does, and that names at least two groups in each on
/// average: rows of such a run may err alike. Then it is no covariate.
void takeFinerGroup(const NamedColumns& columns, Roles& roles, TableData& data) {
  for (const std::string& name : roles.other_groups) {
    if (!roles.capture.empty()) return;
    std::vector<std::string> names;
    const auto runs = numbered(columns.text(name), names);
    std::set<std::pair<int, int>> groups;
    for (std::size_t i = 0; i < runs.size(); ++i) groups.emplace(data.session[i], runs[i]);
    if (groups.size() < 2 * data.session_names.size() || 2 * groups.size() > data.rows()) continue;
    roles.capture = name, data.capture = runs;
    std::erase_if(roles.covariates, [&](const auto& one) { return one.first == name; });
  }
}

Result<> readGroups(const NamedColumns& columns, Roles& roles, TableData& data) {
  if (!roles.sigma.empty()) {
    auto sigma = columns.numbers(roles.sigma);
    if (!sigma) return sigma.error();
    data.sigma = *std::move(sigma);
  }
  for (const std::string* name : {&roles.session, &roles.capture})
    if (!name->empty() && !columns.find(*name)) return columns.missing(*name);
  if (roles.session.empty()) {
    data.session.assign(data.rows(), 0), data.session_names = {"all"};
  } else {
    data.session = numbered(columns.text(roles.session), data.session_names);
  }
  std::vector<std::string> ignored;
  if (!roles.capture.empty()) data.capture = numbered(columns.text(roles.capture), ignored);
  takeFinerGroup(columns, roles, data);
  data.locked.assign(data.rows(), false);
  if (roles.locked.empty()) return {};
  auto locked = columns.flags(roles.locked);
  if (!locked) return locked.error();
  data.has_locked_column = true, data.locked = *std::move(locked);
  return {};
}

/// Columns that have no part, or none any more.
void listLeftOut(const CsvTable& table, const TableData& data, Roles& roles) {
  std::erase_if(roles.covariates, [&](const auto& one) {
    return std::ranges::find(data.covariates, one.first, &TableCovariate::name) == data.covariates.end();
  });
  for (const std::string& name : table.header) {
    const std::array used{roles.measured, roles.reference, roles.error, roles.sigma,
                          roles.session,  roles.capture,   roles.locked};
    const auto isIt = [&](const auto& one) { return one.first == name; };
    if (std::ranges::find(used, name) == used.end() && std::ranges::none_of(roles.covariates, isIt))
      roles.left_out.push_back(name);
  }
}

/// An error that is the same in all rows is an offset.
Result<> checkChanges(const TableData& data) {
  const auto [least, most] = std::ranges::minmax(data.error);
  double largest = std::max(std::abs(least), std::abs(most));
  for (const double one : data.reference) largest = std::max(largest, std::abs(one));
  if (most - least > 1e-9 * largest) return {};
  return Error{Error::Code::InvalidArgument,
               fmt::format("{}: the error is {:.6g}{}{} in every row: an offset, with nothing that changes for a "
                           "column to explain",
                           data.file.string(), least, data.unit.empty() ? "" : " ", data.unit)};
}

void note(const Roles& roles, TableData& data) {
  data.notes.insert(data.notes.begin(), roles.inWords());
  if (data.session_names.size() == 1) {
    data.doubts.push_back("one session only: what is found may be of this session; measure another to know");
  }
  if (data.reference.empty() && roles.error.empty()) {
    data.doubts.push_back(
        "no reference: only changes of the measured value are seen, not whether it is right");
  }
}

}  // namespace

Result<TableData> readTable(const CsvTable& table, const TableMap& map, const std::filesystem::path& file) {
  const NamedColumns columns{table, file};
  auto roles = rolesOf(table.header, map, file);
  if (!roles) return roles.error();
  TableData data;
  data.file = file, data.line = table.line;
  if (map.covariates.empty())
    if (auto done = guessReference(columns, file, *roles, data); !done) return done.error();
  if (auto done = readErrors(columns, *roles, data); !done) return done.error();
  if (auto done = readGroups(columns, *roles, data); !done) return done.error();
  for (const auto& [name, nature] : roles->covariates)
    if (auto done = readCovariate(columns, name, nature, data); !done) return done.error();
  dropSparse(data);
  const std::size_t before = data.rows();
  const std::string emptiest = emptiestIn(data, *roles);
  data = rowsOf(data, complete(data));
  if (data.rows() < before) {
    data.doubts.push_back(fmt::format("{} of {} rows have an empty, infinite or impossible value: left out",
                                      before - data.rows(), before));
  }
  data.period = periodOf(map.modulation, *roles, data);
  const double scale = lengthFactor(unitOf(roles->reference), data.unit);
  if (auto done = checkUnits(*roles, data, scale); !done) return done.error();
  setInvalidAside(data, scale);
  dropCopies(data, scale);  // a fit with one of them would follow every row
  setFarAside(data);
  dropEmptySessions(data);
  if (data.rows() < kFewestRows) {
    return Error{Error::Code::InvalidArgument,
                 fmt::format("{}: has {}; at least {} are needed{}{}", file.string(),
                             counted(data.rows(), "usable row"), kFewestRows, emptiest.empty() ? "" : ": ", emptiest)};
  }
  dropConstant(data);
  if (data.covariates.empty()) {
    return Error{Error::Code::InvalidArgument,
                 fmt::format("{}: has no column that changes and that the error could go with, besides {}",
                             file.string(), roles->inWords())};
  }
  if (auto done = checkChanges(data); !done) return done.error();
  listLeftOut(table, data, *roles);
  note(*roles, data);
  if (table.is_from_windows) data.notes.push_back("the file is no UTF-8: read as Windows-1252 (Latin-1)");
  return data;
}

TableData rowsOf(const TableData& data, const std::vector<bool>& wanted) {
  TableData out = data;
  const auto keep = [&](auto& values) {
    std::size_t next = 0;
    for (std::size_t i = 0; i < values.size(); ++i)
      if (wanted[i]) values[next++] = values[i];
    values.resize(next);
  };
  keep(out.error), keep(out.reference), keep(out.sigma), keep(out.session), keep(out.capture),
      keep(out.locked);
  keep(out.line);
  for (TableCovariate& covariate : out.covariates) keep(covariate.values);
  return out;
}

}  // namespace toftwin::discover
