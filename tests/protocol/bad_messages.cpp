// SPDX-License-Identifier: Apache-2.0
#include "bad_messages.h"

#include <toftwin_generated.h>

#include <algorithm>
#include <cstring>
#include <functional>
#include <limits>

#include <toftwin/nan.h>

#include "protocol/wire/bounds.h"
#include "protocol/wire/codec.h"
#include "protocol/wire/crc32c.h"

namespace toftwin::wire {
namespace {

using Bytes = std::vector<std::byte>;
using Builder = flatbuffers::FlatBufferBuilder;
using Union = flatbuffers::Offset<void>;

constexpr double kInfinite = std::numeric_limits<double>::infinity();

/// A message with lengths and checksums that fit.
Bytes sealed(
    Bytes header, const Bytes& body, std::function<void(Preamble&)> change = [](Preamble&) {}) {
  header.resize(paddedToAlignment(header.size()));
  Preamble preamble;
  preamble.header_bytes = static_cast<std::uint32_t>(header.size());
  preamble.body_bytes = body.size();
  preamble.header_crc32c = crc32c(header);
  preamble.body_crc32c = crc32c(body);
  change(preamble);
  Bytes bytes(kPreambleSize + header.size() + body.size());
  auto at = std::ranges::copy(encodePreamble(preamble), bytes.begin()).out;
  at = std::ranges::copy(header, at).out;
  std::ranges::copy(body, at);
  return bytes;
}

Bytes headerOf(fb::Body type, const std::function<Union(Builder&)>& write,
               const char* identifier = fb::HeaderIdentifier()) {
  Builder builder;
  const Union message = write(builder);
  builder.Finish(fb::CreateHeader(builder, 5, type, message), identifier);
  const auto* data = reinterpret_cast<const std::byte*>(builder.GetBufferPointer());
  return {data, data + builder.GetSize()};
}

Bytes messageOf(fb::Body type, const std::function<Union(Builder&)>& write,
                const Bytes& body = {}) {
  return sealed(headerOf(type, write), body);
}

Bytes trigger(std::function<void(Preamble&)> change = [](Preamble&) {}) {
  const auto write = [](Builder& b) { return fb::CreateTriggerDirect(b, "o3d").Union(); };
  return sealed(headerOf(fb::Body::Trigger, write), {}, std::move(change));
}

/// `good` with one of its bytes changed and the preamble's checksum mended.
Bytes withByte(Bytes good, std::size_t at, unsigned value) {
  good[at] = static_cast<std::byte>(value);
  const std::uint32_t sum = crc32c(std::span{good}.first(60));
  std::memcpy(good.data() + 60, &sum, 4);
  return good;
}

struct PlaneFields {
  std::uint8_t kind = 0, type = 0;
  std::uint32_t width = 8, height = 8, channels = 1;
  std::uint64_t offset = 0, bytes = 64;
};

Bytes frameWith(const std::vector<PlaneFields>& planes, std::size_t body_bytes) {
  const auto write = [&](Builder& b) {
    std::vector<flatbuffers::Offset<fb::Plane>> tables;
    for (const PlaneFields& p : planes) {
      tables.push_back(
          fb::CreatePlane(b, p.kind, p.type, p.width, p.height, p.channels, p.offset, p.bytes));
    }
    return fb::CreateFrameDirect(b, 7, "k", 1, 0, 0, 0, 0, 0, &tables).Union();
  };
  return messageOf(fb::Body::Frame, write, Bytes(body_bytes));
}

void addPreambles(std::vector<BadMessage>& all) {
  const auto malformed = Error::Code::Malformed;
  const Bytes good = trigger();
  all.push_back({"empty", {}, malformed, "ends within the preamble"});
  all.push_back({"short-preamble", {good.begin(), good.begin() + 63}, malformed, "ends within"});
  all.push_back({"magic", withByte(good, 6, 'M'), malformed, "the magic is missing"});
  all.push_back({"major-version", withByte(good, 8, 9), Error::Code::Incompatible,
                 "version 9." + std::to_string(kVersionMinor)});
  Bytes sum = good;
  sum[61] ^= std::byte{1};
  all.push_back({"preamble-checksum", sum, malformed, "preamble's checksum"});
  all.push_back({"body-place", withByte(good, 32, 2), malformed, "the body's place is 2"});
  all.push_back({"body-elsewhere", withByte(good, 32, 1), malformed, "its body is elsewhere"});
  all.push_back({"reserved", withByte(good, 59, 1), malformed, "reserved byte"});
  all.push_back(
      {"no-header", trigger([](Preamble& p) { p.header_bytes = 0; }), malformed, "a header of 0"});
  all.push_back({"header-length", trigger([](Preamble& p) { p.header_bytes -= 1; }), malformed,
                 "not a multiple of 64"});
  all.push_back({"body-length", trigger([](Preamble& p) { p.body_bytes = 63; }), malformed,
                 "not a multiple of 64"});
  all.push_back({"header-too-large", trigger([](Preamble& p) { p.header_bytes = 0xFFFFFFC0u; }),
                 Error::Code::TooLarge, "a header of 4294967232 bytes"});
  all.push_back({"body-too-large", trigger([](Preamble& p) { p.body_bytes = 1ull << 63; }),
                 Error::Code::TooLarge, "a body of 9223372036854775808 bytes"});
  all.push_back({"truncated", {good.begin(), good.end() - 1}, malformed, "not the announced"});
  Bytes longer = good;
  longer.resize(good.size() + 64);
  all.push_back({"trailing", longer, malformed, "not the announced"});
  all.push_back({"header-checksum", trigger([](Preamble& p) { p.header_crc32c ^= 1; }), malformed,
                 "header's checksum"});
  all.push_back({"body-checksum", trigger([](Preamble& p) { p.body_crc32c ^= 1; }), malformed,
                 "body's checksum"});
}

void addHeaders(std::vector<BadMessage>& all) {
  const auto add = [&](const char* name, Bytes bytes, const char* why,
                       Error::Code code = Error::Code::Malformed) {
    all.push_back({name, std::move(bytes), code, why});
  };
  add("not-a-flatbuffer", sealed(Bytes(64, std::byte{0xA5}), {}), "not what the schema says");
  const auto list = [](Builder& b) { return fb::CreateListSources(b).Union(); };
  add("identifier", sealed(headerOf(fb::Body::ListSources, list, "ELSE"), {}),
      "not what the schema says");
  add("no-message", messageOf(fb::Body::NONE, [](Builder&) { return Union{}; }),
      "holds no message");
  add("null-message", messageOf(fb::Body::Hello, [](Builder&) { return Union{}; }),
      "holds no message");
  add("unknown-message", messageOf(static_cast<fb::Body>(200), list), "message id 200",
      Error::Code::Unsupported);
  add("body-after-request", messageOf(fb::Body::ListSources, list, Bytes(64)), "that has none");
  add(
      "text-that-leaves-the-header",
      [&] {
        // The only text's length, made larger than the header: a verifier must see it.
        Bytes header = headerOf(fb::Body::Trigger, [](Builder& b) {
          return fb::CreateTriggerDirect(b, "o3d").Union();
        });
        const auto name =
            std::search(header.begin(), header.end(), reinterpret_cast<const std::byte*>("o3d"),
                        reinterpret_cast<const std::byte*>("o3d") + 3);
        *(name - 3) = std::byte{0x7F};
        return sealed(header, {});
      }(),
      "not what the schema says");
  add("long-name",
      messageOf(fb::Body::Trigger,
                [](Builder& b) {
                  return fb::CreateTriggerDirect(b, std::string(256, 'k').c_str()).Union();
                }),
      "longer than 255 bytes");
  add("long-reason",
      messageOf(fb::Body::Frame,
                [](Builder& b) {
                  const std::string reason(4097, 'x');
                  return fb::CreateFrameDirect(b, 7, "k", 1, 0, 1, 0, 0, 0, nullptr, reason.c_str()).Union();
                }),
      "frame.dropped_because is longer than 4096 bytes");
  add("many-names",
      messageOf(fb::Body::Hello,
                [](Builder& b) {
                  const std::vector<flatbuffers::Offset<flatbuffers::String>> names(
                      1025, b.CreateString("f"));
                  return fb::CreateHelloDirect(b, "s", &names).Union();
                }),
      "more than 1024 items");
  add("parameter-nan",
      messageOf(fb::Body::SetParameter,
                [](Builder& b) { return fb::CreateSetParameterDirect(b, "k", "p", kNaN).Union(); }),
      "not a finite number");
  add("parameter-text-long",
      messageOf(fb::Body::SetParameter,
                [](Builder& b) {
                  const std::string text(4097, 'x');
                  return fb::CreateSetParameterDirect(b, "k", "p", 0.0, text.c_str()).Union();
                }),
      "text is longer than 4096 bytes");
  add("no-pose",
      messageOf(fb::Body::SetPose,
                [](Builder& b) { return fb::CreateSetPoseDirect(b, "k").Union(); }),
      "world_from_camera is missing");
  add("pose-infinite",
      messageOf(fb::Body::SetPose,
                [](Builder& b) {
                  const fb::Pose pose{1, 0, 0, 0, kInfinite, 0, 0};
                  return fb::CreateSetPoseDirect(b, "k", &pose).Union();
                }),
      "pose.x_m is not a finite number");
  add("rate-negative",
      messageOf(fb::Body::Subscribe,
                [](Builder& b) {
                  return fb::CreateSubscribeDirect(b, "k", nullptr, nullptr, 1, -1.0).Union();
                }),
      "max_rate_hz");
  add("policy",
      messageOf(fb::Body::Subscribe,
                [](Builder& b) {
                  return fb::CreateSubscribeDirect(b, "k", nullptr, nullptr, 1, 0.0, 4).Union();
                }),
      "policy has a value that is not known");
  add("kind-in-list",
      messageOf(fb::Body::Subscribe,
                [](Builder& b) {
                  const std::vector<std::uint8_t> kinds{0, 200};
                  return fb::CreateSubscribeDirect(b, "k", &kinds).Union();
                }),
      "planes has a value that is not known");
  add("clock-uncertainty",
      messageOf(fb::Body::Frame,
                [](Builder& b) {
                  const auto moment = fb::CreateMomentDirect(b, nullptr, 0, 0, -2);
                  return fb::CreateFrameDirect(b, 7, "k", 1, 0, 0, moment).Union();
                }),
      "is below -1");
  add("camera-width",
      messageOf(fb::Body::Frame,
                [](Builder& b) {
                  const auto camera = fb::CreateCamera(b, 0x80000000u, 1);
                  return fb::CreateFrameDirect(b, 7, "k", 1, 0, 0, 0, 0, camera).Union();
                }),
      "camera.width is more than 65535");
}

void addPlanes(std::vector<BadMessage>& all) {
  const auto add = [&](const char* name, const std::vector<PlaneFields>& planes, std::size_t body,
                       const char* why) {
    all.push_back({name, frameWith(planes, body), Error::Code::Malformed, why});
  };
  constexpr std::uint64_t huge = 0xFFFFFFFFFFFFFFC0u;  // plus 64 is 0 in 64 bits
  add("plane-kind", {{.kind = 200}}, 64, "plane.kind");
  add("plane-type", {{.type = 3}}, 64, "plane.type");
  add("plane-width-0", {{.width = 0, .bytes = 0}}, 0, "plane.width");
  add("plane-height-large", {{.height = 65536, .bytes = 8 * 65536}}, 64, "plane.height");
  add("plane-channels-0", {{.channels = 0, .bytes = 0}}, 0, "plane.channels");
  add("plane-channels-many", {{.channels = 1025}}, 64, "plane.channels");
  add("plane-bytes", {{.bytes = 63}}, 64, "plane.bytes is not type");
  add("plane-bytes-wrapped",  // 4 · 65535 · 65535 · 1024 in 32 bits is small; in 64 it is not
      {{.type = 2,
        .width = 65535,
        .height = 65535,
        .channels = 1024,
        .bytes = static_cast<std::uint32_t>(4ull * 65535 * 65535 * 1024)}},
      64, "plane.bytes is not type");
  add("plane-larger-than-body", {{.width = 16, .bytes = 128}}, 64, "beyond the body's end");
  add("plane-offset-unaligned", {{.offset = 32}}, 128, "not a multiple of 64");
  add("plane-beyond-body", {{.offset = 64}}, 64, "beyond the body's end");
  add("plane-offset-wraps", {{.offset = huge}}, 64, "beyond the body's end");
  add("planes-overlap", {{}, {.offset = 0}}, 128, "before the end of the plane before");
  add("body-behind-planes", {{}}, 128, "goes on behind the last plane");
  add("planes-many", std::vector<PlaneFields>(65), 64, "more than 64 items");
}

}  // namespace

std::vector<BadMessage> badMessages() {
  std::vector<BadMessage> all;
  addPreambles(all);
  addHeaders(all);
  addPlanes(all);
  for (BadMessage& bad : all) bad.name = "bad-" + bad.name;
  return all;
}

}  // namespace toftwin::wire
