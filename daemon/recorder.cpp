// SPDX-License-Identifier: Apache-2.0
#include "daemon/recorder.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cctype>
#include <system_error>
#include <utility>

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
                   std::uint64_t byte_limit, Done opened)
    : source_(std::move(source)), file_(std::move(file)), byte_limit_(byte_limit) {
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

void Recorder::run(const Done& opened) {
  std::error_code reported_by_create;
  std::filesystem::create_directories(file_.parent_path(), reported_by_create);
  auto writer = record::Writer::create(file_);
  if (!writer) {
    finish(writer.error());
    return opened(writer.error());
  }
  const Wish everything{{}, {.policy = wire::Policy::Lossless, .byte_limit = byte_limit_}};
  auto subscribed = source_->subscribe(everything, [work = work_] {
    {
      const std::scoped_lock lock{work->mutex};
      work->has_items = true;
    }
    work->changed.notify_all();
  });
  if (!subscribed) {
    finish(subscribed.error());
    return opened(subscribed.error());
  }
  opened(file_);
  Result<> written = writeAll(*writer, *subscribed);
  source_->unsubscribe(*subscribed);
  const Result<> closed = writer->close();
  spdlog::info("{}: recorded {} frames into {}", source_->name(), writer->frames(), file_.string());
  finish(written ? closed : written);
}

Result<> Recorder::writeAll(record::Writer& writer, const SubscriberPtr& subscriber) {
  bool is_unsubscribed = false;
  while (true) {
    while (auto item = subscriber->queue.take()) {
      if (const Error* end = std::get_if<Error>(&*item)) {
        const bool is_natural =
            end->code == Error::Code::EndOfStream || end->code == Error::Code::Stopped;
        return is_natural ? Result<>{} : *end;
      }
      const Frame& frame = std::get<FrameQueue::Delivery>(*item).frame->frame;
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
