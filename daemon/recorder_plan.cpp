// SPDX-License-Identifier: Apache-2.0
// A recording that goes on for as long as its source is configured, in one file after another.
#include <fmt/format.h>

#include <chrono>
#include <system_error>
#include <utility>

#include "daemon/recorder.h"
#include "daemon/thrown.h"
#include "drivers/logging.h"

namespace toftwin::daemon {
namespace {

constexpr std::chrono::seconds kPause{1};  ///< before it is tried again

/// Before it begins, and after the source was away.
void tellHowLong(const SourceHost& source, const RecordPlan& plan, std::uint64_t keep_free_bytes) {
  const auto about = source.describe();
  if (!about || !about->frame_interval) return;
  const auto bytes = static_cast<double>(bytesOf({}, about->camera, about->planes, {}));
  logging::info("{}: recording into {}: {}", source.name(), plan.pattern.string(),
                howLong(plan, keep_free_bytes, bytes / about->frame_interval->in(second)));
}

}  // namespace

/// Whatever ends it, a full disk or a source that is not there yet, it is tried again; but for the end of what a source has.
void Recorder::recordOnAndOn() {
  do {
    Result<> outcome;
    try {
      outcome = recordFiles();
    } catch (...) {
      outcome = thrownError("recording");
    }
    const bool is_through = !outcome && outcome.error().code == Error::Code::EndOfStream;
    noteProblem(is_through ? Result<>{} : outcome);
    if (is_through) return;
  } while (waitBeforeAnother());
}

/// False if it is to stop.
bool Recorder::waitBeforeAnother() {
  std::unique_lock lock{work_->mutex};
  work_->changed.wait_for(lock, kPause, [this] { return work_->is_stopping; });
  return !work_->is_stopping;
}

/// Said once. A source that is not there is told by itself.
void Recorder::noteProblem(const Result<>& outcome) {
  const bool is_away = !outcome && outcome.error().code == Error::Code::Disconnected;
  const std::string text = outcome || is_away ? "" : outcome.error().message;
  const std::scoped_lock lock{mutex_};
  if (!text.empty() && text != problem_) {
    logging::error("{}: recording {}: {}; it is tried again", source_->name(), options_.plan->pattern.string(), text);
  }
  problem_ = text;
}

/// Error EndOfStream: nothing more comes.
Result<> Recorder::recordFiles() {
  if (auto possible = source_->check(everything()); !possible) return possible;
  std::error_code reported_by_create;
  std::filesystem::create_directories(options_.plan->pattern.parent_path(), reported_by_create);
  auto subscribed = subscribe();
  if (!subscribed) return subscribed.error();
  tellHowLong(*source_, *options_.plan, options_.file.keep_free_bytes);
  struct Leave {
    SourceHost& source;
    const SubscriberPtr& subscriber;
    ~Leave() { source.unsubscribe(subscriber); }
  } const at_the_end{*source_, *subscribed};
  std::optional<record::Writer> writer;  // from the first frame on: no file is without one
  bool is_unsubscribed = false;
  Result<> outcome;
  while (outcome) {
    auto frame = nextFrame(*subscribed, writer ? &*writer : nullptr, is_unsubscribed);
    if (!frame || !*frame) {
      outcome = frame ? Error{Error::Code::EndOfStream, "the source has ended"} : frame.error();
      break;
    }
    outcome = writeInto(writer, **frame);
    if (outcome) noteProblem({});
  }
  const Result<> closed = closeLast(writer);
  const bool has_failed = !outcome && outcome.error().code != Error::Code::EndOfStream;
  return has_failed || closed ? outcome : closed;
}

/// Into the file that is due.
Result<> Recorder::writeInto(std::optional<record::Writer>& writer, const PreparedFrame& frame) {
  const std::int64_t age_ns = options_.clock->wall().ns - began_.ns;
  const std::int64_t split_ns = std::chrono::nanoseconds{options_.plan->split}.count();
  if (!writer || (split_ns > 0 && age_ns >= split_ns)) {
    if (auto opened = openNext(writer); !opened) return opened;
  }
  const Result<> written = writeNext(*writer, frame);
  if (written || written.error().code != Error::Code::StorageFull || writer->frames() == 0) return written;
  // It has the size at which it is split, or its disk is full: older ones may make room.
  if (auto opened = openNext(writer); !opened) return opened;
  return writeNext(*writer, frame);
}

Result<> Recorder::closeLast(std::optional<record::Writer>& writer) {
  if (!writer) return {};
  const Result<> closed = writer->close();
  logging::info("{}: recorded {} frames into {}", source_->name(), writer->frames(), writing_.string());
  writer.reset();
  return closed;
}

Result<> Recorder::openNext(std::optional<record::Writer>& writer) {
  if (auto closed = closeLast(writer); !closed) return closed;
  // A chunk of room, so that the next file does not end before it has begun.
  constexpr std::uint64_t kRoom = 64ull << 20;
  const bool is_bounded = options_.file.keep_free_bytes > 0;
  const HostTime now = options_.clock->wall();
  const std::size_t gone = makeRoom(*options_.plan, now, is_bounded ? options_.file.keep_free_bytes + kRoom : kRoom);
  if (gone > 0) logging::info("{}: {} old recordings made room", source_->name(), gone);
  record::WriterOptions file = options_.file;
  if (options_.plan->split_bytes > 0) file.most_bytes = options_.plan->split_bytes;
  writing_ = nextFile(*options_.plan, now);
  auto made = record::Writer::create(writing_, file);
  if (!made) return made.error();
  writer.emplace(*std::move(made));
  began_ = now;
  return {};
}

}  // namespace toftwin::daemon
