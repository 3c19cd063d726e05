// SPDX-License-Identifier: Apache-2.0
// Discovery and correction of tables in Python. The package toftwin makes dictionaries of the JSON.
#include <pybind11/stl.h>

#include <cmath>

#include "calib/loop/answer.h"
#include "calib/loop/correct.h"
#include "calib/loop/discover.h"
#include "calib/loop/page.h"
#include "calib/table/readings.h"
#include "tools/python/arrays.h"
#include "tools/python/errors.h"
#include "tools/python/parts.h"

namespace toftwin::python {
namespace {

/// A table as text, or, where that is empty, a file; with a map's file or without.
table::Readings readingsOf(const std::string& csv, const std::string& file, const std::string& map_file, table::TableMap& map) {
  if (!map_file.empty()) map = orThrow(table::loadTableMap(map_file));
  return orThrow(csv.empty() ? table::readReadings(file, map) : table::parseReadings(csv, map, "table"));
}

py::dict discoverTable(const std::string& csv, const std::string& file, const std::string& map_file, std::optional<std::uint64_t> seed,
                       std::optional<int> draws) {
  const auto discovery = orThrow(withoutLock([&]() -> Result<loop::Discovery> {
    table::TableMap map;
    table::Readings readings = readingsOf(csv, file, map_file, map);
    return loop::discover(std::move(readings), {.alpha = map.alpha,
                                                .locked_share = map.locked_share,
                                                .draws = draws.value_or(map.draws),
                                                .seed = seed.value_or(map.seed)});
  }));
  const loop::Answer answer = loop::answerOf(discovery);
  return py::dict(py::arg("headline") = answer.headline, py::arg("sentences") = answer.effects, py::arg("cautions") = answer.cautions,
                  py::arg("model") = discovery.is_written ? loop::toToml(discovery.model) : std::string{},
                  py::arg("report") = loop::dataOf(discovery).text());
}

/// The corrected value of each row of the file, NaN where the row lacks a value.
py::array_t<double> valuesOf(const table::Readings& readings, const loop::Model& model) {
  const loop::TableEvidence all = loop::evidenceOf(readings);
  const auto value = orThrow(loop::corrected(all, readings, model, loop::termsOf(model)));
  py::array_t<double> values{static_cast<py::ssize_t>(readings.rows())};
  std::fill_n(values.mutable_data(), readings.rows(), std::nan(""));
  for (std::size_t i = 0; i < all.row.size(); ++i) values.mutable_at(static_cast<py::ssize_t>(all.row[i])) = value[static_cast<Eigen::Index>(i)];
  return values;
}

py::dict correctTable(const std::string& csv, const std::string& file, const std::string& map_file, const std::string& model_toml,
                      const std::string& model_file) {
  table::TableMap map;
  const table::Readings readings = readingsOf(csv, file, map_file, map);
  const loop::Model model = orThrow(model_toml.empty() ? loop::loadModel(model_file) : loop::parseModel(model_toml, "model"));
  const auto corrected = orThrow(withoutLock([&] { return loop::correctTable(readings, model); }));
  return py::dict(py::arg("corrected") = valuesOf(readings, model), py::arg("unit") = readings.unit, py::arg("csv") = corrected.csv,
                  py::arg("report") = loop::jsonOf(corrected, readings.unit).text());
}

}  // namespace

void defineTables(py::module_& module) {
  module.def("_discover", &discoverTable, py::arg("csv"), py::arg("file"), py::arg("map_file"), py::arg("seed"), py::arg("draws"));
  module.def("_correct", &correctTable, py::arg("csv"), py::arg("file"), py::arg("map_file"), py::arg("model_toml"), py::arg("model_file"));
}

}  // namespace toftwin::python
