// SPDX-License-Identifier: Apache-2.0
#include "calib/loop/correct.h"

#include <cmath>

#include <fmt/format.h>

namespace toftwin::loop {
namespace {

std::string quoted(const std::string& text) {
  if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
  std::string out = "\"";
  for (const char c : text) out += c == '"' ? std::string{"\"\""} : std::string{c};
  return out + "\"";
}
std::string field(const table::Column& column, std::size_t row) {
  const double value = column.values[row];
  if (std::isnan(value)) return {};
  return column.words.empty() ? fmt::format("{}", value) : quoted(column.words[static_cast<std::size_t>(value)]);
}
std::string number(const std::vector<double>& values, std::size_t row) {
  return values.empty() || std::isnan(values[row]) ? std::string{} : fmt::format("{}", values[row]);
}

/// The stem of a header that ends in a unit: "corrected_mm" beside "depth_mm".
std::string correctedName(const table::Readings& readings) {
  const bool is_error = readings.measured.empty();
  return std::string{is_error ? "error_left" : "corrected"} + (readings.unit.empty() ? "" : "_" + readings.unit);
}

std::string csvOf(const table::Readings& readings, const std::vector<double>& corrected) {
  std::string out;
  for (const table::Column& column : readings.covariates) out += quoted(column.header) + ",";
  const auto named = [&](const std::vector<double>& values, const std::string& name) {
    if (!values.empty()) out += quoted(name) + ",";
  };
  const std::vector<double> none;
  const auto& error = readings.measured.empty() ? readings.error : none;
  named(readings.reference, readings.reference_name), named(readings.measured, readings.measured_name), named(error, readings.error_name);
  out += correctedName(readings) + "\n";
  for (std::size_t i = 0; i < readings.rows(); ++i) {
    for (const table::Column& column : readings.covariates) out += field(column, i) + ",";
    for (const auto* values : {&readings.reference, &readings.measured, &error})
      if (!values->empty()) out += number(*values, i) + ",";
    out += (std::isnan(corrected[i]) ? std::string{} : fmt::format("{}", corrected[i])) + "\n";
  }
  return out;
}

double rmsOf(const Eigen::VectorXd& left) { return left.size() == 0 ? 0.0 : std::sqrt(left.squaredNorm() / static_cast<double>(left.size())); }

}  // namespace

Result<CorrectedTable> correctTable(const table::Readings& readings, const Model& model) {
  const TableEvidence all = evidenceOf(readings);
  if (all.evidence.rows() == 0)
    return Error{Error::Code::InvalidArgument, fmt::format("{}: no row has a value in every column", readings.file.string())};
  CorrectedTable out{.rows = static_cast<std::size_t>(all.evidence.rows()), .notes = all.notes};
  const std::vector<terms::Term> terms = termsOf(model);
  const auto value = corrected(all, readings, model, terms);
  if (!value) return value.error();
  out.ladder = ladderOf(all, model);
  Eigen::VectorXd before = all.evidence.y, after = *value;
  if (all.evidence.reference.size() > 0 && all.measured.size() > 0) after -= all.evidence.reference;
  if (!out.ladder.has_truth) before.array() -= before.mean(), after.array() -= after.mean();
  out.rms_before = rmsOf(before), out.rms_after = rmsOf(after);
  if (!out.ladder.has_truth) out.notes.emplace_back("the table has no reference: RMS is of the scatter about the mean");
  if (!readings.measured_name.empty() && !model.measured.empty() && readings.measured_name != model.measured)
    out.notes.push_back(fmt::format("the model is of {}, and is applied to {}", model.measured, readings.measured_name));
  std::vector<double> column(readings.rows(), std::nan(""));
  for (std::size_t i = 0; i < all.row.size(); ++i) column[all.row[i]] = (*value)[static_cast<Eigen::Index>(i)];
  out.csv = csvOf(readings, column);
  return out;
}

compare::Json jsonOf(const CorrectedTable& c, const std::string& unit) {
  using compare::Json;
  Json json = Json::object();
  const std::string suffix = unit.empty() ? "" : "_" + unit;
  json.set("rows", c.rows).set("has_reference", c.ladder.has_truth);
  json.set("rms_before" + suffix, c.rms_before).set("rms_after" + suffix, c.rms_after);
  Json rungs = Json::array();
  for (const Step& step : c.ladder.steps) rungs.push(Json::object().set("name", step.name).set("rms" + suffix, step.rms));
  return json.set("ladder", std::move(rungs)).set("notes", Json::arrayOf(c.notes));
}

}  // namespace toftwin::loop
