// SPDX-License-Identifier: Apache-2.0
// What was found in a table, for programs: report.json.
#include "calib/discover/curve.h"
#include "calib/discover/discover_table.h"

namespace toftwin::discover {
namespace {

using compare::Json;

Json effectJson(const Effect& effect) {
  Json json = Json::object();
  json.set("name", effect.name)
      .set("covariates", Json::arrayOf(effect.covariates))
      .set("formula", formulaOf(effect));
  json.set("is_formula", isFormula(effect))
      .set("stage", "range")
      .set("p", effect.p)
      .set("chosen_again", effect.frequency);
  json.set("held_out_gain", effect.gain.mean).set("held_out_gain_error", effect.gain.error);
  Json numbers = Json::array();
  for (const Estimate& one : effect.numbers)
    numbers.push(
        Json::object().set("name", one.name).set("value", one.value).set("standard_error", one.error));
  json.set("numbers", std::move(numbers));
  Json others = Json::array();
  for (const Alternative& other : effect.alternatives) {
    others.push(Json::object()
                    .set("name", other.name)
                    .set("covariates", Json::arrayOf(other.covariates))
                    .set("worse", other.worse.mean)
                    .set("worse_error", other.worse.error)
                    .set("correlation", other.correlation));
  }
  json.set("alternatives", std::move(others));
  if (effect.experiment) {
    const auto& e = *effect.experiment;
    json.set("next_experiment", Json::object()
                                    .set("vary", e.vary)
                                    .set("from", e.from)
                                    .set("to", e.to)
                                    .set("hold", e.hold)
                                    .set("held_at", e.held_at)
                                    .set("difference", e.difference));
  }
  return json;
}

}  // namespace

compare::Json dataOf(const TableDiscovery& d) {
  Json json = Json::object();
  json.set("table", d.open.file.filename().string()).set("unit", d.open.unit).set("verdict", verdictOf(d));
  json.set("open_rows", d.open.rows()).set("locked_rows", d.locked.rows()).set("captures", d.captures);
  json.set("p", d.finding.first_p)
      .set("p_left", d.finding.last_p)
      .set("draws", d.finding.draws)
      .set("seed", d.map.seed);
  json.set("noise", d.noise.typical)
      .set("noise_grows_with", d.noise.grows_with)
      .set("correlation_rows", d.noise.correlationRows());
  Json effects = Json::array();
  for (const Effect& effect : d.finding.effects) effects.push(effectJson(effect));
  json.set("effects", std::move(effects));
  const Judged& j = d.judged;
  const std::string unit = d.open.unit.empty() ? "1" : d.open.unit;
  json.set("locked", Json::object()
                         .set("sha256", j.sha256)
                         .set("before", compare::toJson(j.before, unit.c_str()))
                         .set("after", compare::toJson(j.after, unit.c_str()))
                         .set("removed", j.removed)
                         .set("removed_low", j.removed_low)
                         .set("removed_high", j.removed_high)
                         .set("removed_is_telling", j.isTelling())
                         .set("rows_far_off", j.far_off)
                         .set("explainable_chi2", j.explainable)
                         .set("explainable_chi2_error", j.explainable_error)
                         .set("lag1_before", j.lag1_before)
                         .set("lag1_after", j.lag1_after));
  Json odd = Json::array();
  for (const OddRows& one : d.odd)
    odd.push(Json::object()
                 .set("first_line", one.first_line)
                 .set("last_line", one.last_line)
                 .set("captures", one.captures)
                 .set("size", one.size));
  json.set("odd", std::move(odd));
  json.set("notes", Json::arrayOf(d.open.notes)).set("doubts", Json::arrayOf(d.open.doubts));
  return json;
}

}  // namespace toftwin::discover
