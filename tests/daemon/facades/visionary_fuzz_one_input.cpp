// SPDX-License-Identifier: Apache-2.0
// What a Visionary facade and its driver are sent: telegrams one after another to one session, blobs,
// descriptions.
#include <cmath>
#include <cstdlib>
#include <string_view>
#include <variant>

#include "daemon/facades/visionary/session.h"
#include "drivers/visionary/wire/blob.h"
#include "drivers/visionary/wire/timestamp.h"
#include "fuzz_one_input.h"
#include "visionary_testing.h"

namespace toftwin::daemon {
namespace {

using namespace toftwin::visionary;

void demand(bool holds) {
  if (!holds) std::abort();
}

void play(const Telegram& telegram, visionary::Device& device, visionary::Session& session,
          visionary::SteadyTime now) {
  const auto wanted = session.take(telegram, now);
  const auto* command = std::get_if<ColaCommand>(&wanted);
  if (command == nullptr) return demand(!std::get<Telegram>(wanted).command.empty());
  demand(session.isOpen());
  const auto outcome = device.answer(*command, session.client());
  demand(readAnswer(outcome.answer, *command).ok());
  for (const auto& [name, value] : outcome.changes) {
    demand(name == "exposure_us" || name == "frame_rate_hz");
    demand(std::isfinite(value) && value > 0.0);
  }
  demand(!outcome.frames || *outcome.frames >= -1);
  demand(session.client().level == UserLevel::Run);  // no chance input knows the answer to a challenge
}

void playStream(std::span<const std::byte> bytes) {
  static const visionary::Device kFresh = test::visionaryDevice();
  visionary::Device device = kFresh;
  visionary::Session session{1};
  visionary::SteadyTime now{};
  TelegramReader reader{1 << 16};
  reader.feed(bytes);
  for (int i = 0; i < 64; ++i) {
    const auto telegram = reader.next();
    if (!telegram || !*telegram) return;
    play(**telegram, device, session, now += std::chrono::seconds{1});
  }
}

/// Lines that are commands, in a session that is open.
void playLines(std::string_view text) {
  visionary::Device device = test::visionaryDevice();
  visionary::Session session{1};
  Writer open;
  constexpr std::string_view kOpen = "Ox";
  open.raw(std::as_bytes(std::span{kOpen})).number(std::uint8_t{200}).text("");
  static_cast<void>(session.take({0, 0, open.bytes()}, {}));
  for (int i = 0; i < 64 && !text.empty(); ++i) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const auto line = std::as_bytes(std::span{text.substr(0, end)});
    play({1, 1, {line.begin(), line.end()}}, device, session, {});
    text.remove_prefix(std::min(text.size(), end + 1));
  }
}

}  // namespace

void fuzzOneInput(std::span<const std::byte> bytes) {
  playStream(bytes);
  playLines(textOf(bytes));
  if (const auto description = readDescription(textOf(bytes))) {
    demand(description->width > 0 && description->height > 0);
    demand(readDescription(toXml(*description)).ok());
  }
  BlobReader reader{1 << 16};
  reader.feed(bytes);
  static_cast<void>(reader.next());
  Description small;
  small.width = 3;
  small.height = 2;
  if (const auto blob = readBlob(bytes)) {
    if (const auto images = readImages(blob->data, small)) demand(images->distance.size() == 6);
  }
  static_cast<void>(readImages(bytes, small));
  if (bytes.size() >= 8) static_cast<void>(unixTime_ms(*Reader{bytes}.number<std::uint64_t>()));
}

}  // namespace toftwin::daemon
