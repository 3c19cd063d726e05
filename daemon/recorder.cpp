// SPDX-License-Identifier: Apache-2.0
#include "daemon/recorder.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cctype>
#include <system_error>
#include <utility>

#include "daemon/thrown.h"

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
  std::error_code ignored;
  if (std::filesystem::exists(file, ignored)) {
    return Error{Error::Code::InvalidArgument,
                 fmt::format("{} exists already and is not overwritten; choose another name",
                             file.string())};
  }
  return file;
}

Recorder::Recorder(std::shared_ptr<SourceHost> source, std::filesystem::path file,
                   Options options, Done opened)
    : source_(std::move(source)), file_(std::move(file)), options_(options) {
  thread_ = std::jthread{[this, done = std::move(opened)] { run(done); }};
}

Recorder::~Recorder() {
  stop([](const Result<std::filesystem::path>&) {});
  thread_.join();
}

void Recorder::stop(Done closed) {
  std::optional<Result<std::filesystem::path>> outcome;
  {
    const std::scoped_lock lock{mutex_};
    outcome = outcome_;
    is_told_ = is_told_ || outcome_.has_value();
    if (!outcome && !closed_) closed_ = std::exchange(closed, nullptr);
  }
  {
    const std::scoped_lock lock{work_->mutex};
    work_->is_stopping = true;
  }
  work_->changed.notify_all();
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
  return outcome_ && !*outcome_ ? outcome_->error().message : std::string{};
}

/// Nothing that is thrown leaves the thread: the recording ends with it, the daemon does not.
void Recorder::run(const Done& opened) {
  try {
    finish(recordUntilEnd(opened));
  } catch (...) {
    finish(thrownError("recording"));
  }
}

Result<> Recorder::recordUntilEnd(const Done& opened) {
  std::error_code reported_by_create;
  std::filesystem::create_directories(file_.parent_path(), reported_by_create);
  auto writer = record::Writer::create(file_, options_.file);
  if (!writer) {
    finish(writer.error());
    opened(writer.error());
    return writer.error();
  }
  const Wish everything{{}, {.policy = wire::Policy::Lossless, .byte_limit = options_.backlog_bytes}};
  auto subscribed = source_->subscribe(everything, [work = work_] {
    {
      const std::scoped_lock lock{work->mutex};
      work->has_items = true;
    }
    work->changed.notify_all();
  });
  if (!subscribed) {
    finish(subscribed.error());
    opened(subscribed.error());
    return subscribed.error();
  }
  struct Unsubscribe {
    SourceHost& source;
    const SubscriberPtr& subscriber;
    ~Unsubscribe() { source.unsubscribe(subscriber); }
  } const at_the_end{*source_, *subscribed};
  opened(file_);
  Result<> written = writeAll(*writer, *subscribed);
  const Result<> closed = writer->close();
  spdlog::info("{}: recorded {} frames into {}", source_->name(), writer->frames(), file_.string());
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
    while (auto item = subscriber->backlog.take()) {
      if (const Error* end = std::get_if<Error>(&*item)) {
        const bool is_natural =
            end->code == Error::Code::EndOfStream || end->code == Error::Code::Stopped;
        return is_natural ? Result<>{} : *end;
      }
      const Frame& frame = std::get<Backlog::Delivery>(*item).frame->frame;
      if (auto written = writer.write(frame); !written) return written;
    }
    std::unique_lock lock{work_->mutex};
    if (work_->is_stopping && is_unsubscribed) return {};
    if (work_->is_stopping) {
      // Nothing comes after this, so what waits then is all: every frame that a client has seen.
      lock.unlock();
      source_->unsubscribe(subscriber);
      source_->waitForDelivery();
      is_unsubscribed = true;
      continue;
    }
    work_->changed.wait(lock, [this] { return work_->has_items || work_->is_stopping; });
    work_->has_items = false;
  }
}

void Recorder::finish(Result<> outcome) {
  if (isFinished()) return;  // before `opened`, so that whoever is told may start another
  if (!outcome) {
    spdlog::error("{}: recording {}: {}", source_->name(), file_.string(), outcome.error().message);
  }
  Done closed;
  Result<std::filesystem::path> result = file_;
  if (!outcome) result = outcome.error();
  {
    const std::scoped_lock lock{mutex_};
    outcome_ = result;
    closed = std::move(closed_);
    is_told_ = closed != nullptr;
  }
  if (closed) closed(result);
}

}  // namespace toftwin::daemon
