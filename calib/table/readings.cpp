// SPDX-License-Identifier: Apache-2.0
#include "calib/table/readings.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "calib/table/covariate.h"
#include "calib/table/number.h"
#include "calib/table/reference.h"
#include "calib/table/roles.h"
#include "calib/table/sentinels.h"
#include "calib/table/units.h"
#include "calib/table/words.h"

namespace toftwin::table {
namespace {

/// Errors: no line names the columns, two have the same name, one has none.
Result<> checkHeader(const Table& table) {
  const auto refuse = [&](const std::string& what) {
    return Error{Error::Code::Malformed,
                 fmt::format("{}:{}: {}", table.file.string(), table.line.front(), what)};
  };
  if (!table.has_header)
    return refuse("no line above it names the columns: begin the file with one, as time_s,depth_mm");
  if (table.columns.size() == 1) {
    return refuse(fmt::format("no comma, semicolon, tab or blank parts \"{}\" into columns",
                              table.columns.front().header.substr(0, 60)));
  }
  std::set<std::string> seen;
  for (std::size_t c = 0; c < table.columns.size(); ++c) {
    const std::string& header = table.columns[c].header;
    if (header.empty()) return refuse(fmt::format("column {} has no header: name it", c + 1));
    if (!seen.insert(header).second)
      return refuse(fmt::format("two columns are called \"{}\": rename one", header));
  }
  return {};
}

class Reader {
 public:
  Reader(Table table, const TableMap& map) : table_(std::move(table)), map_(map) {}

  Result<Readings> read() {
    if (auto checked = checkHeader(table_); !checked) return checked.error();
    auto roles = rolesOf(table_, map_);
    if (!roles) return roles.error();
    roles_ = *std::move(roles);
    out_.file = table_.file, out_.line = table_.line, out_.aside = table_.aside;
    std::set<std::size_t> readings, screened;
    for (const auto& role : {roles_.measured, roles_.error})
      if (role) readings.insert(*role);
    for (std::size_t c = 0; c < table_.columns.size(); ++c)
      if (c != roles_.session && c != roles_.capture && c != roles_.locked) screened.insert(c);
    for (SetAside& one : setSentinelsAside(table_, screened, readings)) out_.aside.push_back(std::move(one));
    std::vector<std::string> found;
    if (auto done = findReference(table_, map_, roles_, found); !done) return done.error();
    takeFinerGroup();
    if (auto done = readValues(); !done) return done.error();
    if (auto done = readGroups(); !done) return done.error();
    if (auto done = readCovariates(); !done) return done.error();
    out_.modulation_mhz = map_.modulation.in(megahertz);
    if (out_.modulation_mhz == 0.0) takeModulation();
    addNotes(found);
    return std::move(out_);
  }

 private:
  [[nodiscard]] const std::string& nameOf(std::size_t column) const { return table_.columns[column].header; }

  /// What values of a column are multiplied with to be in the unit of the errors; a column without a unit of
  /// its own is in that of the other.
  double factorOf(std::size_t column, std::optional<std::size_t> other) {
    const TableColumn& one = table_.columns[column];
    const double own = millimetresIn(one), others = other ? millimetresIn(table_.columns[*other]) : 0.0;
    if (own > 0.0 || others > 0.0) out_.unit = "mm";
    if (own == 0.0 && others > 0.0 && one.unit.empty()) {
      out_.notes.push_back(fmt::format("{} says no unit and is taken as {}, as {}", one.header,
                                       table_.columns[*other].unit, nameOf(*other)));
      return others;
    }
    return own > 0.0 ? own : 1.0;
  }
  /// A column that says none is in the other's.
  [[nodiscard]] const std::string& writtenUnitOf(std::size_t column, std::optional<std::size_t> other) const {
    const std::string& own = table_.columns[column].unit;
    return own.empty() && other && millimetresIn(table_.columns[*other]) > 0.0 ? table_.columns[*other].unit : own;
  }
  Result<std::vector<double>> scaled(std::size_t column, double factor) {
    auto values = table_.numbers(column);
    if (values)
      for (double& value : *values) value *= factor;
    const TableColumn& one = table_.columns[column];
    if (values && !one.note.empty())
      out_.notes.push_back(fmt::format("column \"{}\": {}", one.header, one.note));
    return values;
  }

  Result<> readValues() {
    const auto main = roles_.error ? roles_.error : roles_.measured;
    out_.unit = table_.columns[*main].unit;
    struct Wanted {
      std::optional<std::size_t> column, other;
      std::vector<double>* values;
      std::string* name;
      AsWritten* written;
    };
    for (const Wanted& one : {Wanted{roles_.error, roles_.reference, &out_.error, &out_.error_name, &out_.error_written},
                              Wanted{roles_.measured, roles_.reference, &out_.measured, &out_.measured_name, &out_.measured_written},
                              Wanted{roles_.reference, main, &out_.reference, &out_.reference_name, &out_.reference_written}}) {
      if (!one.column) continue;
      const double factor = factorOf(*one.column, one.other);
      auto values = scaled(*one.column, factor);
      if (!values) return values.error();
      *one.values = *std::move(values), *one.name = nameOf(*one.column);
      *one.written = {.unit = writtenUnitOf(*one.column, one.other), .factor = factor};
    }
    if (!roles_.error) {
      out_.error = out_.measured;
      for (std::size_t i = 0; i < out_.reference.size(); ++i) out_.error[i] -= out_.reference[i];
    } else if (roles_.is_reversed) {
      for (double& one : out_.error) one = -one;
      out_.error_written.factor = -out_.error_written.factor;
    }
    if (!roles_.sigma) return {};
    auto sigma = scaled(*roles_.sigma, factorOf(*roles_.sigma, main));
    if (!sigma) return sigma.error();
    out_.sigma = *std::move(sigma);
    return {};
  }

