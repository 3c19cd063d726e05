// SPDX-License-Identifier: Apache-2.0
#include "daemon/recorder.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <system_error>
#include <utility>

#include "daemon/thrown.h"
#include "drivers/logging.h"

namespace toftwin::daemon {

Result<std::filesystem::path> recordingPath(const std::filesystem::path& folder,
                                            std::string_view name) {
  constexpr std::size_t kLongest = 200;
  const bool is_bare = !name.empty() && name.size() <= kLongest && name.front() != '.' &&
                       std::ranges::all_of(name, [](unsigned char c) {
                         return std::isalnum(c) != 0 || c == '-' || c == '_' || c == '.';
                       });
  if (!is_bare) {
    return Error{
        Error::Code::InvalidArgument,
        fmt::format("a recording is named by a bare file name of letters, digits, '-', '_' and "
                    "'.', at most {} long, not beginning with '.'; it lies in the daemon's "
                    "recording folder",
                    kLongest)};
  }
  if (folder.empty()) {
    return Error{Error::Code::Unsupported,
                 "this daemon does not record: set recording_folder in its configuration"};
  }
  std::filesystem::path file = folder / name;
  if (file.extension() != ".mcap") file += ".mcap";
  return file;
}

Recorder::Recorder(std::shared_ptr<SourceHost> source, std::filesystem::path file,
                   Options options)
    : source_(std::move(source)), file_(std::move(file)), options_(std::move(options)) {}

void Recorder::start(Done opened) {
  const auto shared = std::make_shared<const Done>(std::move(opened));  // with the thread
  try {
    thread_ = std::jthread{[this, shared] { run(*shared); }};
  } catch (...) {
    finish(notOpened(*shared, thrownError("starting to record")));
  }
}

Recorder::~Recorder() {
  askToStop();  // nothing that needs memory: this also runs where there is none left
  if (thread_.joinable()) thread_.join();
}

void Recorder::askToStop() {
  {
    const std::scoped_lock lock{work_->mutex};
    work_->is_stopping = true;
  }
  work_->changed.notify_all();
}

void Recorder::stop(Done closed) {
  std::optional<Result<std::filesystem::path>> outcome;
  {
    const std::scoped_lock lock{mutex_};
    outcome = outcome_;
    is_told_ = is_told_ || outcome_.has_value();
    if (!outcome && !closed_) closed_ = std::exchange(closed, nullptr);
  }
  askToStop();
  if (closed == nullptr) return;
  closed(outcome ? *outcome : Error{Error::Code::Busy, "the recording is being closed already"});
}

bool Recorder::isFinished() const {
  const std::scoped_lock lock{mutex_};
  return outcome_.has_value();
}

bool Recorder::isSettled() const {
  const std::scoped_lock lock{mutex_};
  return outcome_.has_value() && is_told_;
}

std::string Recorder::problem() const {
  const std::scoped_lock lock{mutex_};
  return outcome_ && !*outcome_ && !is_told_ ? outcome_->error().message : problem_;
}

/// Nothing that is thrown leaves the thread: the recording ends with it, the daemon does not.
void Recorder::run(const Done& opened) noexcept {
  bool is_answered = false;
  const Done answer = [&](Result<std::filesystem::path> result) {
    is_answered = true;
    opened(std::move(result));
  };
  try {
    if (options_.plan) recordOnAndOn();
    finish(options_.plan ? Result<>{} : recordUntilEnd(answer));
  } catch (...) {
    try {
      const Error why = thrownError("recording");
      finish(is_answered ? why : notOpened(answer, why));
    } catch (...) {  // whoever waits for an answer learns it when the connection closes
      const std::scoped_lock lock{mutex_};
      if (!outcome_) outcome_ = Error{};
    }
  }
}

/// Tells whoever wanted the recording why there is none, which settles it: they may start another.
Error Recorder::notOpened(const Done& opened, Error why) {
  {
    const std::scoped_lock lock{mutex_};
    outcome_ = why;
    is_told_ = true;
  }
  opened(why);
  return why;
}

Wish Recorder::everything() const {
  return {{},
          {.policy = wire::Policy::Lossless,
           .byte_limit = options_.backlog_bytes,
           .account = options_.account,
           .keeps_at_overrun = true},
          options_.who};
}

Result<SubscriberPtr> Recorder::subscribe() {
  return source_->subscribe(everything(), [work = work_] {
    {
      const std::scoped_lock lock{work->mutex};
      work->has_items = true;
    }
    work->changed.notify_all();
  });
}

namespace {

/// However a recording ends, its source is left.
struct Unsubscribe {
  SourceHost& source;
  const SubscriberPtr& subscriber;
  ~Unsubscribe() { source.unsubscribe(subscriber); }
};

void tellRecorded(const std::string& source, const std::filesystem::path& file, const record::Writer& writer) {
  logging::info("{}: recorded {} frames into {}{}", source, writer.frames(), file.string(),
                writer.lost() > 0 ? fmt::format("; {} more did not fit", writer.lost()) : "");
}

}  // namespace

Result<> Recorder::recordUntilEnd(const Done& opened) {
  // Before a file is made for nothing.
  if (auto possible = source_->check(everything()); !possible) return notOpened(opened, possible.error());
  std::error_code reported_by_create;
  std::filesystem::create_directories(file_.parent_path(), reported_by_create);
  auto writer = record::Writer::create(file_, options_.file);
  if (!writer) return notOpened(opened, writer.error());
  auto subscribed = subscribe();
  if (!subscribed) return notOpened(opened, subscribed.error());
  const Unsubscribe at_the_end{*source_, *subscribed};
  opened(file_);
  Result<> written = writeAll(*writer, *subscribed);
  const Result<> closed = writer->close();
  tellRecorded(source_->name(), file_, *writer);
  if (!written && written.error().code == Error::Code::StorageFull) {
    return Error{Error::Code::StorageFull,
                 fmt::format("{} (recording.max_mb = {}, recording.keep_free_mb = {})",
                             written.error().message, options_.file.most_bytes >> 20,
                             options_.file.keep_free_bytes >> 20)};
  }
  return written ? closed : written;
}

Result<> Recorder::writeAll(record::Writer& writer, const SubscriberPtr& subscriber) {
  bool is_unsubscribed = false;
  while (true) {
    const auto frame = nextFrame(subscriber, &writer, is_unsubscribed);
    if (!frame) return frame.error();
    if (!*frame) return {};
    if (auto written = writeNext(writer, **frame); !written) return written;
  }
}

bool isBehind(SteadyTime made_at, SteadyTime now, std::chrono::milliseconds chunk_time) {
  return now - made_at > chunk_time / 2;
}

/// What waits is lost if the daemon is killed; packing is what takes longest.
Result<> Recorder::writeNext(record::Writer& writer, const PreparedFrame& frame) const {
  writer.setHurried(isBehind(frame.made_at, std::chrono::steady_clock::now(), options_.file.chunk_time));
  return writer.write(frame.frame);
}

/// Waits for it, and finishes a chunk meanwhile that has been open for long enough. Null at the source's end, and when all is
/// written after the recording was stopped.
Result<PreparedFramePtr> Recorder::nextFrame(const SubscriberPtr& subscriber, record::Writer* writer, bool& is_unsubscribed) {
  while (true) {
    if (auto item = subscriber->backlog.take()) {
      if (auto* delivery = std::get_if<Backlog::Delivery>(&*item)) return std::move(delivery->frame);
      const Error& end = std::get<Error>(*item);
      const bool is_natural = end.code == Error::Code::EndOfStream || end.code == Error::Code::Stopped;
      if (is_natural) return PreparedFramePtr{};
      return end;
    }
    std::unique_lock lock{work_->mutex};
    if (work_->is_stopping && is_unsubscribed) return PreparedFramePtr{};
    if (work_->is_stopping) {
      // Nothing comes after this, so what waits then is all: every frame that a client has seen.
      lock.unlock();
      source_->unsubscribe(subscriber);
      source_->waitForDelivery();
      is_unsubscribed = true;
      continue;
    }
    const auto is_woken = [this] { return work_->has_items || work_->is_stopping; };
    const auto due = writer != nullptr ? writer->dueAt() : std::nullopt;
    if (!due) {
      work_->changed.wait(lock, is_woken);
    } else if (!work_->changed.wait_until(lock, *due, is_woken)) {
      lock.unlock();
      if (auto closed = writer->closeDue(); !closed) return closed.error();
      continue;
    }
    work_->has_items = false;
  }
}

void Recorder::finish(Result<> outcome) {
  if (!outcome) {
    logging::error("{}: recording {}: {}", source_->name(), file_.string(),
                   outcome.error().message);
  }
  Done closed;
  Result<std::filesystem::path> result = file_;
  if (!outcome) result = outcome.error();
  {
    const std::scoped_lock lock{mutex_};
    if (!outcome_) outcome_ = result;
    closed = std::move(closed_);
    is_told_ = is_told_ || closed != nullptr;
  }
  if (closed) closed(result);
}

}  // namespace toftwin::daemon
