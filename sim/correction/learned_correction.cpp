// SPDX-License-Identifier: Apache-2.0
#include "sim/correction/learned_correction.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "protocol/settings/settings.h"
#include "sim/effects/learned/covariates.h"
#include "sim/images/content_hash.h"

namespace toftwin::sim {
namespace {

/// Complains about what is no learned effect, or can be none of a frame on its way.
Learned readLearned(settings::Table& table) {
  const auto type = table.text("type");
  if (type != Learned::about.name) {
    table.complain(type ? "type" : "", fmt::format("{}: a correction takes learned terms off, type = \"learned\" alone",
                                                   type ? fmt::format("= \"{}\" cannot be undone", *type) : "type is missing"));
    table.acceptAll();
    return Learned::none();
  }
  Learned learned;
  table.read(learned);
  table.acceptAll();  // how sure it is and what it is for says discover, too
  if (const std::string problem = learned.problem(); !problem.empty()) {
    table.complain("", problem);
    return Learned::none();
  }
  if (const auto can = Correction::of({learned}); !can) table.complain("", can.error().message);
  const std::vector<std::string> covariates = terms::covariatesOf(learned.terms.list());
  if (std::ranges::find(covariates, "frame") != covariates.end())
    table.complain("", "has a term with \"frame\": which frame of a device is number 0 nobody knows while it runs");
  return learned;
}

std::string hashOf(const Learned& sum) {
  std::string all;
  for (const std::string& text : sum.terms.texts()) all += text + "\n";
  return contentHash(all).substr(0, 8);
}

/// Of a table's model that is not of lengths. Lengths are in mm there, whatever the table's unit was.
Result<> checkUnit(settings::Table& table) {
  const auto unit = table.text("unit");
  if (!unit || *unit == "mm") return {};
  return Error{Error::Code::InvalidArgument, fmt::format("{}: the model is of values in {}, and a camera's ranges are lengths", table.place("unit"),
                                                         unit->empty() ? "no unit" : *unit)};
}

/// Where the file is a whole camera, how many pixels that has.
void readSize(settings::Table& table, LearnedCorrection& correction) {
  auto lens = table.table("lens");
  if (!lens) return;
  constexpr Bounds kPixels{1, 65'536};
  correction.width = static_cast<int>(lens->number("width", kPixels, {}, true).value_or(0.0));
  correction.height = static_cast<int>(lens->number("height", kPixels, {}, true).value_or(0.0));
}

/// The terms of all sections. What was measured is what is true and the sum of all terms: one sum, whatever sections it stands in.
Result<Learned> sumIn(settings::Table& table) {
  std::vector<terms::Term> all;
  const auto sections = table.tables("effect");
  for (settings::Table below : sections) {
    const Learned learned = readLearned(below);
    if (auto checked = below.check(); !checked) return checked.error();
    all.insert(all.end(), learned.terms.list().begin(), learned.terms.list().end());
  }
  if (sections.empty()) {
    return Error{Error::Code::InvalidArgument,
                 fmt::format("{} has no [[effect]] of type = \"learned\": there is nothing to take off", table.place())};
  }
  return Learned{.title = {}, .terms = std::move(all)};
}

}  // namespace

Result<std::shared_ptr<const LearnedCorrection>> readCorrection(const std::filesystem::path& file) {
  auto table = settings::Table::load(file);
  if (!table) return table.error();
  if (auto lengths = checkUnit(*table); !lengths) return lengths.error();
  auto sum = sumIn(*table);
  if (!sum) return sum.error();
  auto terms = Correction::of({*sum});
  if (!terms) return terms.error();
  LearnedCorrection correction{*std::move(terms), fmt::format("{} ({})", file.filename().string(), hashOf(*sum))};
  readSize(*table, correction);
  table->acceptAll();  // keys that say how it was found are of no matter
  if (auto checked = table->check(); !checked) return checked.error();
  return std::make_shared<const LearnedCorrection>(std::move(correction));
}

std::string problemWith(const LearnedCorrection& correction, const std::vector<PlaneKind>& planes, const CameraInfo& camera) {
  const auto has = [&](PlaneKind kind) { return std::ranges::find(planes, kind) != planes.end(); };
  if (!has(PlaneKind::Range) && !has(PlaneKind::Depth))
    return fmt::format("{} takes errors off ranges, and the source has none", correction.name);
  const std::vector<std::string> covariates = correction.terms.covariates();
  const bool wants_amplitude = std::ranges::find(covariates, "amplitude_e") != covariates.end();
  if (wants_amplitude && !has(PlaneKind::Amplitude))
    return fmt::format("{} has terms with amplitude_e, and the source has no amplitude", correction.name);
  const bool is_known = correction.width > 0 && correction.height > 0 && camera.width > 0;
  if (is_known && (correction.width != camera.width || correction.height != camera.height))
    return fmt::format("{} is of another camera: it has {} x {} pixels, the source {} x {}", correction.name, correction.width, correction.height,
                       camera.width, camera.height);
  return {};
}

}  // namespace toftwin::sim
