// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/campaign/answer/before_search.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <fstream>
#include <set>
#include <system_error>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "calib/plan/opened.h"

namespace toftwin::discover {
namespace {

/// A bare recording's captures are put aside anew by each search: nothing is opened.
bool opensLocked(const CampaignJob& job) { return job.open_locked && std::filesystem::is_directory(job.run); }

plan::OpenedOf cameraOf(const CampaignJob& job) {
  return job.side == Side::A ? plan::OpenedOf::A : plan::OpenedOf::B;
}

Error cannotWriteInto(const std::filesystem::path& folder, const std::string& why) {
  return {Error::Code::StorageFull,
          fmt::format("{}: no report can be written there: {}", folder.string(), why)};
}

Result<> tryToWrite(const std::filesystem::path& folder) {
  std::error_code failed;
  std::filesystem::create_directories(folder, failed);
  if (failed) return cannotWriteInto(folder, failed.message());
  const auto trial = folder / ".toftwin-trial";
  errno = 0;
  std::ofstream out{trial};
  out << "can anything be written here?" << std::flush;
  if (!out) return cannotWriteInto(folder, std::generic_category().message(errno));
  std::filesystem::remove(trial, failed);
  return {};
}

/// Each once, in MHz; exposures that state none are left out.
std::vector<double> frequenciesIn(const std::vector<Exposure>& exposures) {
  std::vector<double> all;
  for (const Exposure& one : exposures)
    if (one.modulation > Frequency{}) all.push_back(one.modulation.in(megahertz));
  std::ranges::sort(all);
  all.erase(std::unique(all.begin(), all.end()), all.end());
  return all;
}

std::string frequenciesInWords(const std::vector<double>& all) {
  if (all.empty()) return "no modulation";
  std::string words;
  for (const double one : all) words += fmt::format("{}{:.6g}", words.empty() ? "" : ", ", one);
  return words + " MHz";
}

}  // namespace

Result<> checkCanWrite(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> missing;  // the innermost first
  std::error_code failed;
  for (auto one = std::filesystem::absolute(folder); !std::filesystem::exists(one, failed);
       one = one.parent_path())
    missing.push_back(one);
  auto done = tryToWrite(folder);
  for (const auto& one : missing) std::filesystem::remove(one, failed);
  return done;
}

Result<> checkFrequencies(const Campaign& campaign, const sim::SensorModel& model) {
  const auto areAmong = [](const std::vector<double>& some, const std::vector<double>& all) {
    constexpr double kSame = 1e-3;  // crystals differ by a tenth of that
    return std::ranges::all_of(some, [&](double frequency) {
      return std::ranges::any_of(all, [&](double one) { return std::abs(frequency - one) <= kSame * one; });
    });
  };
  const std::vector<double> own = frequenciesIn(model.exposures({}));
  for (const MeasuredCapture& capture : campaign.captures) {
    const std::vector<double> stated = frequenciesIn(capture.moment.exposures);
    if (stated.empty() || (areAmong(stated, own) && areAmong(own, stated))) continue;
    return Error{
        Error::Code::InvalidArgument,
        fmt::format(
            "capture {} (\"{}\") states modulation at {}, the camera file's camera has {}: these are "
            "not the same camera, or it was set otherwise; give the camera file of the camera that was "
            "measured (--model)",
            capture.record.number, capture.record.name, frequenciesInWords(stated), frequenciesInWords(own))};
  }
  return {};
}

Result<> checkStillClosed(const CampaignJob& job) {
  if (!opensLocked(job)) return {};
  const auto closed = plan::checkClosed(job.run, cameraOf(job));
  if (closed) return {};
  return Error{closed.error().code, closed.error().message + ", or search without them (--keep-locked)"};
}

Result<> checkLockedFiles(const CampaignJob& job, const Campaign& campaign) {
  if (!opensLocked(job)) return {};
  return plan::checkHashes(job.run, cameraOf(job), campaign.locked);
}

void noteNoiseDrawnAlike(const std::vector<MeasuredCapture>& captures, std::vector<std::string>& notes) {
  std::set<std::pair<std::uint64_t, std::int64_t>> drawn;
  std::size_t alike = 0;
  for (const MeasuredCapture& capture : captures) {
    const bool is_any = std::ranges::any_of(capture.drawn_by, [&](const auto& one) { return drawn.contains(one); });
    alike += is_any ? 1 : 0;
    drawn.insert(capture.drawn_by.begin(), capture.drawn_by.end());
  }
  if (alike == 0) return;
  notes.push_back(fmt::format(
      "The camera is simulated, and the noise of {} of the {} captures is drawn like that of earlier ones: it passes "
      "for a pattern of the camera's pixels. Give each source, as those of the plan's blocks, a seed of its own, and "
      "let the daemon run on for the whole run.",
      alike, captures.size()));
}

Result<> openLockedOf(const CampaignJob& job, const Campaign& campaign) {
  if (!opensLocked(job)) return {};
  return plan::openLocked({.run = job.run, .cameras = cameraOf(job), .report = job.output, .note = job.note},
                          campaign.locked);
}

}  // namespace toftwin::discover
