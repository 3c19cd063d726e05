// SPDX-License-Identifier: Apache-2.0
#include "calib/loop/camera.h"

#include <algorithm>
#include <optional>
#include <string_view>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "calib/table/units.h"
#include "calib/table/words.h"
#include "protocol/settings/describe.h"
#include "sim/effects/learned/covariates.h"

namespace toftwin::loop {
namespace {

/// What the simulator calls a column, and its unit there.
struct Meant {
  std::string_view name, unit;
};

bool hasWord(const std::string& header, std::initializer_list<std::string_view> words) {
  const auto in_header = table::wordsOf(header);
  return std::ranges::any_of(words, [&](std::string_view word) { return std::ranges::find(in_header, word) != in_header.end(); });
}

/// By its name, else by what its unit measures; nothing where that leaves it open.
std::optional<Meant> meantBy(const Covariate& c) {
  if (const auto* known = sim::learnedCovariate(c.name); known && sim::isKnownAt(terms::Stage::Range, *known)) return Meant{c.name, known->unit};
  const table::Unit* unit = table::findUnit(c.unit);
  if (c.nature == table::Nature::Time) return Meant{"time_s", "s"};
  if (!unit) return std::nullopt;
  switch (unit->quantity) {
    case table::Quantity::Time:
      if (hasWord(c.name, {"exposure", "integration", "belichtung"})) return Meant{"exposure_us", "us"};
      return std::nullopt;
    case table::Quantity::Illuminance:
      return Meant{"ambient_klx", "klx"};
    case table::Quantity::Temperature:
      if (hasWord(c.name, {"illumination", "led", "laser", "emitter"})) return Meant{"temperature_illumination_c", "degC"};
      return Meant{"temperature_sensor_c", "degC"};
    default:
      return std::nullopt;
  }
}

/// The term with the simulator's names; its numbers stay, since a column's value is so many times the simulator's.
std::optional<terms::Term> translated(const Discovery& d, terms::Term term, std::vector<std::string>& notes) {
  for (terms::Factor& factor : term.factors) {
    for (terms::Argument::Part& part : factor.of.parts) {
      if (part.covariate == rangeName(d.readings)) continue;
      const Covariate* column = d.open.evidence.find(part.covariate);
      const auto meant = column ? meantBy(*column) : std::nullopt;
      if (!meant) {
        const std::string note = fmt::format("what goes with {} is not in camera.toml: the simulator knows no such thing, or not by that header ({})",
                                             part.covariate == kLine ? "the line of the file" : part.covariate, sim::learnedCovariateNames(terms::Stage::Range));
        if (std::ranges::find(notes, note) == notes.end()) notes.push_back(note);
        return std::nullopt;
      }
      if (meant->name != part.covariate) {
        const std::string note = fmt::format("camera.toml takes {} for {}", part.covariate, meant->name);
        if (std::ranges::find(notes, note) == notes.end()) notes.push_back(note);
      }
      part.covariate = meant->name;
      if (!column->unit.empty()) part.weight *= table::factorBetween(meant->unit, column->unit);
    }
  }
  return term;
}

}  // namespace

Result<MendedCamera> cameraWith(const Discovery& d, const CameraText& camera) {
  if (d.readings.unit != "mm") {
    return Error{Error::Code::InvalidArgument,
                 fmt::format("{}: its errors are in {}, and a camera file takes lengths: end the headers in a unit of length, as in error_mm, or leave --model away",
                             d.readings.file.string(), d.readings.unit.empty() ? "no unit" : d.readings.unit)};
  }
  MendedCamera out{.toml = camera.text};
  if (!out.toml.ends_with('\n')) out.toml += '\n';
  // All in one section: sections act one after the other, and each would see the error of those before it as range.
  std::vector<std::string> all;
  for (const LearnedEffect& effect : d.model.effects) {
    std::vector<std::string> texts;
    bool is_whole = true;
    for (const terms::Term& term : effect.terms) {
      const auto known = translated(d, term, out.notes);
      is_whole = is_whole && known.has_value();
      if (known) texts.push_back(settings::toToml(terms::toText(*known)));
    }
    // Half of an effect is another one.
    if (is_whole) all.insert(all.end(), texts.begin(), texts.end());
  }
  if (!all.empty())
    out.toml += fmt::format("\n[[effect]]\ntype = \"learned\"\ntitle = {}\nterms = [\n  {},\n]\n", settings::toToml("learned from " + d.model.data), fmt::join(all, ",\n  "));
  if (auto parsed = sim::SensorModel::parse(out.toml, "camera.toml"); !parsed) return parsed.error();
  return out;
}

}  // namespace toftwin::loop
