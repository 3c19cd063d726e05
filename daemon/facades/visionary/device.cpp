// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/visionary/device.h"

#include <openssl/crypto.h>
#include <openssl/rand.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace toftwin::daemon::visionary {
namespace {

using toftwin::visionary::answerTo;
using toftwin::visionary::errorAnswer;
using toftwin::visionary::Reader;
using toftwin::visionary::Writer;
using Kind = ColaCommand::Kind;

/// Of methods that answer whether it went well, in the maker's numbers.
constexpr std::uint8_t kSuccess = 0, kNotAccepted = 2;
constexpr int kEndless = -1;
constexpr std::uint8_t kMostFunction = 40;  ///< of a digital input and output

Device::Outcome refused(ColaError error) { return {.answer = errorAnswer(error)}; }
Device::Outcome done(const ColaCommand& command, std::span<const std::byte> told = {}) {
  return {.answer = answerTo(command, told)};
}

/// Entries of a log, all free: number and state, first and last time (power-ons, seconds of operation, time),
/// how often, reserved, text.
Bytes emptyLog(int entries) {
  Writer writer;
  for (int i = 0; i < entries; ++i) {
    writer.number(std::uint32_t{0}).number(std::uint32_t{0});
    for (int time = 0; time < 2; ++time)
      writer.number(std::uint16_t{0}).number(std::uint32_t{0}).number(std::uint32_t{0});
    writer.number(std::uint16_t{0}).number(std::uint16_t{0}).text("");
  }
  return writer.bytes();
}

std::vector<std::uint8_t> randomBytes(std::size_t size) {
  std::vector<std::uint8_t> bytes(size);
  if (RAND_bytes(bytes.data(), static_cast<int>(size)) != 1) bytes.clear();  // then nobody logs in
  return bytes;
}

/// A variable of 32 bits without sign that is a parameter of the source, and how many of it one of the other
/// is.
struct SourceVariable {
  std::string_view name, parameter;
};
constexpr SourceVariable kIntegrationTime{"integrationTimeUs", "exposure_us"};
constexpr std::string_view kFramePeriod = "framePeriodUs", kFrameRate = "frame_rate_hz";
constexpr std::string_view kTemperatureMargin = "SysTemperatureWarningMargin";
constexpr double kPerSecond_us = 1e6;

}  // namespace

Device::Outcome Device::answer(const ColaCommand& command, Client& client) {
  switch (command.kind) {
    case Kind::Read:
      return read(command);
    case Kind::Write:
      return write(command, client);
    case Kind::Call:
      return call(command, client);
    case Kind::Open:
    case Kind::Close:
    case Kind::Other:
      break;
  }
  return refused(ColaError::UnknownCommand);
}

const Parameter* Device::parameter(std::string_view name) const {
  const auto found = std::ranges::find(facts_.parameters, name, &Parameter::name);
  return found != facts_.parameters.end() && found->value ? &*found : nullptr;
}

Device::Told Device::identityVariable(std::string_view name) const {
  if (name == "DeviceIdent") return Writer{}.text(kIdent).text(kFirmware).bytes();
  if (name == "FirmwareVersion") return Writer{}.text(kFirmware).bytes();
  if (name == "SerialNumber") return Writer{}.text(identity_.serial).bytes();
  if (name == "DImanf") return Writer{}.text("SICK AG").bytes();
  constexpr std::string_view kOrderNumber = "1112649";
  if (name == "DIornr") return Writer{}.raw(std::as_bytes(std::span{kOrderNumber})).bytes();
  if (name == "LocationName") return Writer{}.text("not defined").bytes();
  if (name == "BlobTcpPortAPI")
    return Writer{}.number(static_cast<std::uint16_t>(identity_.stream_port)).bytes();
  if (name == "BlobTransportProtocolAPI") return Writer{}.number(std::uint8_t{0}).bytes();  // TCP
  return std::nullopt;
}

