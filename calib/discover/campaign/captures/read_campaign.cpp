// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <atomic>
#include <cmath>
#include <thread>

#include <fmt/format.h>

#include "calib/discover/campaign/captures/campaign.h"
#include "calib/discover/campaign/captures/gather_capture.h"
#include "calib/plan/compare_capture.h"
#include "calib/plan/compare_run.h"
#include "calib/plan/plan.h"
#include "protocol/record/recording.h"

namespace toftwin::discover {
namespace {

struct ReadOne {
  MeasuredCapture capture;
  CameraInfo camera;
};

Result<ReadOne> readOne(const std::filesystem::path& folder, Side side, const plan::CaptureRecord& record,
                        const std::optional<FrameClass>& without) {
  const plan::RecordedFile& file = side == Side::A ? record.a : record.b;
  if (auto checked = plan::checkHash(folder, file); !checked)
    return ofCapture(record, checked.error().message, checked.error().code);
  auto reader = record::Reader::open(folder / file.file);
  if (!reader) return ofCapture(record, reader.error().message, reader.error().code);
  CaptureGatherer gathered{record, without};
  while (true) {
    auto frame = reader->next();
    if (!frame && frame.error().code == Error::Code::EndOfStream) break;
    if (!frame) return ofCapture(record, frame.error().message, frame.error().code);
    if (auto added = gathered.add(*frame); !added) return added.error();
  }
  if (gathered.frames() < kFewestRepeats) {
    return ofCapture(
        record,
        fmt::format("has {} frame(s): without repeats nothing is known of the noise; measure with "
                    "frames = 8 or more",
                    gathered.frames()),
        Error::Code::InvalidArgument);
  }
  ReadOne one{gathered.finish(), gathered.camera()};
  if (auto& pose = one.capture.moment.world_from_camera; !pose) pose = record.pose;
  return one;
}

Result<std::vector<ReadOne>> readThem(const std::filesystem::path& folder, Side side,
                                      const std::vector<plan::CaptureRecord>& records,
                                      const std::optional<FrameClass>& without) {
  std::vector<std::optional<Result<ReadOne>>> results(records.size());
  std::atomic<std::size_t> next{0};
  std::atomic<bool> gives_up{false};
  {
    const auto work = [&] {
      for (std::size_t i = next++; i < records.size() && !gives_up; i = next++) {
        results[i] = readOne(folder, side, records[i], without);
        if (!*results[i]) gives_up = true;
      }
    };
    std::vector<std::jthread> threads;
    const unsigned workers = std::clamp(std::thread::hardware_concurrency(), 1U, 4U);
    for (unsigned i = 0; i < workers; ++i) threads.emplace_back(work);
  }
  std::vector<ReadOne> all;
  for (auto& result : results) {
    if (result && !*result) return result->error();
    if (result) all.push_back(**std::move(result));
  }
  return all;
}

/// What cannot be compared pixel by pixel, and why; empty: it can.
std::string whyNot(const plan::CaptureRecord& record) {
  if (record.kind == "moving") return "of a moving plate";
  if (record.kind == "dark") return "in the dark";
  return record.pose ? "" : "without a pose";
}

}  // namespace

Result<Campaign> readCampaign(const std::filesystem::path& folder, Side side,
                              const std::optional<FrameClass>& without) {
  const auto index = plan::readIndex(folder / plan::kIndexFile);
  if (!index) return index.error();
  Campaign campaign{.folder = folder, .name = folder.filename().string(), .side = side, .without = without};
  std::vector<plan::CaptureRecord> open;
  std::map<std::string, std::size_t> left_out;
  for (const auto& [number, one] : *index) {
    if (const std::string why = whyNot(one); !why.empty())
      ++left_out[why];
    else
      (one.is_locked ? campaign.locked : open).push_back(one);
  }
  for (const auto& [why, count] : left_out)
    campaign.notes.push_back(
        fmt::format("{} {} {} left out", howMany(count, "capture"), why, count == 1 ? "is" : "are"));
  if (open.empty()) {
    return Error{Error::Code::InvalidArgument,
                 fmt::format("{}: none of its {} can be simulated again: that takes open captures with "
                             "poses, of things that stand still{}",
                             folder.string(), howMany(index->size(), "capture"),
                             left_out.contains("without a pose")
                                 ? "; give poses in the plan, or have a rig take the camera to them"
                                 : "")};
  }
  auto read = readThem(folder, side, open, without);
  if (!read) return read.error();
  campaign.camera = read->front().camera;
  for (ReadOne& one : *read) {
    if (!(one.camera == campaign.camera))
      return ofCapture(one.capture.record,
                       "is of another camera, lens or region than the captures before it");
    campaign.captures.push_back(std::move(one.capture));
  }
  return campaign;
}

Result<std::vector<MeasuredCapture>> readLocked(const Campaign& campaign) {
  if (!campaign.put_aside.empty()) return campaign.put_aside;
  auto read = readThem(campaign.folder, campaign.side, campaign.locked, campaign.without);
  if (!read) return read.error();
  std::vector<MeasuredCapture> captures;
  for (ReadOne& one : *read) {
    if (!(one.camera == campaign.camera))
      return ofCapture(one.capture.record,
                       "is of another camera, lens or region than the open captures");
    captures.push_back(std::move(one.capture));
  }
  return captures;
}

}  // namespace toftwin::discover
