// SPDX-License-Identifier: Apache-2.0
#include <cstring>
#include <new>
#include <string>
#include <utility>

#include "protocol/wire/crc32c.h"
#include "protocol/wire/header_checks.h"

namespace toftwin::wire {
namespace {

Error malformedHeader(std::string what) {
  return {Error::Code::Malformed, "malformed message: " + std::move(what)};
}

/// A code from a newer minor version means what the reader knows of it: something went wrong.
Error readError(Checks& checks, const fb::Error* table) {
  if (!table) return {};
  const bool known = table->code() <= static_cast<std::uint8_t>(Error::Code::Incompatible);
  return {known ? static_cast<Error::Code>(table->code()) : Error::Code::Internal,
          checks.text(table->message(), kMaxText, "error.message")};
}

SourceSummary readSummary(Checks& checks, const fb::SourceSummary* table) {
  if (!table) return {};
  return {.name = checks.name(table->name(), "source.name"),
          .model = checks.name(table->model(), "source.model"),
          .serial = checks.name(table->serial(), "source.serial"),
          .kind = checks.oneOf(table->kind(), FrameKind::Faulted, "source.kind"),
          .streaming = table->streaming(),
          .problem = checks.text(table->problem(), kMaxText, "source.problem")};
}

std::vector<PlaneKind> readKinds(Checks& checks, const flatbuffers::Vector<std::uint8_t>* bytes) {
  std::vector<PlaneKind> kinds;
  if (!bytes) return kinds;
  checks.require(bytes->size() <= kMaxPlanes, "planes", "has more than 64 items");
  if (checks.failed()) return kinds;
  for (const std::uint8_t byte : *bytes) {
    kinds.push_back(checks.oneOf(byte, kLastPlaneKind, "planes"));
  }
  return kinds;
}

std::vector<Parameter> readParameters(
    Checks& checks, const flatbuffers::Vector<flatbuffers::Offset<fb::Parameter>>* tables) {
  std::vector<Parameter> parameters;
  for (const auto* table : checks.items(tables, kMaxNames, "parameters")) {
    Parameter& parameter = parameters.emplace_back();
    parameter.name = checks.name(table->name(), "parameter.name");
    if (const auto value = table->value())
      parameter.value = checks.finite(*value, "parameter.value");
    if (const auto lowest = table->lowest())
      parameter.bounds.min = checks.finite(*lowest, "parameter.lowest");
    if (const auto highest = table->highest())
      parameter.bounds.max = checks.finite(*highest, "parameter.highest");
    if (const auto* text = table->text()) parameter.text = checks.text(text, kMaxText, "parameter.text");
    parameter.choices = checks.names(table->choices(), "parameter.choices");
  }
  return parameters;
}

// One `read` for each message.

Hello read(Checks& checks, std::uint64_t id, const fb::Hello& t) {
  Hello hello{id, checks.name(t.software(), "software"), checks.names(t.features(), "features")};
  hello.token = checks.text(t.token(), kMaxText, "token");
  if (t.idle_s()) hello.idle = checks.finiteFromZero(*t.idle_s(), "idle_s") * second;
  return hello;
}
ListSources read(Checks&, std::uint64_t id, const fb::ListSources&) { return {id}; }
SourceList read(Checks& checks, std::uint64_t id, const fb::SourceList& t) {
  SourceList list{id, {}};
  for (const auto* source : checks.items(t.sources(), kMaxSources, "sources")) {
    list.sources.push_back(readSummary(checks, source));
  }
  return list;
}
DescribeSource read(Checks& checks, std::uint64_t id, const fb::DescribeSource& t) {
  return {id, checks.name(t.source(), "source")};
}
SourceDescription read(Checks& checks, std::uint64_t id, const fb::SourceDescription& t) {
  SourceDescription m{.id = id,
                      .summary = readSummary(checks, t.summary()),
                      .driver = checks.name(t.driver(), "driver"),
                      .camera = readCamera(checks, t.camera()),
                      .planes = readKinds(checks, t.planes()),
                      .frame_interval = {},
                      .can_set_pose = t.can_set_pose(),
                      .can_trigger = t.can_trigger(),
                      .can_lockstep = t.can_lockstep(),
                      .parameters = readParameters(checks, t.parameters()),
                      .world_from_camera = {}};
  if (const fb::Pose* pose = t.world_from_camera()) m.world_from_camera = readPose(checks, *pose);
  if (const auto interval_s = t.frame_interval_s()) {
    m.frame_interval = checks.finiteFromZero(*interval_s, "frame_interval_s") * second;
  }
  return m;
}
Subscribe read(Checks& checks, std::uint64_t id, const fb::Subscribe& t) {
  Subscribe m{.id = id,
              .source = checks.name(t.source(), "source"),
              .planes = readKinds(checks, t.planes()),
              .region = {},
              .decimation = t.decimation(),
              .max_rate_hz = checks.finiteFromZero(t.max_rate_hz(), "max_rate_hz"),
              .policy = checks.oneOf(t.policy(), Policy::Lockstep, "policy"),
              .queue = t.queue(),
              .window = t.window()};
  if (const fb::Region* r = t.region()) m.region = {r->x(), r->y(), r->width(), r->height()};
  return m;
}
Subscribed read(Checks&, std::uint64_t id, const fb::Subscribed& t) {
  return {id, t.subscription()};
}
Unsubscribe read(Checks&, std::uint64_t id, const fb::Unsubscribe& t) {
  return {id, t.subscription()};
}
Acknowledge read(Checks&, std::uint64_t, const fb::Acknowledge& t) {
  return {t.subscription(), t.sequence()};
}
SubscriptionEnded read(Checks& checks, std::uint64_t, const fb::SubscriptionEnded& t) {
  return {t.subscription(), readError(checks, t.reason())};
}
SetPose read(Checks& checks, std::uint64_t id, const fb::SetPose& t) {
  checks.require(t.world_from_camera() != nullptr, "world_from_camera", "is missing");
  if (checks.failed()) return {};
  return {id, checks.name(t.source(), "source"), readPose(checks, *t.world_from_camera())};
}
SetParameter read(Checks& checks, std::uint64_t id, const fb::SetParameter& t) {
  SetParameter m{id, checks.name(t.source(), "source"), checks.name(t.name(), "name"),
                 checks.finite(t.value(), "value")};
  if (const auto* text = t.text()) m.text = checks.text(text, kMaxText, "text");
  return m;
}
Trigger read(Checks& checks, std::uint64_t id, const fb::Trigger& t) {
  return {id, checks.name(t.source(), "source")};
}
Record read(Checks& checks, std::uint64_t id, const fb::Record& t) {
  return {id, checks.name(t.source(), "source"), checks.name(t.file(), "file")};
}
Done read(Checks& checks, std::uint64_t id, const fb::Done& t) {
  return {id, checks.text(t.detail(), kMaxText, "detail")};
}
AskHealth read(Checks&, std::uint64_t id, const fb::AskHealth&) { return {id}; }
/// A later minor version may have more.
FacadeState facadeStateOf(std::uint8_t state) {
  constexpr auto kLast = static_cast<std::uint8_t>(FacadeState::NotThere);
  return state <= kLast ? static_cast<FacadeState>(state) : FacadeState::Unknown;
}
Health read(Checks& checks, std::uint64_t id, const fb::Health& t) {
  Health m{id, checks.finiteFromZero(t.uptime_s(), "uptime_s") * second, t.sessions(), {}, {}};
  for (const auto* s : checks.items(t.sources(), kMaxSources, "sources")) {
    m.sources.push_back(
        {.name = checks.name(s->name(), "source.name"),
         .streaming = s->streaming(),
         .frames = s->frames(),
         .dropped_by_device = s->dropped_by_device(),
         .subscribers = s->subscribers(),
         .reconnects = s->reconnects(),
         .last_error = checks.text(s->last_error(), kMaxText, "source.last_error"),
         .lockstep_by = checks.text(s->lockstep_by(), kMaxText, "source.lockstep_by"),
         .recording_by = checks.text(s->recording_by(), kMaxText, "source.recording_by")});
  }
  for (const auto* f : checks.items(t.facades(), kMaxSources, "facades")) {
    m.facades.push_back({.kind = checks.name(f->kind(), "facade.kind"),
                         .source = checks.name(f->source(), "facade.source"),
                         .place = checks.text(f->place(), kMaxText, "facade.place"),
                         .state = facadeStateOf(f->state()),
                         .clients = f->clients() ? std::optional{*f->clients()} : std::nullopt,
                         .problem = checks.text(f->problem(), kMaxText, "facade.problem")});
  }
  return m;
}
Failure read(Checks& checks, std::uint64_t id, const fb::Failure& t) {
  return {id, readError(checks, t.error())};
}
KeepAlive read(Checks&, std::uint64_t, const fb::KeepAlive&) { return {}; }

template <class Table>
Message readAs(Checks& checks, const fb::Header& header) {
  return read(checks, header.id(), *static_cast<const Table*>(header.message()));
}

/// The readers in the order of the union, which is the order of the message ids from 1.
using ReadMessage = Message (*)(Checks&, const fb::Header&);
constexpr std::array<ReadMessage, std::variant_size_v<Message>> kReaders{
    readAs<fb::Hello>,          readAs<fb::ListSources>,       readAs<fb::SourceList>,
    readAs<fb::DescribeSource>, readAs<fb::SourceDescription>, readAs<fb::Subscribe>,
    readAs<fb::Subscribed>,     readAs<fb::Unsubscribe>,       nullptr,  // frames need the body
    readAs<fb::Acknowledge>,    readAs<fb::SubscriptionEnded>, readAs<fb::SetPose>,
    readAs<fb::SetParameter>,   readAs<fb::Trigger>,           readAs<fb::Record>,
    readAs<fb::Done>,           readAs<fb::AskHealth>,         readAs<fb::Health>,
    readAs<fb::Failure>,        readAs<fb::KeepAlive>};
static_assert(static_cast<std::size_t>(fb::Body::MAX) == kReaders.size());

/// FlatBuffers reads numbers where they lie, so the header must start at a multiple of eight.
class AlignedHeader {
 public:
  explicit AlignedHeader(std::span<const std::byte> header) : bytes_(header) {
    if (reinterpret_cast<std::uintptr_t>(header.data()) % alignof(std::uint64_t) == 0) return;
    copy_.resize(header.size() / sizeof(std::uint64_t) + 1);
    std::memcpy(copy_.data(), header.data(), header.size());
    bytes_ = std::as_bytes(std::span{copy_}).first(header.size());
  }
  /// The root of a header whose every offset lies inside, or null.
  [[nodiscard]] const fb::Header* verified() const {
    const auto* data = reinterpret_cast<const std::uint8_t*>(bytes_.data());
    if (bytes_.size() < 8 || bytes_.size() >= FLATBUFFERS_MAX_BUFFER_SIZE) return nullptr;
    flatbuffers::Verifier verifier{data, bytes_.size(), kMaxTableDepth, kMaxTables};
    return fb::VerifyHeaderBuffer(verifier) ? fb::GetHeader(data) : nullptr;
  }

