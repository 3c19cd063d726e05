// SPDX-License-Identifier: Apache-2.0
#include "calib/plan/compare_run.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <ctime>
#include <fstream>
#include <optional>
#include <set>
#include <sstream>
#include <system_error>
#include <thread>

#include <fmt/chrono.h>
#include <fmt/format.h>

#include "calib/plan/captures.h"
#include "calib/plan/compare_capture.h"
#include "calib/plan/opened.h"
#include "calib/plan/run_log.h"
#include "calib/plan/run_report.h"
#include "calib/plan/run_traits.h"
#include "calib/plan/seen.h"
#include "protocol/record/recording.h"
#include "protocol/settings/settings.h"
#include "protocol/types/counted.h"
#include "sim/images/content_hash.h"

namespace toftwin::plan {
namespace {

/// So many pixels of all captures together are kept for what is told of them all.
constexpr double kPixelsKept = 3e6;

std::string today() {
  const std::time_t now = std::time(nullptr);
  return fmt::format("{:%Y-%m-%d %H:%M} UTC", fmt::gmtime(now));
}

/// What a run's own files say of it.
struct RunFiles {
  std::vector<std::string> skipped;  ///< blocks
  Plan plan;
  Schedule schedule;
  std::string camera_a, camera_b;  ///< source, model and serial number
};

/// Error: the plan beside the captures is not the one that they were captured by.
Result<> checkPlan(const std::filesystem::path& folder, const std::string& captured_by) {
  std::stringstream text;
  text << std::ifstream{folder / kPlanFile, std::ios::binary}.rdbuf();
  if (captured_by.empty() || sim::contentHash(text.str()) == captured_by) return {};
  return Error{Error::Code::InvalidArgument,
               fmt::format("{}: is not the plan that was captured: {} names another one by its hash. Put the plan back "
                           "as it was; a changed plan is measured into a folder of its own",
                           (folder / kPlanFile).string(), kRunFile)};
}

Result<RunFiles> readRun(const std::filesystem::path& folder) {
  auto table = settings::Table::load(folder / kRunFile);
  if (!table) {
    return Error{table.error().code, fmt::format("{}\nIs {} the folder of a run of `toftwin measure`?",
                                                 table.error().message, folder.string())};
  }
  std::vector<std::string> skip;
  std::istringstream names{table->text("skip").value_or("")};
  for (std::string name; std::getline(names, name, ',');) {
    name.erase(0, name.find_first_not_of(' '));
    if (!name.empty()) skip.push_back(name);
  }
  if (auto same = checkPlan(folder, table->text("plan").value_or("")); !same) return same.error();
  auto plan = loadPlan(folder / kPlanFile, skip);
  if (!plan) return plan.error();
  auto schedule = scheduleOf(*plan);
  if (!schedule) return schedule.error();
  return RunFiles{std::move(skip), *std::move(plan), *std::move(schedule), table->text("a").value_or(""),
                  table->text("b").value_or("")};
}

/// A moving plate is at another place in each frame; a mean over frames says nothing of it.
bool standsStill(const CaptureRecord& record) { return record.kind != "moving"; }

/// The first capture of each block whose picture says something.
std::set<std::size_t> examplesOf(const std::vector<CaptureRecord>& records) {
  const std::set<std::string> kinds{"distance", "checkerboard", "foreground", "corner", "tilt", "locked"};
  std::set<std::string> seen;
  std::set<std::size_t> numbers;
  for (const CaptureRecord& one : records) {
    if (kinds.contains(one.kind) && seen.insert(one.kind).second) numbers.insert(one.number);
  }
  return numbers;
}

/// What the first frames say.
struct FirstFrames {
  int stride = 1;  ///< how far apart the pixels are that are kept, by the size of A's image
  std::array<std::vector<double>, 2> frequency_hz{};
  std::array<Frame, 2> frames{};
};

Result<Frame> firstFrameIn(const std::filesystem::path& run, const RecordedFile& file) {
  if (auto whole = checkHash(run, file); !whole) return whole.error();
  auto reader = record::Reader::open(run / file.file);
  if (!reader) return reader.error();
  return reader->next();
}

std::vector<double> frequenciesOf(const Frame& frame) {
  std::set<double> all;
  for (const Exposure& exposure : frame.moment.exposures) {
    if (const double f = exposure.modulation.in(hertz); f > 0.0) all.insert(f);
  }
  return {all.begin(), all.end()};
}

Result<FirstFrames> firstFramesOf(const std::filesystem::path& run, const std::vector<CaptureRecord>& records) {
  const auto a = firstFrameIn(run, records.front().a), b = firstFrameIn(run, records.front().b);
  if (!a) return a.error();
  if (!b) return b.error();
  const double pixels =
      static_cast<double>(a->camera.width) * a->camera.height * static_cast<double>(records.size());
  return FirstFrames{.stride = static_cast<int>(std::ceil(std::sqrt(std::max(1.0, pixels / kPixelsKept)))),
                     .frequency_hz = {frequenciesOf(*a), frequenciesOf(*b)},
                     .frames = {*a, *b}};
}

/// Two captures at a time; each is read, compared and thinned before the next.
Result<ComparedRun> compareAll(const CompareRunJob& job, const RunFiles& files,
                               const std::vector<CaptureRecord>& records, compare::Progress& progress) {
  const auto first = firstFramesOf(job.run, records);
  if (!first) return first.error();
  const auto shown = examplesOf(records);
  const CompareHow how{.stride = first->stride, .frequency_hz = first->frequency_hz};
  const unsigned workers = std::clamp(std::thread::hardware_concurrency(), 1u, 4u);
  std::vector<std::optional<Result<ComparedCapture>>> results(records.size());
  std::vector<compare::PoseComparison> wholes(records.size());
  std::atomic<std::size_t> next{0}, done{0};
  std::atomic<bool> gives_up{false};
  const auto work = [&] {
    for (std::size_t i = next++; i < records.size() && !gives_up; i = next++) {
      const bool is_shown = shown.contains(records[i].number);
      results[i] = compareCapture(job.run, files.plan, records[i], how, is_shown ? &wholes[i] : nullptr);
      if (!*results[i]) gives_up = true;
      ++done;
    }
  };
  progress.begin();
  {
    std::vector<std::jthread> threads;
    for (unsigned i = 0; i < workers; ++i) threads.emplace_back(work);
    while (done < records.size() && !gives_up) {
      if (job.interrupted && job.interrupted()) gives_up = true;
      progress.at(static_cast<double>(done) / static_cast<double>(records.size()));
      std::this_thread::sleep_for(std::chrono::milliseconds{20});
    }
  }
  if (job.interrupted && job.interrupted()) return Error{Error::Code::Stopped, "interrupted"};
  ComparedRun run;
  run.frequency_hz = first->frequency_hz;
  for (const Frame& frame : first->frames) {
    for (std::string& one : compare::missingPlanes(frame)) run.warnings.push_back(std::move(one));
  }
  if (std::string note = compare::sameSeedWarning(first->frames[0], first->frames[1]); !note.empty())
    run.warnings.push_back(std::move(note));
  run.settings = settingsOf("A", files.camera_a, first->frames[0]);
  for (RunSetting& one : settingsOf("B", files.camera_b, first->frames[1]))
    run.settings.push_back(std::move(one));
  for (std::size_t i = 0; i < results.size(); ++i) {
    if (results[i] && !*results[i]) return results[i]->error();
    if (!results[i]) continue;  // after an error, which another one has
    if (shown.contains(records[i].number)) run.examples.emplace_back(records[i].name, std::move(wholes[i]));
    (standsStill(records[i]) ? run.captures : run.moving).push_back(**std::move(results[i]));
  }
  return run;
}

std::vector<std::string> warningsOf(const RunFiles& files, const std::map<std::size_t, CaptureRecord>& index,
                                    const std::vector<CaptureRecord>& taken) {
  std::vector<std::string> warnings;
  const std::size_t planned = files.schedule.captures.size();
  if (index.size() < planned) {
    warnings.push_back(
        fmt::format("The run is not through: {} of {} are there. `toftwin measure` goes on with it.",
                    index.size(), counted(planned, "capture")));
  }
  std::set<std::string> notes;
  bool by_person = false;
  for (const CaptureRecord& one : taken) {
    by_person = by_person || one.pose_by == "person";
    notes.insert(one.notes.begin(), one.notes.end());
  }
  if (by_person) {
    warnings.emplace_back(
        "A person took a camera to its poses: that both stood where the plan says is taken on trust.");
  }
  double place_mm = 0.0, turn_deg = 0.0;
  std::size_t seen = 0, by_rig = 0;
  bool is_by_planes = false;
  for (const CaptureRecord& one : taken) {
    if (!one.pose_half_widths) continue;
    const auto& h = *one.pose_half_widths;
    place_mm = std::max(place_mm, 1e3 * std::hypot(h[3], h[4], h[5]));
    turn_deg = std::max(turn_deg, 57.29577951308232 * std::hypot(h[0], h[1], h[2]));
    ++(one.pose_by == kByBoardAndRig ? by_rig : seen), is_by_planes = is_by_planes || isPoseFromPlanes(one);
  }
  if (seen + by_rig > 0) {
    const std::string rigs = by_rig > 0 ? fmt::format(", {} by the rig from where they had seen the board,", by_rig) : ",";
    const char* const but_for =
        is_by_planes ? ", but for what the camera's ranges of all planes are off by alike (an offset or a scale), "
                       "which is in the poses themselves and in no interval"
                     : "";
    warnings.push_back(
        fmt::format("{} of {} poses are by what the cameras saw{} known to {:.2f} mm and {:.3f}° (95 %, the worst "
                    "of them){}: errors of range that are as small may be the pose's.",
                    seen, taken.size(), rigs, place_mm, turn_deg, but_for));
  }
  warnings.insert(warnings.end(), notes.begin(), notes.end());
  const auto moving = std::ranges::count_if(taken, [](const CaptureRecord& one) { return !standsStill(one); });
  if (moving > 0)
    warnings.push_back(fmt::format("{} of a moving plate {} not compared pixel by pixel.", counted(moving, "capture"),
                                   moving == 1 ? "is" : "are"));
  return warnings;
}

std::string utcOf(std::time_t time) { return fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(time)); }

/// A log that a run's numbers can be put into, and what it says of the run.
struct OpenLog {
  RunLog log;
  LoggedRun run;
};

/// All that can fail about the log and can be known beforehand: locked captures are judged only once.
Result<std::optional<OpenLog>> openLog(const CompareRunJob& job, const RunFiles& files,
                                       const CaptureRecord& first, const std::string& index_sha256) {
  if (job.log.empty()) return std::optional<OpenLog>{};
  auto log = RunLog::open(job.log);
  if (!log) return log.error();
  if (auto writable = log->checkWritable(); !writable) {
    return Error{writable.error().code,
                 fmt::format("{}: cannot be written: {}", job.log.string(), writable.error().message)};
  }
  LoggedRun run{.began = utcOf(static_cast<std::time_t>(first.began_ns / 1'000'000'000)),
                .folder = std::filesystem::absolute(job.run).string(),
                .plan = files.plan.name,
                .camera_a = files.camera_a,
                .camera_b = files.camera_b,
                .software = "toftwin " TOFTWIN_VERSION,
                .note = job.note,
                .index_sha256 = index_sha256,
                .is_locked = job.locked};
  return std::optional<OpenLog>{OpenLog{*std::move(log), std::move(run)}};
}

compare::Report reportOf(const CompareRunJob& job, const RunFiles& files,
                         const std::vector<CaptureRecord>& records, compare::Finding finding) {
  compare::Report report{.title = "Comparison of time-of-flight cameras"};
  report.subtitle = fmt::format("{} against {}: {} of the plan \"{}\"", records.front().b.source,
                                records.front().a.source,
                                counted(records.size(), job.locked ? "locked capture" : "capture"), files.plan.name);
  report.verdict = finding.headline + ".";
  report.tone = finding.section.tone;
  report.cards = std::move(finding.cards);
  report.data.set(finding.section.id, std::move(finding.data));
  report.sections.push_back(std::move(finding.section));
  report.colophon =
      fmt::format("toftwin {}, {}{}{}", TOFTWIN_VERSION, today(), job.note.empty() ? "" : ", ", job.note);
  report.data.set("software", "toftwin " TOFTWIN_VERSION).set("date", today()).set("note", job.note);
  report.data.set("verdict", report.verdict).set("folder", job.run.string()).set("locked", job.locked);
  return report;
}

}  // namespace

Result<compare::WrittenReport> compareRun(const CompareRunJob& job, compare::Progress& progress) {
  const auto files = readRun(job.run);
  if (!files) return files.error();
  const auto index = readIndex(job.run / kIndexFile);
  if (!index) return index.error();
  std::vector<CaptureRecord> records;
  for (const auto& [number, one] : *index) {
    if (one.is_locked == job.locked) records.push_back(one);
  }
  if (records.empty()) {
    return Error{Error::Code::InvalidArgument, fmt::format("{}: there are no {}captures to compare",
                                                           job.run.string(), job.locked ? "locked " : "")};
  }
  const auto hash = sha256Of(job.run / kIndexFile);
  if (!hash) return hash.error();
  auto log = openLog(job, *files, records.front(), *hash);
  if (!log) return log.error();
  std::error_code failed;
  std::filesystem::create_directories(job.output, failed);
  if (failed) {
    return Error{Error::Code::StorageFull, fmt::format("{}: cannot make the report's folder: {}",
                                                       job.output.string(), failed.message())};
  }
  if (job.locked) {
    const Opening opening{.run = job.run, .report = job.output, .note = job.note};
    if (auto opened = openLocked(opening, records); !opened) return opened.error();
  }
  progress.plan(counted(records.size(), "capture"), 0.3 * static_cast<double>(records.size()));
  progress.plan("report", 3.0);
  auto run = compareAll(job, *files, records, progress);
  if (!run) return run.error();
  run->plan = files->plan.name, run->is_locked = job.locked;
  const auto planned = std::ranges::count(files->schedule.captures, job.locked, &PlannedCapture::is_locked);
  auto made_with = settingsOf(files->plan, files->skipped, records, static_cast<std::size_t>(planned), *hash);
  run->settings.insert(run->settings.begin(), made_with.begin(), made_with.end());
  for (std::string& one : warningsOf(*files, *index, records)) {
    // What the index notes may have been found again.
    if (std::ranges::find(run->warnings, one) == run->warnings.end()) run->warnings.push_back(std::move(one));
  }
  progress.begin();
  auto finding = judgeRun(*run);
  if (!finding) return finding.error();
  progress.end();
  auto notes = std::move(finding->notes);
  auto report = reportOf(job, *files, records, *std::move(finding));
  report.sections.push_back(
      {.id = "provenance", .title = "Provenance", .blocks = {provenanceTable(run->settings)}});
  report.data.set("provenance", toJson(run->settings));
  auto page = compare::write(report, job.output);
  if (!page) return page.error();
  const compare::WrittenReport written{.page = *page, .verdict = report.verdict, .notes = std::move(notes)};
  if (!*log) return written;
  const compare::SameFrames same = sameFramesOf(*run);
  if (same.ofB() > 0) {  // else nothing is known: no frame has anything to be told by
    (*log)->run.frames_of_b = static_cast<std::int64_t>(same.ofB());
    (*log)->run.same_frames = static_cast<std::int64_t>(same.same());
  }
  (*log)->run.settings = run->settings;
  (*log)->run.judged = utcOf(std::time(nullptr));
  if (auto logged = (*log)->log.add((*log)->run, traitsOf(*run)); !logged) {
    return Error{logged.error().code,
                 fmt::format("{} is written, with all numbers in report.json beside it, but they are not in {}: {}",
                             page->string(), job.log.string(), logged.error().message)};
  }
  return written;
}

}  // namespace toftwin::plan
