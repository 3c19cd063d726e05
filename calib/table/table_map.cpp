// SPDX-License-Identifier: Apache-2.0
#include "calib/table/table_map.h"

#include "protocol/settings/describe.h"
#include "protocol/settings/settings.h"

namespace toftwin::table {

Result<TableMap> loadTableMap(const std::filesystem::path& file) {
  auto table = settings::Table::load(file);
  if (!table && table.error().code == Error::Code::InvalidArgument) {
    // The parser says what it stumbled over in words of its own.
    return Error{Error::Code::InvalidArgument,
                 table.error().message +
                     ". A line of a map is a key and its value, texts in quotes: measured = "
                     "\"depth_mm\", modulation_mhz = 30, ignore = [\"comment\"]"};
  }
  if (!table) return table.error();
  TableMap map;
  table->read(map);
  if (!map.error.empty() && (!map.measured.empty() || table->has("reference") != !map.reference.empty()))
    table->complain("error", "stands beside `measured`: say it one way");
  for (auto& below : table->anew().tables("covariate"))
    if (!below.has("column")) table->complain("covariate", "needs `column`, its header, at " + below.place());
  if (auto checked = table->check(); !checked) return checked.error();
  return map;
}

std::string documentTableMap() { return settings::markdownTable(settings::keysOf<TableMap>()); }

}  // namespace toftwin::table
