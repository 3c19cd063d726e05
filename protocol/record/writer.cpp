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
  std::uint64_t frames = 0;

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
  auto state = std::make_unique<State>(State{std::move(made).value(), 0, {}, 0});
  const auto schema = state->file.addSchema(frameSchema());
  if (!schema) return schema.error();
  state->schema = *schema;
  return Writer{std::move(state)};
}

Result<> Writer::write(const Frame& frame) {
  const auto channel = state_->channelFor(frame);
  if (!channel) return channel.error();
  const auto message = wire::encode(wire::FrameMessage{0, frame});
  if (!message) return message.error();
  std::vector<std::span<const std::byte>> pieces{message->head};
  for (const Buffer& piece : message->body.pieces) pieces.push_back(piece.bytes());
  const mcap::Message head{.channel_id = *channel,
                           .sequence = static_cast<std::uint32_t>(frame.sequence),  // its low half
                           .log_time_ns = timestamp(frame.moment.received.ns),
                           .publish_time_ns = publishTime(frame.moment),
                           .data = {}};
  if (auto wrote = state_->file.write(head, pieces); !wrote) return wrote;
  ++state_->frames;
  return {};
}

Result<> Writer::close() { return state_->file.close(); }
std::uint64_t Writer::frames() const { return state_->frames; }

}  // namespace toftwin::record
