// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/compare_tables.h"

#include <fmt/format.h>

#include "calib/compare/table_traits.h"

namespace toftwin::cli {
namespace {

std::vector<std::string> kindNames() {
  std::vector<std::string> names;
  for (const compare::TableKind& kind : compare::tableKinds()) names.emplace_back(kind.name);
  return names;
}

std::string columnsOfKinds() {
  std::string words;
  for (const compare::TableKind& kind : compare::tableKinds())
    words += fmt::format("{}{} ({})", words.empty() ? "" : "; ", kind.name, fmt::join(kind.columns, ", "));
  return words;
}

}  // namespace

void TableOptions::add(Arguments& args) {
  args.option("--table", tables,
              "CSV file of measured scan lines or a series, judged instead of cameras; given twice: the "
              "second is held "
              "against the first")
      .oneAtATime();
  args.option("--kind", kind, "what a table is of, and its columns: " + columnsOfKinds()).oneOf(kindNames());
  args.option("--columns", columns,
              "the table's own names of these columns, in their order; a - before one changes its sign, "
              "another unit at "
              "its end (_mm, [mm] for _m) is converted, one behind = is believed (t=min)")
      .separatedBy(',');
  args.option("--frequency-mhz", frequency_mhz,
              "of modulation, for harmonics, noise_law, wraps and lens_scatter")
      .separatedBy(',');
}

Result<> TableOptions::check() const {
  const auto refuse = [](const char* why) { return Error{Error::Code::InvalidArgument, why}; };
  if (!areGiven() && (!kind.empty() || !columns.empty() || !frequency_mhz.empty()))
    return refuse("--kind, --columns and --frequency-mhz are for --table");
  if (areGiven() && kind.empty()) return refuse("--table needs --kind: what the table is of");
  if (tables.size() > 2) return refuse("two tables are compared at most: give --table once or twice");
  for (const double mhz : frequency_mhz) {
    if (!(mhz > 0.0 && mhz < 1e6))
      return refuse("--frequency-mhz: a frequency of modulation must be over 0 and below 1e6 MHz");
  }
  return {};
}

Result<Exit> compareTables(const TableOptions& options, const std::string& output, const std::string& note) {
  std::vector<compare::TableJob> jobs;
  for (const std::string& file : options.tables) {
    jobs.push_back({.file = file, .kind = options.kind, .columns = options.columns});
    for (const double mhz : options.frequency_mhz) jobs.back().frequency_hz.push_back(1e6 * mhz);
  }
  auto report = compare::judgeTables(jobs);
  if (!report) return report.error();
  report->colophon = "toftwin " TOFTWIN_VERSION + (note.empty() ? std::string{} : ", " + note);
  report->data.set("software", "toftwin " TOFTWIN_VERSION).set("note", note);
  const auto page = compare::write(*report, output);
  if (!page) return page.error();
  fmt::print("{}\n", report->verdict);
  for (const std::string& one : report->notes) fmt::print("{}\n", one);
  fmt::print("{}\n", page->string());
  return Exit::Ok;
}

}  // namespace toftwin::cli
