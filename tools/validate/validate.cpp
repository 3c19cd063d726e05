// SPDX-License-Identifier: Apache-2.0
#include "tools/validate/validate.h"

#include <algorithm>
#include <ctime>
#include <utility>
#include <variant>

#include <fmt/chrono.h>
#include <fmt/format.h>

namespace toftwin::validate {
namespace {

/// Seconds that a judgement takes at full effort, for the time that is left.
double expectedSeconds(const Judgement& judgement, double effort) {
  const auto* line = std::get_if<Line>(&judgement.what);
  if (line == nullptr) return 4.0;
  double lines = static_cast<double>((2 + line->variants.size()) * line->files.size());
  for (const FreeNumber& number : line->numbers) lines += static_cast<double>(number.values.size());
  return 0.3 + 0.0005 * effort * line->samples * line->batches * lines * std::min(line->surfaces, 4) / 4.0;
}

const Heading& headingOf(const Judgement& judgement) {
  return std::visit([](const Heading& heading) -> const Heading& { return heading; }, judgement.what);
}

std::string now() {
  const std::time_t seconds = std::time(nullptr);
  return fmt::format("{:%Y-%m-%d %H:%M} UTC", fmt::gmtime(seconds));
}

}  // namespace

Result<std::vector<Judged>> judgeAll(const Dataset& set, double effort, compare::Progress* progress) {
  for (const Judgement& one : set.judgements) {
    const Heading& heading = headingOf(one);
    if (progress != nullptr) progress->plan(set.camera(heading.camera).title + ": " + heading.title, expectedSeconds(one, effort));
  }
  Task task{.set = set, .effort = effort, .progress = progress};
  std::vector<Judged> all;
  for (const Judgement& one : set.judgements) {
    if (progress != nullptr) progress->begin();
    auto judged = std::visit(
        [&](const auto& what) { return judge(what, one.fitted, set.camera(what.camera), task); }, one.what);
    if (!judged) return judged.error();
    all.push_back(*std::move(judged));
  }
  if (progress != nullptr) progress->end();
  return all;
}

compare::Report reportOf(const Dataset& set, std::vector<Judged> all, const std::string& note) {
  compare::Report report{.title = set.title, .written_by = "toftwin validate", .explained_in = "docs/validate.md"};
  report.subtitle = "The simulator against measurements";
  report.sections.push_back(summarySection(all, set.other));
  for (const std::string& one : set.notes) report.sections.front().blocks.push_back(compare::Paragraph{one, true});
  std::string headlines;
  for (Judged& judged : all) {
    compare::Finding& finding = judged.finding;
    if (!finding.headline.empty()) headlines += (headlines.empty() ? "" : "; ") + finding.headline;
    for (compare::Card& card : finding.cards) report.cards.push_back(std::move(card));
    report.data.set(finding.section.id, std::move(finding.data));
    report.sections.push_back(std::move(finding.section));
  }
  report.verdict = fmt::format("{}{}", report.sections.front().verdict, headlines.empty() ? "" : " " + headlines + ".");
  report.colophon = fmt::format("toftwin {}, {}{}{}", TOFTWIN_VERSION, now(), note.empty() ? "" : ", ", note);
  report.data.set("software", "toftwin " TOFTWIN_VERSION).set("date", now()).set("note", note).set("verdict", report.verdict);
  return report;
}

Result<compare::WrittenReport> validateAndReport(const Dataset& set, double effort, const std::filesystem::path& output,
                                                 const std::string& note, compare::Progress& progress) {
  auto all = judgeAll(set, effort, &progress);
  if (!all) return all.error();
  const compare::Report report = reportOf(set, *std::move(all), note);
  auto page = compare::write(report, output);
  if (!page) return page.error();
  return compare::WrittenReport{.page = *std::move(page), .verdict = report.verdict};
}

}  // namespace toftwin::validate
