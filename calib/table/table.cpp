// SPDX-License-Identifier: Apache-2.0
#include "calib/table/table.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <optional>
#include <sstream>
#include <utility>

#include <fmt/format.h>

#include "calib/table/column.h"
#include "calib/table/delimiter.h"
#include "calib/table/encoding.h"
#include "calib/table/layout.h"
#include "calib/table/number.h"
#include "calib/table/records.h"
#include "calib/table/sums.h"
#include "calib/table/units.h"

namespace toftwin::table {
namespace {

constexpr std::size_t kMostColumns = 400, kMostRows = 1'000'000;

void nameColumn(const std::string& header, const std::string& unit_line, TableColumn& column) {
  column.header = header;
  const HeaderUnit said = unitOfHeader(header);
  const bool is_unit_alone = said.stem.empty();  // "h" may be a height
  column.stem = is_unit_alone ? header : said.stem;
  if (!is_unit_alone) column.unit = said.unit, column.is_unit_certain = said.is_certain;
  if (!unit_line.empty()) column.unit = unit_line, column.is_unit_certain = true;
  if (const Unit* known = findUnit(column.unit)) column.unit = known->name;
}

/// Fields of the rows, column by column.
std::vector<ColumnFields> columnsOf(const Records& records, const Layout& layout) {
  std::vector<ColumnFields> columns(layout.header.size());
  for (ColumnFields& column : columns) column.reserve(layout.rows.size());
  for (const std::size_t row : layout.rows)
    for (std::size_t c = 0; c < columns.size(); ++c) {
      std::string_view field = records.at(row)[c];
      // ="007" keeps spreadsheets from changing it.
      if (field.size() > 3 && field.starts_with("=\"") && field.ends_with('"'))
        field = field.substr(2, field.size() - 3);
      columns[c].push_back(field);
    }
  return columns;
}

/// A column without a name and without any field comes from separators at the ends of lines.
void dropEmptyColumns(Layout& layout, std::vector<ColumnFields>& columns) {
  for (std::size_t c = columns.size(); c-- > 0;) {
    const bool is_empty =
        std::ranges::all_of(columns[c], [](std::string_view field) { return field.empty(); });
    if (!layout.header[c].empty() || !is_empty || columns.size() == 1) continue;
    const auto at = static_cast<std::ptrdiff_t>(c);
    columns.erase(columns.begin() + at), layout.header.erase(layout.header.begin() + at);
    if (!layout.units.empty()) layout.units.erase(layout.units.begin() + at);
  }
}

/// Whether fields count from 0 or 1, as pandas and R number rows.
bool countRows(const ColumnFields& fields) {
  std::optional<double> before;
  for (const std::string_view field : fields) {
    const auto number = numberIn(field, '.');
    if (!number || !(before ? *number == *before + 1.0 : *number == 0.0 || *number == 1.0)) return false;
    before = number;
  }
  return true;
}

/// Numbers of rows that pandas and R write under no name.
void dropIndex(Layout& layout, std::vector<ColumnFields>& columns, Table& table) {
  const bool is_index = columns.size() > 1 && (layout.header[0].empty() || layout.header[0] == "Unnamed: 0");
  if (!is_index || !layout.header_line || !countRows(columns[0])) return;
  table.notes.emplace_back("the first column, which has no name, numbers the rows and is set aside");
  columns.erase(columns.begin()), layout.header.erase(layout.header.begin());
  if (!layout.units.empty()) layout.units.erase(layout.units.begin());
}

void dropSums(std::vector<ColumnFields>& columns, Table& table) {
  const std::vector<SumRow> sums = sumRows(columns);
  for (const SumRow& sum : sums) {
    table.aside.push_back({.line = table.line[sum.row], .why = fmt::format("a row of sums: {}", sum.what)});
  }
  for (ColumnFields& fields : columns) fields.resize(fields.size() - sums.size());
  table.line.resize(table.line.size() - sums.size());
}

/// What each column holds; the decimal signs of all of them decide where one alone does not say it.
void readColumns(const Layout& layout, const std::vector<ColumnFields>& columns, char delimiter,
                 Table& table) {
  DecimalEvidence evidence;
  std::vector<SignCounts> counts;
  for (const ColumnFields& fields : columns) {
    counts.push_back(signCounts(fields));
    const DecimalEvidence one = evidenceIn(counts.back());
    evidence.has_point = evidence.has_point || one.has_point,
    evidence.has_comma = evidence.has_comma || one.has_comma;
  }
  for (std::size_t c = 0; c < columns.size(); ++c) {
    TableColumn& column = table.columns.emplace_back();
    nameColumn(layout.header[c], layout.units.empty() ? std::string{} : layout.units[c], column);
    readColumn(columns[c], counts[c], evidence, delimiter, column);
    const bool is_time_index =
        c == 0 && column.header.empty() && column.kind == Kind::Time && layout.header_line;
    if (is_time_index) column.header = column.stem = "time";  // as pandas writes an index of times
  }
}

Result<> checkSize(const Layout& layout, const Records& records, const std::filesystem::path& name) {
  const std::size_t first = layout.header_line.value_or(records.size() > 0 ? records.line.front() : 1);
  if (layout.header.size() > kMostColumns)
    return malformedAt(name, first,
                       fmt::format("has {} columns, more than {}", layout.header.size(), kMostColumns));
  if (layout.rows.empty()) return malformedAt(name, first, "has a header but no rows");
  if (layout.rows.size() > kMostRows)
    return malformedAt(name, records.line[layout.rows[kMostRows]],
                       "is beyond a million rows: thin the table");
  return {};
}

}  // namespace

Result<Table> parseTable(std::string_view bytes, const std::filesystem::path& name) {
  auto decoded = decodeText(bytes);
  if (!decoded) return malformedAt(name, 1, decoded.error().message);
  Table table;
  table.file = name;
  table.text_.assign(decoded->text.begin(), decoded->text.end());
  std::string_view text{table.text_.data(), table.text_.size()};
  const auto said = saidDelimiter(text);
  if (said) text.remove_prefix(said->begin);
  const char delimiter = said ? said->delimiter : likeliestDelimiter(text);
  Records records = splitRecords(text, delimiter);
  if (records.open_quote) return malformedAt(name, *records.open_quote, "a quote is opened and never closed");
  if (records.size() == 0) return malformedAt(name, 1, "is empty: a line of headers and rows are needed");
  auto layout = layoutOf(records, delimiter, name);
  if (!layout) return layout.error();
  if (auto checked = checkSize(*layout, records, name); !checked) return checked.error();
  for (const std::size_t row : layout->rows) table.line.push_back(records.line[row]);
  std::vector<ColumnFields> columns = columnsOf(records, *layout);
  dropEmptyColumns(*layout, columns);
  dropSums(columns, table);
  dropIndex(*layout, columns, table);
  readColumns(*layout, columns, delimiter, table);
  for (std::size_t row = 0; row < table.rows(); ++row)
    for (const ColumnFields& fields : columns) table.fields_.push_back(fields[row]);
  table.unquoted_ = std::move(records.unquoted);
  table.has_header = layout->header_line.has_value();
  table.notes.insert(table.notes.begin(), layout->notes.begin(), layout->notes.end());
  if (!decoded->note.empty()) table.notes.push_back(std::move(decoded->note));
  return table;
}

Result<Table> readTable(const std::filesystem::path& file) {
  std::error_code ignored;
  std::ifstream in{file, std::ios::binary};
  if (!in || std::filesystem::is_directory(file, ignored))
    return Error{Error::Code::NotFound, fmt::format("{}: cannot be read", file.string())};
  std::ostringstream text;
  text << in.rdbuf();
  return parseTable(text.view(), file);
}

std::vector<std::string> Table::headers() const {
  std::vector<std::string> names;
  for (const TableColumn& column : columns) names.push_back(column.header);
  return names;
}

Result<std::size_t> Table::find(std::string_view header) const {
  const auto at = std::ranges::find(columns, header, &TableColumn::header);
  if (at == columns.end()) {
    return Error{Error::Code::NotFound, fmt::format("{}: has no column \"{}\", only: {}", file.string(),
                                                    header, fmt::join(headers(), ", "))};
  }
  if (std::ranges::count(columns, header, &TableColumn::header) > 1)
    return Error{Error::Code::Malformed,
                 fmt::format("{}: has two columns \"{}\": rename one", file.string(), header)};
  return static_cast<std::size_t>(at - columns.begin());
}

Error Table::errorAt(std::size_t column, std::size_t row, std::string_view what) const {
  constexpr std::size_t kShown = 40;
  const std::string& header = columns[column].header;
  const std::string name = header.empty() ? fmt::format("{}", column + 1) : fmt::format("\"{}\"", header);
  return {Error::Code::Malformed, fmt::format("{}:{}: \"{}\" in column {} {}", file.string(), line[row],
                                              text(column, row).substr(0, kShown), name, what)};
}

Result<std::vector<double>> Table::numbers(std::size_t column) const {
  const TableColumn& one = columns[column];
  if (one.odd) return errorAt(column, one.odd->row, one.odd->why);
  if (one.kind == Kind::Text)
    return errorAt(column, firstTextIn(column), "is not a number: leave the field empty where there is none");
  return one.values;
}

std::size_t Table::firstTextIn(std::size_t column) const {
  std::size_t row = 0;
  while (row + 1 < rows() && lookOf(text(column, row)) != Look::Text) ++row;
  return row;
}

Result<std::vector<std::vector<double>>> readNumbers(const std::filesystem::path& file,
                                                     std::initializer_list<std::string_view> columns) {
  const auto table = readTable(file);
  if (!table) return table.error();
  std::vector<std::vector<double>> all;
  for (const std::string_view name : columns) {
    const auto at = table->find(name);
    if (!at) return at.error();
    auto values = table->numbers(*at);
    if (!values) return values.error();
    all.push_back(*std::move(values));
  }
  return all;
}

}  // namespace toftwin::table