Device::Told Device::stateVariable(std::string_view name) const {
  constexpr std::array<std::pair<std::string_view, int>, 5> kLogs{
      {{"MSdbg", 25}, {"MSinfo", 25}, {"MSwarn", 25}, {"MSerr", 10}, {"MSfat", 10}}};
  for (const auto& [log, entries] : kLogs) {
    if (name == log) return emptyLog(entries);
  }
  if (name == "enDepthMask") return Writer{}.flag(masks_depth_).bytes();
  if (name == "frontendMode") return Writer{}.number(static_cast<std::uint8_t>(mode_)).bytes();
  if (const auto found = functions_.find(name); found != functions_.end())
    return Writer{}.number(found->second).bytes();
  // Nothing is tied to the two inputs and outputs.
  if (name == "IOValue") return Writer{}.number(std::int8_t{0}).number(std::int8_t{0}).bytes();
  if (name == "humidity") return Writer{}.number(0.0).bytes();
  constexpr std::uint8_t kGood = 3;
  if (name == "TmpLvl" || name == "OpVoltageStatus") return Writer{}.number(kGood).bytes();
  if (name == "illuminationActive") return Writer{}.flag(mode_ != FrontendMode::Stop).bytes();
  const auto tenths =
      static_cast<std::int16_t>(std::lround(10.0 * std::clamp(facts_.temperature_c, -300.0, 3000.0)));
  if (name == "SysTemperatureCurrentValue") return Writer{}.number(tenths).bytes();
  if (name == kTemperatureMargin) return Writer{}.number(temperature_margin_c_).bytes();
  // Lists, with how many they have before them.
  if (name == "TemperatureNames") return Writer{}.number(std::uint16_t{1}).text("system").bytes();
  if (name == "TemperatureValues") return Writer{}.number(std::uint16_t{1}).number(tenths).bytes();
  if (name == "deviceState") return Writer{}.number(std::uint16_t{1}).bytes();
  if (name == "binningOption") return Writer{}.number(std::uint8_t{0}).bytes();
  return std::nullopt;
}

Device::Told Device::sourceVariable(std::string_view name) const {
  const auto counted = [](double number) {
    return Writer{}.number(static_cast<std::uint32_t>(std::lround(number))).bytes();
  };
  if (name == kIntegrationTime.name) {
    const Parameter* found = parameter(kIntegrationTime.parameter);
    if (found != nullptr) return counted(std::clamp(*found->value, 0.0, 1e9));
  }
  if (name == kFramePeriod && facts_.frame_interval_us)
    return counted(std::clamp(*facts_.frame_interval_us, 0.0, 4e9));
  return std::nullopt;
}

Device::Outcome Device::read(const ColaCommand& command) const {
  for (const auto& told :
       {identityVariable(command.name), stateVariable(command.name), sourceVariable(command.name)}) {
    if (told) return done(command, *told);
  }
  return refused(ColaError::UnknownVariable);
}

std::optional<ColaError> Device::writeSwitch(const ColaCommand& command) {
  const auto value = Reader{command.params}.number<std::uint8_t>();
  const auto function = functions_.find(command.name);
  const bool is_known =
      function != functions_.end() || command.name == "enDepthMask" || command.name == "frontendMode";
  if (!is_known) return ColaError::UnknownVariable;
  if (!value) return ColaError::TooShort;
  if (command.name == "enDepthMask") return masks_depth_ = *value != 0, std::nullopt;
  if (function != functions_.end()) {
    if (*value > kMostFunction) return ColaError::InvalidData;
    return function->second = *value, std::nullopt;
  }
  if (*value > static_cast<std::uint8_t>(FrontendMode::ExternalTrigger)) return ColaError::InvalidData;
  return mode_ = static_cast<FrontendMode>(*value), std::nullopt;
}

std::optional<Device::Outcome> Device::writeSource(const ColaCommand& command) const {
  const bool is_period = command.name == kFramePeriod;
  if (!is_period && command.name != kIntegrationTime.name) return std::nullopt;
  const Parameter* found = parameter(is_period ? kFrameRate : kIntegrationTime.parameter);
  if (found == nullptr) return refused(ColaError::WriteDenied);
  const auto value = Reader{command.params}.number<std::uint32_t>();
  if (!value) return refused(ColaError::TooShort);
  if (*value == 0) return refused(ColaError::InvalidData);
  const double wanted = is_period ? kPerSecond_us / *value : static_cast<double>(*value);
  if (!found->bounds.contains(wanted)) return refused(ColaError::InvalidData);
  Outcome outcome = done(command);
  outcome.changes.emplace_back(found->name, wanted);
  return outcome;
}

