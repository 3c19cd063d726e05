// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>

#include "protocol/record/frame_schema.h"
#include "protocol/record/mcap_reader.h"
#include "protocol/record/recording.h"
#include "protocol/wire/codec.h"

namespace toftwin::record {
namespace {

std::int64_t hostTime(std::uint64_t timestamp_ns) {
  constexpr std::uint64_t kMost = 0x7fff'ffff'ffff'ffffu;
  return static_cast<std::int64_t>(std::min(timestamp_ns, kMost));
}

bool holdsFrames(const mcap::Channel& channel) {
  return channel.message_encoding == kMessageEncoding;
}

Summary summarise(const mcap::FileReader& file) {
  Summary summary;
  const mcap::Statistics& statistics = file.statistics();
  for (const auto& [id, channel] : file.channels()) {
    if (!holdsFrames(channel)) continue;
    const auto counted = statistics.messages_per_channel.find(id);
    summary.frames_per_source[channel.topic] +=
        counted == statistics.messages_per_channel.end() ? 0 : counted->second;
  }
  summary.first_ns = hostTime(statistics.start_time_ns);
  summary.last_ns = hostTime(statistics.end_time_ns);
  summary.indexed = file.indexed();
  summary.damage = file.damage();
  return summary;
}

/// The error if the file has channels, but none of frames.
Result<> checkHoldsFrames(const mcap::FileReader& file) {
  const auto& channels = file.channels();
  const bool foreign = !channels.empty() && std::ranges::none_of(channels, [](const auto& channel) {
    return holdsFrames(channel.second);
  });
  if (!foreign) return {};
  const mcap::Channel& first = channels.begin()->second;
  return Error{
      Error::Code::Incompatible,
      fmt::format("{}: this MCAP file holds no frames of toftwin; its topic \"{}\" has the "
                  "encoding \"{}\"",
                  file.path().string(), first.topic, first.message_encoding)};
}

}  // namespace

struct Reader::State {
  mcap::FileReader file;
  Summary summary;

  Result<Frame> decode(const mcap::Message& message) const {
    // Its own memory, so that a frame neither moves nor holds the whole chunk.
    wire::AlignedBytes bytes = wire::allocateAligned(message.data.size());
    std::ranges::copy(message.data, bytes.span().begin());
    auto decoded = wire::decode(bytes.buffer());
    auto* frame = decoded ? std::get_if<wire::FrameMessage>(&*decoded) : nullptr;
    if (frame != nullptr) return std::move(frame->frame);
    return Error{
        Error::Code::Malformed,
        fmt::format("{}: the message with sequence {} and log time {} ns is not a frame{}{}",
                    file.path().string(), message.sequence, message.log_time_ns,
                    decoded ? "" : ": ", decoded ? "" : decoded.error().message)};
  }
};

Reader::Reader(std::unique_ptr<State> state) : state_(std::move(state)) {}
Reader::Reader(Reader&&) noexcept = default;
Reader& Reader::operator=(Reader&&) noexcept = default;
Reader::~Reader() = default;

Result<Reader> Reader::open(const std::filesystem::path& file) {
  auto opened = mcap::FileReader::open(file);
  if (!opened) return opened.error();
  if (auto checked = checkHoldsFrames(*opened); !checked) return checked.error();
  Summary summary = summarise(*opened);
  return Reader{std::make_unique<State>(State{std::move(opened).value(), std::move(summary)})};
}

const Summary& Reader::summary() const { return state_->summary; }

Result<Frame> Reader::next(std::string_view source) {
  while (true) {
    const auto message = state_->file.next();
    if (!message) return message.error();
    const mcap::Channel& channel = state_->file.channels().at(message->channel_id);
    if (!holdsFrames(channel) || (!source.empty() && channel.topic != source)) continue;
    return state_->decode(*message);
  }
}

Whole Reader::checkWhole() const {
  const auto errors = state_->file.checkChunks();
  return {.chunks = state_->file.chunks(),
          .damaged = errors.size(),
          .first_damage = errors.empty() ? "" : errors.front().message};
}

void Reader::rewind() { state_->file.rewind(); }

Result<> Reader::seek(std::int64_t log_time_ns) {
  state_->file.seek(log_time_ns > 0 ? static_cast<std::uint64_t>(log_time_ns) : 0);
  return {};
}

}  // namespace toftwin::record
