// SPDX-License-Identifier: Apache-2.0
#include "daemon/correction.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "protocol/settings/settings.h"
#include "sim/effects/learned/covariates.h"
#include "sim/images/content_hash.h"

namespace toftwin::daemon {
namespace {

/// Complains about what is no learned effect, or can be none of a frame on its way.
sim::Learned readLearned(settings::Table& table) {
  const auto type = table.text("type");
  if (type != sim::Learned::about.name) {
    table.complain(type ? "type" : "", fmt::format("{}: a correction takes learned terms off, type = \"learned\" alone",
                                                   type ? fmt::format("= \"{}\" cannot be undone", *type) : "type is missing"));
    table.acceptAll();
    return sim::Learned::none();
  }
  sim::Learned learned;
  table.read(learned);
  table.acceptAll();  // how sure it is and what it is for says discover, too
  if (const std::string problem = learned.problem(); !problem.empty()) {
    table.complain("", problem);
    return sim::Learned::none();
  }
  if (const auto can = sim::Correction::of({learned}); !can) table.complain("", can.error().message);
  const std::vector<std::string> covariates = terms::covariatesOf(learned.terms.list());
  if (std::ranges::find(covariates, "frame") != covariates.end())
    table.complain("", "has a term with \"frame\": which frame of a device is number 0 nobody knows while it runs");
  return learned;
}

std::string hashOf(const sim::Learned& sum) {
  std::string all;
  for (const std::string& text : sum.terms.texts()) all += text + "\n";
  return sim::contentHash(all).substr(0, 8);
}

}  // namespace

Result<std::shared_ptr<const LearnedCorrection>> readCorrection(const std::filesystem::path& file) {
  auto table = settings::Table::load(file);
  if (!table) return table.error();
  // What was measured is what is true and the sum of all terms: one sum, whatever sections it stands in.
  std::vector<terms::Term> all;
  bool is_any = false;
  for (settings::Table& below : table->tables("effect")) {
    const sim::Learned learned = readLearned(below);
    if (auto checked = below.check(); !checked) return checked.error();
    all.insert(all.end(), learned.terms.list().begin(), learned.terms.list().end());
    is_any = true;
  }
  if (!is_any) {
    return Error{Error::Code::InvalidArgument,
                 fmt::format("{} has no [[effect]] of type = \"learned\": there is nothing to take off", file.string())};
  }
  const sim::Learned sum{.title = {}, .terms = std::move(all)};
  std::string name = fmt::format("{} ({})", file.filename().string(), hashOf(sum));
  auto terms = sim::Correction::of({sum});
  if (!terms) return terms.error();
  return std::make_shared<const LearnedCorrection>(LearnedCorrection{*std::move(terms), std::move(name)});
}

std::string problemWith(const LearnedCorrection& correction, const std::vector<PlaneKind>& planes) {
  const auto has = [&](PlaneKind kind) { return std::ranges::find(planes, kind) != planes.end(); };
  if (!has(PlaneKind::Range) && !has(PlaneKind::Depth))
    return fmt::format("{} takes errors off ranges, and the source has none", correction.name);
  const std::vector<std::string> covariates = correction.terms.covariates();
  const bool wants_amplitude = std::ranges::find(covariates, "amplitude_e") != covariates.end();
  if (wants_amplitude && !has(PlaneKind::Amplitude))
    return fmt::format("{} has terms with amplitude_e, and the source has no amplitude", correction.name);
  return {};
}

}  // namespace toftwin::daemon