Device::Outcome Device::write(const ColaCommand& command, const Client& client) {
  const bool is_there =
      identityVariable(command.name) || stateVariable(command.name) || sourceVariable(command.name);
  if (!is_there) return refused(ColaError::UnknownVariable);
  const auto needed = command.name == kTemperatureMargin ? UserLevel::Service : UserLevel::Maintenance;
  if (client.level < needed) return refused(ColaError::WriteDenied);
  if (command.name == kTemperatureMargin) {
    const auto margin = Reader{command.params}.number<std::int16_t>();
    if (!margin) return refused(ColaError::TooShort);
    temperature_margin_c_ = *margin;
    return done(command);
  }
  if (auto outcome = writeSource(command)) return *std::move(outcome);
  if (const auto error = writeSwitch(command))
    return refused(*error == ColaError::UnknownVariable ? ColaError::WriteDenied : *error);
  Outcome outcome = done(command);
  if (command.name == "frontendMode") {
    outcome.frames = mode_ == FrontendMode::Stop ? 0 : kEndless;
    if (const Parameter* triggered = parameter("triggered"))
      outcome.changes.emplace_back(triggered->name, mode_ == FrontendMode::ExternalTrigger ? 1.0 : 0.0);
  }
  return outcome;
}

Device::Outcome Device::call(const ColaCommand& command, Client& client) {
  const auto playing = [&](int frames) {
    mode_ = frames == 0 ? FrontendMode::Stop : mode_ == FrontendMode::Stop ? FrontendMode::Continuous : mode_;
    Outcome outcome = done(command);
    outcome.frames = frames;
    return outcome;
  };
  if (command.name == "PLAYSTART") return playing(kEndless);
  if (command.name == "PLAYSTOP") return playing(0);
  if (command.name == "PLAYNEXT") {
    Outcome outcome = done(command);
    outcome.frames = 1;
    return outcome;
  }
  if (command.name == "PLAYBURST") {
    const auto count = Reader{command.params}.number<std::uint16_t>();
    if (!count) return refused(ColaError::TooShort);
    Outcome outcome = done(command);
    outcome.frames = *count;
    return outcome;
  }
  if (command.name == "GetBlobClientConfig") return done(command, Writer{}.flag(true).bytes());
  if (command.name == "GetChallenge") return challenge(command, client);
  if (command.name == "SetUserLevel") return logIn(command, client);
  if (command.name == "Run") {
    client = {};
    return done(command, Writer{}.flag(true).bytes());
  }
  return refused(ColaError::UnknownMethod);
}

/// With a salt for clients that name the level, as newer firmware wants it; without one for the others.
Device::Outcome Device::challenge(const ColaCommand& command, Client& client) const {
  using toftwin::visionary::kChallengeSize;
  client.challenge = randomBytes(kChallengeSize);
  client.salt = command.params.empty() ? std::vector<std::uint8_t>{} : randomBytes(kChallengeSize);
  Writer writer;
  writer.number(kSuccess);
  for (const std::uint8_t one : client.challenge) writer.number(one);
  for (const std::uint8_t one : client.salt) writer.number(one);
  return done(command, writer.bytes());
}

Device::Outcome Device::logIn(const ColaCommand& command, Client& client) {
  Reader reader{command.params};
  const auto given = reader.raw(sizeof(toftwin::visionary::Digest));
  const auto number = reader.number<std::uint8_t>();
  if (!given || !number) return refused(ColaError::TooShort);
  const auto told = [&](std::uint8_t result) { return done(command, Writer{}.number(result).bytes()); };
  const auto level = toftwin::visionary::userLevelOf(*number);
  const auto password = level ? identity_.passwords.find(*level) : identity_.passwords.end();
  // A challenge is good for one answer.
  const auto challenge = std::exchange(client.challenge, {});
  const auto salt = std::exchange(client.salt, {});
  if (password == identity_.passwords.end() || password->second.empty() || challenge.empty())
    return told(kNotAccepted);
  const auto expected = toftwin::visionary::responseTo(challenge, salt, *level, password->second);
  if (CRYPTO_memcmp(expected.data(), given->data(), expected.size()) != 0) return told(kNotAccepted);
  client.level = *level;
  return told(kSuccess);
}

}  // namespace toftwin::daemon::visionary