  Result<> readGroups() {
    if (!roles_.locked) return {};
    for (std::size_t row = 0; row < table_.rows(); ++row) {
      const auto flag = flagIn(table_.text(*roles_.locked, row));
      if (!flag) return table_.errorAt(*roles_.locked, row, "is neither 1 nor 0, yes nor no, true nor false");
      out_.locked.push_back(*flag);
    }
    return {};
  }

  /// A column that could name sessions, beside one that does, and that names at least two groups in each on
  /// average: rows of such a run may err alike.
  void takeFinerGroup() {
    if (!roles_.session || roles_.capture || !map_.covariates.empty()) return;
    const Column session = categoryOf(table_, *roles_.session);
    for (const auto& [column, nature] : roles_.covariates) {
      const TableColumn& one = table_.columns[column];
      if (!saysOnly(one.stem, Meaning::Session) || !one.unit.empty() || nature != MapNature::Guessed)
        continue;
      const Column runs = categoryOf(table_, column);
      std::set<std::pair<double, double>> groups;
      for (std::size_t i = 0; i < table_.rows(); ++i) groups.emplace(session.values[i], runs.values[i]);
      if (groups.size() < 2 * session.words.size() || 2 * groups.size() > table_.rows()) continue;
      roles_.capture = column;
      std::erase_if(roles_.covariates, [at = column](const auto& pair) { return pair.first == at; });
      return;
    }
  }

  Result<> readCovariates() {
    for (const auto& [role, name] :
         {std::pair{roles_.session, &out_.session_name}, {roles_.capture, &out_.capture_name}}) {
      if (!role) continue;
      out_.covariates.push_back(categoryOf(table_, *role));
      *name = nameOf(*role);
    }
    for (const auto& [column, said] : roles_.covariates) {
      if (column == roles_.reference || column == roles_.measured || column == roles_.error) continue;
      auto covariate = covariateOf(table_, column, said, false, out_.notes);
      if (!covariate) return covariate.error();
      if (!isNameless(*covariate)) out_.covariates.push_back(*std::move(covariate));
    }
    return {};
  }
  /// A column of one frequency that is called a modulation's says what the map would.
  void takeModulation() {
    for (const TableColumn& column : table_.columns) {
      const Unit* unit = findUnit(column.unit);
      if (unit == nullptr || unit->quantity != Quantity::Frequency || !hasWord(column.stem, {"modulation", "modulationsfrequenz"})) continue;
      std::set<double> different;
      for (const double value : column.values)
        if (std::isfinite(value)) different.insert(value);
      if (different.size() != 1 || !(*different.begin() > 0.0)) continue;
      out_.modulation_mhz = *different.begin() * unit->in_base;
      out_.notes.push_back(fmt::format("the modulation is {:g} MHz, as column \"{}\" says", out_.modulation_mhz, column.header));
      return;
    }
  }

  /// Texts that hardly ever come twice are remarks, and nothing goes with them.
  bool isNameless(const Column& column) {
    const bool is_empty = std::ranges::none_of(column.values, [](double v) { return std::isfinite(v); });
    const bool are_remarks = column.nature == Nature::Category && 2 * column.words.size() > table_.rows();
    if (is_empty) {
      out_.notes.push_back(fmt::format("column \"{}\" is empty", column.header));
    } else if (are_remarks) {
      out_.notes.push_back(
          fmt::format("column \"{}\" holds {} different texts in {} rows: it names no groups and is not used",
                      column.header, column.words.size(), table_.rows()));
    }
    return is_empty || are_remarks;
  }

  void addNotes(const std::vector<std::string>& found) {
    std::vector<std::string> notes{inWords(table_, roles_)};
    notes.insert(notes.end(), found.begin(), found.end());
    if (!roles_.error && !roles_.reference)
      notes.emplace_back(
          "no reference: only changes of the measured value are seen, not whether it is right");
    notes.insert(notes.end(), out_.notes.begin(), out_.notes.end());
    notes.insert(notes.end(), table_.notes.begin(), table_.notes.end());
    out_.notes = std::move(notes);
  }

  Table table_;
  const TableMap& map_;
  Roles roles_{};
  Readings out_{};
};

}  // namespace

Result<Readings> parseReadings(std::string_view bytes, const TableMap& map,
                               const std::filesystem::path& name) {
  auto table = parseTable(bytes, name);
  if (!table) return table.error();
  return Reader{*std::move(table), map}.read();
}

Result<Readings> readReadings(const std::filesystem::path& file, const TableMap& map) {
  auto table = readTable(file);
  if (!table) return table.error();
  return Reader{*std::move(table), map}.read();
}

}  // namespace toftwin::table
