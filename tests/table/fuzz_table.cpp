// SPDX-License-Identifier: Apache-2.0
// libFuzzer's entry: cmake --preset fuzz, then fuzz_table FOLDER tests/table/corpus
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string_view>

#include "calib/table/readings.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace {

void demand(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "fuzzing: %s\n", what);
  std::abort();
}

}  // namespace

/// Whatever the bytes are: a table whose columns all have its rows, or an error with words.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace toftwin;
  const std::string_view bytes{reinterpret_cast<const char*>(data), size};
  const auto table = table::parseTable(bytes, "t.csv");
  if (table) {
    for (std::size_t c = 0; c < table->columns.size(); ++c) {
      const table::TableColumn& column = table->columns[c];
      demand(column.kind == table::Kind::Text || column.values.size() == table->rows(),
             "a column lacks rows");
      for (std::size_t row = 0; row < table->rows(); ++row)
        demand(table->text(c, row).size() <= size * 3, "a field is from nowhere");
    }
  } else {
    demand(!table.error().message.empty(), "an error without a text");
  }
  const auto readings = table::parseReadings(bytes, {}, "t.csv");
  demand(readings.ok() || !readings.error().message.empty(), "an error without a text");
  if (!readings) return 0;
  demand(readings->line.size() == readings->rows(), "a row without a line");
  for (const table::Column& column : readings->covariates)
    demand(column.values.size() == readings->rows(), "a covariate lacks rows");
  return 0;
}
