// SPDX-License-Identifier: Apache-2.0
#include "calib/loop/correct.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <functional>
#include <utility>

#include <fmt/format.h>

#include "calib/table/units.h"

namespace toftwin::loop {
namespace {

std::string quoted(const std::string& text) {
  if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
  std::string out = "\"";
  for (const char c : text) out += c == '"' ? std::string{"\"\""} : std::string{c};
  return out + "\"";
}
/// As many digits as a file of measurements has, and none that only a change of the unit made.
std::string numberText(double value) { return std::isnan(value) ? std::string{} : fmt::format("{:.12g}", value); }

/// A header that names its unit, also where a row of units did in the file.
std::string headerOf(const std::string& header, const table::AsWritten& written) {
  const bool says_it = written.unit.empty() || !table::unitOfHeader(header).unit.empty();
  return says_it ? header : fmt::format("{} [{}]", header, written.unit);
}
std::string named(const std::string& stem, const std::string& unit) {
  if (unit.empty()) return stem;
  const bool is_word = std::ranges::all_of(unit, [](unsigned char c) { return std::isalnum(c) != 0 || c == '_'; });
  return is_word ? stem + "_" + unit : fmt::format("{} [{}]", stem, unit);
}

/// A column of the file that is written.
struct Written {
  std::string header{};
  std::function<std::string(std::size_t row)> field{};
};
Written numbersOf(std::string header, const std::vector<double>& values, double factor) {
  return {std::move(header), [&values, factor](std::size_t row) { return numberText(values[row] / factor); }};
}

/// All in the units that the file has them in, so that it is read again as it was.
std::string csvOf(const table::Readings& r, const std::vector<double>& corrected) {
  std::vector<Written> columns;
  for (const table::Column& c : r.covariates) {
    if (c.words.empty()) columns.push_back(numbersOf(headerOf(c.header, c.written), c.values, c.written.factor));
    else columns.push_back({c.header, [&c](std::size_t row) { return std::isnan(c.values[row]) ? std::string{} : quoted(c.words[static_cast<std::size_t>(c.values[row])]); }});
  }
  const bool is_error = r.measured.empty();
  const auto add = [&](const std::vector<double>& values, const std::string& header, const table::AsWritten& written) {
    if (!values.empty()) columns.push_back(numbersOf(headerOf(header, written), values, written.factor));
  };
  add(r.reference, r.reference_name, r.reference_written), add(r.measured, r.measured_name, r.measured_written);
  if (is_error) add(r.error, r.error_name, r.error_written);
  const table::AsWritten& own = is_error ? r.error_written : r.measured_written;
  columns.push_back(numbersOf(named(is_error ? "error_left" : "corrected", own.unit.empty() ? r.unit : own.unit), corrected, std::abs(own.factor)));
  std::string out;
  for (const Written& column : columns) out += (out.empty() ? "" : ",") + quoted(column.header);
  out += "\n";
  for (std::size_t i = 0; i < r.rows(); ++i)
    for (std::size_t c = 0; c < columns.size(); ++c) out += columns[c].field(i) + (c + 1 < columns.size() ? "," : "\n");
  return out;
}

/// A line is of the table that the model was found in: without its terms for any other, with a note.
Model withoutOtherLines(Model model, const table::Readings& readings, std::vector<std::string>& notes) {
  if (model.data_id == dataIdOf(readings)) return model;
  std::string gone;
  const auto isOfLine = [](const terms::Term& term) {
    const auto names = terms::covariatesOf({term});
    return std::ranges::find(names, kLine) != names.end();
  };
  for (LearnedEffect& effect : model.effects) {
    for (const terms::Term& term : effect.terms)
      if (isOfLine(term)) gone += (gone.empty() ? "" : "; ") + terms::toText(term);
    std::erase_if(effect.terms, isOfLine);
  }
  for (Rung& rung : model.rungs) std::erase_if(rung.terms, isOfLine);
  if (!gone.empty())
    notes.push_back(fmt::format("not taken off: {}. A line is of the table that the model was found in, {}", gone, model.data.empty() ? "which it does not name" : model.data));
  return model;
}

double rmsOf(const Eigen::VectorXd& left) { return left.size() == 0 ? 0.0 : std::sqrt(left.squaredNorm() / static_cast<double>(left.size())); }

}  // namespace

Result<CorrectedTable> correctTable(const table::Readings& readings, const Model& given) {
  const TableEvidence all = evidenceOf(readings);
  if (all.evidence.rows() == 0)
    return Error{Error::Code::InvalidArgument, fmt::format("{}: no row has a value in every column", readings.file.string())};
  CorrectedTable out{.rows = static_cast<std::size_t>(all.evidence.rows()), .notes = all.notes};
  const Model model = withoutOtherLines(given, readings, out.notes);
  const std::vector<terms::Term> terms = termsOf(model);
  const auto value = corrected(all, readings, model, terms);
  if (!value) return value.error();
  out.ladder = ladderOf(all, model);
  Eigen::VectorXd before = all.evidence.y, after = *value;
  if (all.evidence.reference.size() > 0 && all.measured.size() > 0) after -= all.evidence.reference;
  if (!out.ladder.has_truth) before.array() -= before.mean(), after.array() -= after.mean();
  out.rms_before = rmsOf(before), out.rms_after = rmsOf(after);
  if (!out.ladder.has_truth) out.notes.emplace_back("the table has no reference: RMS is of the scatter about the mean, and nobody can say what is left of a constant or a gain");
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
