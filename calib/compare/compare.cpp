// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/compare.h"

#include <cerrno>
#include <ctime>
#include <fstream>
#include <system_error>

#include <fmt/chrono.h>
#include <fmt/format.h>

#include "calib/compare/live_report.h"
#include "protocol/types/counted.h"

namespace toftwin::compare {
namespace {

void add(Report& report, Finding finding) {
  for (Card& card : finding.cards) report.cards.push_back(std::move(card));
  report.data.set(finding.section.id, std::move(finding.data));
  report.sections.push_back(std::move(finding.section));
}

Result<> writeLog(const Capture& capture, const std::filesystem::path& folder) {
  errno = 0;
  std::ofstream out{folder / "log.jsonl", std::ios::binary | std::ios::trunc};
  for (const Json& entry : capture.log) out << entry.line() << '\n';
  out.flush();
  if (out) return {};
  const int why = errno;
  return Error{Error::Code::StorageFull,
               fmt::format("{}: cannot be written: {}", (folder / "log.jsonl").string(),
                           std::generic_category().message(why))};
}

Result<> addLive(const CompareJob& job, Progress& progress, Report& report, std::string& verdict) {
  const auto captured = capture(*job.a, *job.b, job.capture, progress);
  if (!captured) return captured.error();
  auto finding = judgeLive(*captured);
  if (!finding) return finding.error();
  if (auto written = writeLog(*captured, job.output); !written) return written;
  report.tone = finding->section.tone;
  report.notes = finding->notes;
  report.subtitle =
      fmt::format("{} ({}) against {} ({}), {} at {}{}", captured->b.entry.name,
                  captured->b.entry.model, captured->a.entry.name, captured->a.entry.model,
                  counted(job.capture.frames, "frame"), captured->poses.size() == 1 ? "" : "each of ",
                  counted(captured->poses.size(), "pose"));
  verdict += finding->headline + ". ";
  add(report, *std::move(finding));
  return {};
}

std::string today() {
  const std::time_t now = std::time(nullptr);
  return fmt::format("{:%Y-%m-%d %H:%M} UTC", fmt::gmtime(now));
}

}  // namespace

Result<WrittenReport> compareAndReport(const CompareJob& job, Progress& progress) {
  std::error_code failed;
  std::filesystem::create_directories(job.output, failed);
  if (failed) {
    return Error{Error::Code::StorageFull,
                 fmt::format("{}: cannot make the report's folder: {}", job.output.string(),
                             failed.message())};
  }
  planCapture(progress, job.capture);
  Report report{.title = "Comparison of time-of-flight cameras"};
  std::string verdict;
  if (auto done = addLive(job, progress, report, verdict); !done) return done.error();
  progress.end();
  report.verdict = verdict;
  report.colophon = fmt::format("toftwin {}, {}{}{}", TOFTWIN_VERSION, today(),
                                job.note.empty() ? "" : ", ", job.note);
  report.data.set("software", "toftwin " TOFTWIN_VERSION)
      .set("date", today())
      .set("note", job.note)
      .set("verdict", verdict);
  auto page = write(report, job.output);
  if (!page) return page.error();
  return WrittenReport{.page = *std::move(page), .verdict = verdict, .notes = report.notes};
}

}  // namespace toftwin::compare
