// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <limits>

#include <toftwin/names.h>

#include "protocol/record/frame_schema.h"
#include "protocol/record/mcap_writer.h"
#include "protocol/record/recording.h"
#include "protocol/wire/codec.h"

namespace toftwin::record {
namespace {

/// MCAP's timestamps have no sign; nothing of ours is from before 1970.
std::uint64_t timestamp(std::int64_t ns) { return ns > 0 ? static_cast<std::uint64_t>(ns) : 0; }

/// When the first exposure began, on the host's clock, where the driver can tell; else the log
/// time, as the MCAP specification wants it.
std::uint64_t publishTime(const Moment& moment) {
  std::int64_t host_ns = 0;
  const bool known = !moment.exposures.empty() && moment.clock.uncertainty_ns >= 0 &&
                     !__builtin_add_overflow(moment.exposures.front().start.ns,
                                             moment.clock.host_minus_device_ns, &host_ns);
  return timestamp(known ? host_ns : moment.received.ns);
}

mcap::Channel channelOf(const Frame& frame, std::uint16_t schema) {
  const CameraInfo& camera = frame.camera;
  mcap::Channel channel;
  channel.schema_id = schema;
  channel.topic = frame.source;
  channel.message_encoding = kMessageEncoding;
  channel.metadata = {
      {"kind", std::string{nameOf(frame.provenance.kind)}},
      {"calibration_id", camera.calibration_id},
      {"camera", fmt::format(R"({{"width":{},"height":{},"fx":{},"fy":{},"cx":{},"cy":{},)"
                             R"("distortion_k1_k2_p1_p2_k3":[{}]}})",
                             camera.width, camera.height, camera.fx, camera.fy, camera.cx,
                             camera.cy, fmt::join(camera.distortion, ","))}};
  return channel;
}

}  // namespace

struct Writer::State {
  mcap::FileWriter file;
  std::uint16_t schema = 0;
  /// One channel for each source; one more when its camera changes, because a channel says which.
  std::map<std::string, std::pair<CameraInfo, std::uint16_t>> channels;
  WriterOptions options;

  Result<> checkRoomFor(std::uint64_t message_bytes) const;
  Result<std::uint16_t> channelFor(const Frame& frame) {
    const auto known = channels.find(frame.source);
    if (known != channels.end() && known->second.first == frame.camera) return known->second.second;
    const auto added = file.addChannel(channelOf(frame, schema));
    if (added) channels[frame.source] = {frame.camera, *added};
    return added;
  }
};

Writer::Writer(std::unique_ptr<State> state) : state_(std::move(state)) {}
Writer::Writer(Writer&&) noexcept = default;

Writer& Writer::operator=(Writer&& other) noexcept {
  std::swap(state_, other.state_);
  return *this;
}

Writer::~Writer() {
  if (state_) static_cast<void>(state_->file.close());
}

Result<Writer> Writer::create(const std::filesystem::path& file, WriterOptions options) {
  auto made = mcap::FileWriter::create(file, options);
  if (!made) return made.error();
  auto state = std::make_unique<State>(State{std::move(made).value(), 0, {}, options});
  const auto schema = state->file.addSchema(frameSchema());
  if (!schema) return schema.error();
  state->schema = *schema;
  return Writer{std::move(state)};
}

/// Before each frame what closing would write then is set against the bounds, so that they hold for the
/// closed file; uncompressed, which ends it at most about a chunk too early.
Result<> Writer::State::checkRoomFor(std::uint64_t message_bytes) const {
  if (options.most_bytes == 0 && options.keep_free_bytes == 0) return {};
  // Two names of at most 255 bytes, the lens as JSON and the keys: well below.
  constexpr std::uint64_t kMostChannelBytes = 2048;
  const std::uint64_t closed = file.closedSize(message_bytes, kMostChannelBytes);
  if (options.most_bytes > 0 && closed > options.most_bytes) {
    return Error{Error::Code::StorageFull,
                 fmt::format("{}: with another frame it could be larger than the {} MB that it may "
                             "have. The recording is whole up to there: {} frames",
                             file.path().string(), options.most_bytes >> 20,
                             file.messages())};
  }
  if (options.keep_free_bytes == 0) return {};
  const auto free = file.file().freeBytes();
  if (!free) return free.error();
  if (*free >= closed - file.file().size() &&
      *free - (closed - file.file().size()) >= options.keep_free_bytes)
    return {};
  return Error{Error::Code::StorageFull,
               fmt::format("{}: with another frame less than {} MB could stay free on its disk, which "
                           "has {} MB; free space there or record somewhere else. The recording is "
                           "whole up to there: {} frames",
                           file.path().string(), options.keep_free_bytes >> 20, *free >> 20,
                           file.messages())};
}

Result<> Writer::write(const Frame& frame) {
  const auto message = wire::encode(wire::FrameMessage{0, frame});
  if (!message) return message.error();
  if (auto room = state_->checkRoomFor(message->size()); !room) return room;
  const auto channel = state_->channelFor(frame);
  if (!channel) return channel.error();
  std::vector<std::span<const std::byte>> pieces{message->head};
  for (const Buffer& piece : message->body.pieces) pieces.push_back(piece.bytes());
  const mcap::Message head{.channel_id = *channel,
                           .sequence = static_cast<std::uint32_t>(frame.sequence),  // its low half
                           .log_time_ns = timestamp(frame.moment.received.ns),
                           .publish_time_ns = publishTime(frame.moment),
                           .data = {}};
  return state_->file.write(head, pieces);
}

void Writer::setHurried(bool is_hurried) { state_->file.setHurried(is_hurried); }
std::optional<std::chrono::steady_clock::time_point> Writer::dueAt() const { return state_->file.dueAt(); }
Result<> Writer::closeDue() { return state_->file.closeDue(); }
Result<> Writer::close() { return state_->file.close(); }
std::uint64_t Writer::frames() const { return state_->file.messages(); }
std::uint64_t Writer::lost() const { return state_->file.lost(); }

}  // namespace toftwin::record
