// SPDX-License-Identifier: Apache-2.0
// What frames come from: a source of a daemon, a recording.
#include <algorithm>
#include <filesystem>
#include <utility>

#include <fmt/format.h>

#include "calib/compare/feed.h"
#include "protocol/record/recording.h"

namespace toftwin::compare {
namespace {

class ClientFeed final : public Feed {
 public:
  ClientFeed(Client& client, std::string source, SourceDetails details, SubscribeOptions options,
             Subscription subscription)
      : client_(client),
        source_(std::move(source)),
        details_(std::move(details)),
        options_(std::move(options)),
        subscription_(std::move(subscription)) {}
  [[nodiscard]] const SourceDetails& details() const override { return details_; }
  Result<Frame> next(std::chrono::milliseconds timeout) override {
    auto frame = subscription_.next(timeout);
    // It may have been in the making when the subscription began.
    if (frame && std::exchange(is_first_dubious_, false)) frame = subscription_.next(timeout);
    return frame;
  }
  Result<> beginAnew() override {
    if (details_.can_lockstep) return {};  // makes a frame when we ask, and not before
    auto again = client_.subscribe(source_, options_);
    if (!again) return again.error();
    subscription_ = *std::move(again);
    is_first_dubious_ = true;
    return {};
  }
  Result<> setPose(const Transform<World, Camera>& pose) override { return client_.setPose(source_, pose); }
  Result<> setParameter(std::string_view name, double value) override {
    return client_.setParameter(source_, name, value);
  }

 private:
  Client& client_;
  std::string source_;
  SourceDetails details_;
  SubscribeOptions options_;
  Subscription subscription_;
  bool is_first_dubious_ = false;
};

class RecordingFeed final : public Feed {
 public:
  RecordingFeed(record::Reader reader, SourceDetails details)
      : reader_(std::move(reader)), details_(std::move(details)), whole_(reader_.checkWhole()) {}
  [[nodiscard]] const SourceDetails& details() const override { return details_; }
  Result<Frame> next(std::chrono::milliseconds) override { return reader_.next(details_.entry.name); }
  Result<> setPose(const Transform<World, Camera>&) override {
    return Error{Error::Code::Unsupported, "a recording cannot be moved"};
  }
  [[nodiscard]] bool isRecorded() const override { return true; }
  [[nodiscard]] std::string warning() const override {
    const std::string& damage = reader_.summary().damage;
    std::string said;
    if (!damage.empty()) {
      said = fmt::format("The recording of {} is damaged, or was not closed: {}. Only what can be read of it is compared.",
                         details_.entry.name, damage);
    }
    if (whole_.damaged == 0) return said;
    // Whether it is met hangs on how many frames are asked for.
    return fmt::format("{}{}Of the recording of {}, {} of {} chunks cannot be read, and no frame of them is compared. "
                       "The first: {}.",
                       said, said.empty() ? "" : " ", details_.entry.name, whole_.damaged, whole_.chunks,
                       whole_.first_damage);
  }

 private:
  record::Reader reader_;
  SourceDetails details_;
  record::Whole whole_;
};

}  // namespace

Result<> Feed::setParameter(std::string_view name, double) {
  return Error{Error::Code::Unsupported, fmt::format("{}: has no parameter {}", details().entry.name, name)};
}

Result<std::unique_ptr<Feed>> openFeed(Client& client, const std::string& source,
                                       const std::vector<PlaneKind>& more) {
  auto details = client.describe(source);
  if (!details) return details.error();
  SubscribeOptions options;
  // Not Lossless: a fast camera's frames would pile up while the other one traces a pose, end with
  // Overrun at the daemon's memory limit, and before that be seconds old when they are paired.
  options.policy =
      details->can_lockstep ? SubscribeOptions::Policy::Lockstep : SubscribeOptions::Policy::Latest;
  // What the comparison reads; raw samples and phasors would only cost bandwidth.
  for (const PlaneKind kind : details->planes) {
    if (kind == PlaneKind::Range || kind == PlaneKind::Depth || kind == PlaneKind::Amplitude ||
        kind == PlaneKind::Flags || std::ranges::find(more, kind) != more.end())
      options.planes.push_back(kind);
  }
  const auto isRange = [](PlaneKind kind) { return kind == PlaneKind::Range || kind == PlaneKind::Depth; };
  if (std::ranges::none_of(options.planes, isRange)) {
    return Error{Error::Code::Unsupported,
                 fmt::format("{}: gives neither range nor depth, so there is nothing to compare", source)};
  }
  auto subscription = client.subscribe(source, options);
  if (!subscription) return subscription.error();
  return std::unique_ptr<Feed>{std::make_unique<ClientFeed>(client, source, *std::move(details),
                                                            std::move(options), *std::move(subscription))};
}

Result<std::unique_ptr<Feed>> openRecording(const std::string& file_and_source) {
  const std::size_t hash = file_and_source.rfind('#');
  const std::string file = file_and_source.substr(0, hash);
  std::string source = hash == std::string::npos ? "" : file_and_source.substr(hash + 1);
  auto reader = record::Reader::open(file);
  if (!reader) return reader.error();
  const auto& sources = reader->summary().frames_per_source;
  if (sources.empty()) {
    const std::string& damage = reader->summary().damage;
    return Error{Error::Code::InvalidArgument,
                 damage.empty() ? fmt::format("{} holds no frames", file)
                                : fmt::format("{}: no frame of it can be read: {}", file, damage)};
  }
  std::string known;
  for (const auto& [name, frames] : sources) known += (known.empty() ? "" : ", ") + name;
  if (source.empty() && sources.size() == 1) source = sources.begin()->first;
  if (!sources.contains(source)) {
    return Error{Error::Code::InvalidArgument,
                 fmt::format("{} holds the sources {}; name one as {}#SOURCE", file, known, file)};
  }
  auto first = reader->next(source);
  if (!first) return first.error();
  reader->rewind();
  SourceDetails details;
  details.entry = {.name = source,
                   .model = fmt::format("recording {}", std::filesystem::path{file}.filename().string()),
                   .serial = {},
                   .kind = FrameKind::Replayed};
  details.driver = "recording";
  details.camera = first->camera;
  return std::unique_ptr<Feed>{std::make_unique<RecordingFeed>(*std::move(reader), std::move(details))};
}

}  // namespace toftwin::compare
