// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstring>
#include <limits>
#include <string>
#include <utility>

#include "protocol/wire/codec.h"
#include "protocol/wire/crc32c.h"
#include "protocol/wire/message_id.h"
#include "protocol/wire/header_checks.h"
#include "protocol/wire/header_writer.h"

namespace toftwin::wire {
namespace {

alignas(kAlignment) constexpr std::array<std::byte, kAlignment> kZeros{};

Offset<fb::Error> writeError(Builder& builder, const Error& error) {
  const auto message = writeText(builder, error.message);
  return fb::CreateError(builder, static_cast<std::uint8_t>(error.code), message);
}

Offset<fb::SourceSummary> writeSummary(Builder& builder, const SourceSummary& summary) {
  const auto name = writeName(builder, summary.name);
  const auto model = writeName(builder, summary.model);
  const auto serial = writeName(builder, summary.serial);
  const auto problem = writeText(builder, summary.problem);
  return fb::CreateSourceSummary(builder, name, model, serial,
                                 static_cast<std::uint8_t>(summary.kind), summary.streaming,
                                 problem);
}

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// An end of the bounds, absent where it is `none`.
flatbuffers::Optional<double> endOf(double bound, double none) {
  if (bound == none) return flatbuffers::nullopt;
  return bound;
}

Offset<flatbuffers::Vector<Offset<fb::Parameter>>> writeParameters(
    Builder& builder, const std::vector<Parameter>& parameters) {
  if (parameters.empty()) return {};
  std::vector<Offset<fb::Parameter>> tables;
  for (std::size_t i = 0; i < countOf(parameters, kMaxNames); ++i) {
    const Parameter& parameter = parameters[i];
    const auto name = writeName(builder, parameter.name);
    flatbuffers::Optional<double> value = flatbuffers::nullopt;
    if (parameter.value) value = *parameter.value;
    const auto text = parameter.text ? builder.CreateString(*parameter.text) : Offset<flatbuffers::String>{};
    const auto choices = parameter.choices.empty() ? Offset<Texts>{} : writeNames(builder, parameter.choices);
    tables.push_back(fb::CreateParameter(builder, name, value, endOf(parameter.bounds.min, -kInfinity),
                                         endOf(parameter.bounds.max, kInfinity), text, choices));
  }
  return builder.CreateVector(tables);
}

Offset<flatbuffers::Vector<std::uint8_t>> writeKinds(Builder& builder,
                                                     const std::vector<PlaneKind>& kinds) {
  std::vector<std::uint8_t> bytes;
  for (std::size_t i = 0; i < countOf(kinds, kMaxPlanes); ++i) {
    bytes.push_back(static_cast<std::uint8_t>(kinds[i]));
  }
  return builder.CreateVector(bytes);
}

/// What older versions lack is absent where it is empty, so that the bytes stay what they were.
Offset<flatbuffers::String> writeIfAny(Builder& builder, const std::string& text) {
  return text.empty() ? Offset<flatbuffers::String>{} : writeText(builder, text);
}

// One `write` for each message; the table's name in the schema is the message's.

auto write(Builder& b, const Hello& m) {
  const auto software = writeName(b, m.software);
  const auto features = writeNames(b, m.features);
  flatbuffers::Optional<double> idle_s = flatbuffers::nullopt;
  if (m.idle) idle_s = m.idle->in(second);
  return fb::CreateHello(b, software, features, writeIfAny(b, m.token), idle_s);
}
auto write(Builder& b, const ListSources&) { return fb::CreateListSources(b); }
auto write(Builder& b, const SourceList& m) {
  std::vector<Offset<fb::SourceSummary>> sources;
  for (std::size_t i = 0; i < countOf(m.sources, kMaxSources); ++i) {
    sources.push_back(writeSummary(b, m.sources[i]));
  }
  return fb::CreateSourceList(b, b.CreateVector(sources));
}
auto write(Builder& b, const DescribeSource& m) {
  return fb::CreateDescribeSource(b, writeName(b, m.source));
}
auto write(Builder& b, const SourceDescription& m) {
  const auto summary = writeSummary(b, m.summary);
  const auto driver = writeName(b, m.driver);
  const auto camera = writeCamera(b, m.camera);
  const auto planes = writeKinds(b, m.planes);
  const auto parameters = writeParameters(b, m.parameters);
  fb::SourceDescriptionBuilder table{b};
  table.add_summary(summary);
  table.add_driver(driver);
  table.add_camera(camera);
  table.add_planes(planes);
  if (m.frame_interval) table.add_frame_interval_s(m.frame_interval->in(second));
  table.add_can_set_pose(m.can_set_pose);
  table.add_can_trigger(m.can_trigger);
  table.add_can_lockstep(m.can_lockstep);
  table.add_parameters(parameters);
  fb::Pose pose;
  if (m.world_from_camera) {
    pose = toPose(*m.world_from_camera);
    table.add_world_from_camera(&pose);
  }
  return table.Finish();
}
auto write(Builder& b, const Subscribe& m) {
  const auto source = writeName(b, m.source);
  const auto planes = writeKinds(b, m.planes);
  const fb::Region region{m.region.x, m.region.y, m.region.width, m.region.height};
  return fb::CreateSubscribe(b, source, planes, &region, m.decimation, m.max_rate_hz,
                             static_cast<std::uint8_t>(m.policy), m.queue, m.window);
}
auto write(Builder& b, const Subscribed& m) { return fb::CreateSubscribed(b, m.subscription); }
auto write(Builder& b, const Unsubscribe& m) { return fb::CreateUnsubscribe(b, m.subscription); }
auto write(Builder& b, const FrameMessage& m) { return writeFrame(b, m); }
auto write(Builder& b, const Acknowledge& m) {
  return fb::CreateAcknowledge(b, m.subscription, m.sequence);
}
auto write(Builder& b, const SubscriptionEnded& m) {
  return fb::CreateSubscriptionEnded(b, m.subscription, writeError(b, m.reason));
}
auto write(Builder& b, const SetPose& m) {
  const auto source = writeName(b, m.source);
  const fb::Pose pose = toPose(m.world_from_camera);
  return fb::CreateSetPose(b, source, &pose);
}
auto write(Builder& b, const SetParameter& m) {
  const auto source = writeName(b, m.source);
  const auto name = writeName(b, m.name);
  const auto text = m.text ? b.CreateString(*m.text) : Offset<flatbuffers::String>{};
  return fb::CreateSetParameter(b, source, name, m.value, text);
}
auto write(Builder& b, const Trigger& m) {
  return fb::CreateTrigger(b, writeName(b, m.source));
}
auto write(Builder& b, const Record& m) {
  const auto source = writeName(b, m.source);
  return fb::CreateRecord(b, source, writeName(b, m.file));
}
auto write(Builder& b, const Done& m) {
  return fb::CreateDone(b, writeText(b, m.detail));
}
auto write(Builder& b, const AskHealth&) { return fb::CreateAskHealth(b); }
auto write(Builder& b, const Health& m) {
  std::vector<Offset<fb::SourceHealth>> sources;
  for (std::size_t i = 0; i < countOf(m.sources, kMaxSources); ++i) {
    const SourceHealth& s = m.sources[i];
    const auto name = writeName(b, s.name);
    const auto last_error = writeText(b, s.last_error);
    const auto lockstep_by = writeIfAny(b, s.lockstep_by);
    const auto recording_by = writeIfAny(b, s.recording_by);
    sources.push_back(fb::CreateSourceHealth(b, name, s.streaming, s.frames, s.dropped_by_device, s.subscribers,
                                             s.reconnects, last_error, lockstep_by, recording_by));
  }
  std::vector<Offset<fb::FacadeHealth>> facades;
  for (std::size_t i = 0; i < countOf(m.facades, kMaxSources); ++i) {
    const FacadeHealth& f = m.facades[i];
    const auto kind = writeName(b, f.kind);
    const auto source = writeName(b, f.source);
    const auto place = writeText(b, f.place);
    const auto problem = writeText(b, f.problem);
    const auto clients = f.clients ? flatbuffers::Optional<std::uint32_t>{*f.clients} : flatbuffers::nullopt;
    facades.push_back(
        fb::CreateFacadeHealth(b, kind, source, place, static_cast<std::uint8_t>(f.state), clients, problem));
  }
  return fb::CreateHealth(b, m.uptime.in(second), m.sessions, b.CreateVector(sources),
                          b.CreateVector(facades));
}
auto write(Builder& b, const Failure& m) { return fb::CreateFailure(b, writeError(b, m.error)); }
auto write(Builder& b, const KeepAlive&) { return fb::CreateKeepAlive(b); }

Error tooLargeToSend(const std::string& part, std::uint64_t bytes, std::uint64_t limit) {
  return {Error::Code::TooLarge, "this message cannot be sent: its " + part + " has " +
                                     std::to_string(bytes) + " bytes, the limit is " +
                                     std::to_string(limit)};
}

/// The preamble and the header of a message with the given id (position in the union).
template <class M>
Result<Encoded> encodeAs(std::uint8_t message_id, const M& message, Body body) {
  constexpr Limits kLimits;
  if (body.bytes > kLimits.body_bytes) return tooLargeToSend("body", body.bytes, kLimits.body_bytes);
  Builder builder{1024};
  const auto table = write(builder, message);
  FinishHeaderBuffer(builder, fb::CreateHeader(builder, idOf(message),
                                               static_cast<fb::Body>(message_id), table.Union()));
  const std::size_t header_bytes = paddedToAlignment(builder.GetSize());
  if (header_bytes > kLimits.header_bytes)
    return tooLargeToSend("header", header_bytes, kLimits.header_bytes);
  Encoded encoded{std::vector<std::byte>(kPreambleSize + header_bytes), std::move(body)};
  std::memcpy(encoded.head.data() + kPreambleSize, builder.GetBufferPointer(), builder.GetSize());
  const auto header = std::span{encoded.head}.subspan(kPreambleSize);
  if (const std::string fault = faultIn(header, encoded.body.bytes); !fault.empty()) {
    return Error{Error::Code::InvalidArgument, "this message cannot be sent: " + fault};
  }

  Preamble preamble;
  preamble.header_bytes = static_cast<std::uint32_t>(header_bytes);
  preamble.body_bytes = encoded.body.bytes;
  preamble.header_crc32c = crc32c(header);
  preamble.body_crc32c = encoded.body.crc32c;
  std::ranges::copy(encodePreamble(preamble), encoded.head.begin());
  return encoded;
}

/// The id of a message on the wire is its place in the variant, counted from 1.
template <class M, std::size_t I = 0>
constexpr std::uint8_t messageIdOf() {
  if constexpr (std::is_same_v<std::variant_alternative_t<I, Message>, M>)
    return I + 1;
  else
    return messageIdOf<M, I + 1>();
}

}  // namespace

Body layOutBody(const std::vector<Plane>& planes) {
  Body body;
  for (const Plane& plane : planes) {
    const std::uint64_t size = plane.data.size();
    const std::uint64_t padding = paddedToAlignment(size) - size;
    body.pieces.push_back(plane.data);
    if (padding > 0) body.pieces.push_back(Buffer{nullptr, std::span{kZeros}.first(padding)});
    body.bytes += size + padding;
  }
  return body;
}

std::uint32_t crc32cOf(const Body& body) {
  std::uint32_t sum = 0;
  for (const Buffer& piece : body.pieces) sum = crc32c(piece.bytes(), sum);
  return sum;
}

Body encodeBody(const std::vector<Plane>& planes) {
  Body body = layOutBody(planes);
  body.crc32c = crc32cOf(body);
  return body;
}

Result<Encoded> encode(const Message& message) {
  return std::visit(
      [](const auto& m) {
        using M = std::decay_t<decltype(m)>;
        Body body;
        if constexpr (std::is_same_v<M, FrameMessage>) body = encodeBody(m.frame.planes);
        return encodeAs(messageIdOf<M>(), m, std::move(body));
      },
      message);
}

Result<Encoded> encode(const FrameMessage& message, Body body) {
  return encodeAs(messageIdOf<FrameMessage>(), message, std::move(body));
}

std::vector<std::byte> toBytes(const Encoded& message) {
  std::vector<std::byte> bytes;
  bytes.reserve(message.size());
  bytes.insert(bytes.end(), message.head.begin(), message.head.end());
  for (const Buffer& piece : message.body.pieces) {
    bytes.insert(bytes.end(), piece.bytes().begin(), piece.bytes().end());
  }
  return bytes;
}

}  // namespace toftwin::wire