 private:
  std::span<const std::byte> bytes_;
  std::vector<std::uint64_t> copy_;
};

/// `body` itself, or a copy at a multiple of 64 where it is not.
Buffer aligned(Buffer body) {
  if (reinterpret_cast<std::uintptr_t>(body.bytes().data()) % kAlignment == 0) return body;
  const AlignedBytes copy = allocateAligned(body.size());
  std::memcpy(copy.bytes.get(), body.bytes().data(), body.size());
  return copy.buffer();
}

/// What the header says, with a frame's planes without their data.
Result<Message> readHeader(Checks& checks, const fb::Header& header, std::uint64_t body_bytes) {
  const auto message_id = static_cast<std::size_t>(header.message_type());
  if (message_id == 0 || header.message() == nullptr) return malformedHeader("it holds no message");
  if (message_id > kReaders.size()) {
    return Error{Error::Code::Unsupported,
                 "message id " + std::to_string(message_id) + " is not known to this side"};
  }
  const bool is_frame = header.message_type() == fb::Body::Frame;
  if (!is_frame && body_bytes != 0) return malformedHeader("a body follows a message that has none");
  Message message = is_frame ? readFrame(checks, *header.message_as_Frame(), body_bytes)
                             : kReaders[message_id - 1](checks, header);
  if (checks.failed()) return checks.error();
  return message;
}

Result<Message> readMessage(const fb::Header& header, Buffer body) {
  Checks checks;
  auto message = readHeader(checks, header, body.size());
  if (!message) return message;
  if (auto* frame = std::get_if<FrameMessage>(&*message)) {
    attachPlanes(*frame, *header.message_as_Frame(), aligned(std::move(body)));
  }
  return message;
}

}  // namespace

Result<Message> decode(const Preamble& preamble, std::span<const std::byte> header, Buffer body) {
  const bool is_inline = preamble.body_place == BodyPlace::Inline;
  const std::uint32_t sum = is_inline ? crc32c(body.bytes()) : preamble.body_crc32c;
  return decode(preamble, header, std::move(body), sum);
}

Result<Message> decode(const Preamble& preamble, std::span<const std::byte> header, Buffer body,
                       std::uint32_t body_crc32c) {
  if (header.size() != preamble.header_bytes || body.size() != preamble.body_bytes) {
    return malformedHeader("header or body do not have the announced length");
  }
  if (crc32c(header) != preamble.header_crc32c) return malformedHeader("the header's checksum is wrong");
  if (body_crc32c != preamble.body_crc32c) return malformedHeader("the body's checksum is wrong");
  const AlignedHeader aligned_header{header};
  const fb::Header* root = aligned_header.verified();
  if (!root) return malformedHeader("the header is not what the schema says");
  auto message = readMessage(*root, std::move(body));
  if (!message) return message;
  if (auto* hello = std::get_if<Hello>(&*message)) hello->minor = preamble.minor;
  return message;
}

Result<Message> decode(Buffer bytes, const Limits& limits) {
  if (bytes.size() < kPreambleSize) return malformedHeader("it ends within the preamble");
  const auto preamble = decodePreamble(bytes.bytes().first<kPreambleSize>(), limits);
  if (!preamble) return preamble.error();
  if (preamble->body_place != BodyPlace::Inline) return malformedHeader("its body is elsewhere");
  const std::uint64_t expected = kPreambleSize + preamble->header_bytes + preamble->body_bytes;
  if (bytes.size() != expected) {
    return malformedHeader("it has " + std::to_string(bytes.size()) + " bytes, not the announced " +
                           std::to_string(expected));
  }
  return decode(*preamble, bytes.bytes().subspan(kPreambleSize, preamble->header_bytes),
                bytes.part(kPreambleSize + preamble->header_bytes, preamble->body_bytes));
}

std::string faultIn(std::span<const std::byte> header, std::uint64_t body_bytes) {
  const AlignedHeader aligned_header{header};
  const fb::Header* root = aligned_header.verified();
  if (!root) return "the header is not what the schema says";
  Checks checks;
  const auto message = readHeader(checks, *root, body_bytes);
  if (message) return {};
  return checks.failed() ? checks.fault() : message.error().message;
}

std::uint64_t requestIdOf(std::span<const std::byte> header) {
  const AlignedHeader aligned_header{header};
  const fb::Header* root = aligned_header.verified();
  return root ? root->id() : 0;
}

AlignedBytes allocateAligned(std::size_t size) {
  auto* memory = static_cast<std::byte*>(::operator new[](size, std::align_val_t{kAlignment}));
  return {std::shared_ptr<std::byte[]>{
              memory, [](std::byte* p) { ::operator delete[](p, std::align_val_t{kAlignment}); }},
          size};
}

}  // namespace toftwin::wire
