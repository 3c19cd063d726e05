// SPDX-License-Identifier: Apache-2.0
#include "drivers/rig/bus.h"

#include <fmt/format.h>
#include <modbus/modbus.h>

#include <array>
#include <bit>
#include <cerrno>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>

namespace toftwin::rig {
namespace {

using Words = std::array<std::uint16_t, 2>;

int wordsOf(const Signal& signal) {
  return signal.number == NumberKind::U16 || signal.number == NumberKind::S16 ? 1 : 2;
}

double decode(const Signal& signal, Words words) {
  if (signal.number == NumberKind::U16) return words[0];
  if (signal.number == NumberKind::S16) return static_cast<std::int16_t>(words[0]);
  if (signal.words == WordOrder::LowFirst) std::swap(words[0], words[1]);
  const std::uint32_t both = static_cast<std::uint32_t>(words[0]) << 16 | words[1];
  if (signal.number == NumberKind::F32) return static_cast<double>(std::bit_cast<float>(both));
  if (signal.number == NumberKind::S32) return static_cast<std::int32_t>(both);
  return both;
}

/// Nothing if the number does not fit.
std::optional<Words> encode(const Signal& signal, double number) {
  if (!std::isfinite(number)) return std::nullopt;
  if (signal.number == NumberKind::F32) {
    const auto both = std::bit_cast<std::uint32_t>(static_cast<float>(number));
    Words words{static_cast<std::uint16_t>(both >> 16), static_cast<std::uint16_t>(both)};
    if (signal.words == WordOrder::LowFirst) std::swap(words[0], words[1]);
    return words;
  }
  const bool is_signed = signal.number == NumberKind::S16 || signal.number == NumberKind::S32;
  const double range = wordsOf(signal) == 1 ? 65'536.0 : 4'294'967'296.0;
  const double rounded = std::round(number), low = is_signed ? -range / 2.0 : 0.0;
  if (rounded < low || rounded >= low + range) return std::nullopt;
  const auto both = static_cast<std::uint32_t>(static_cast<std::int64_t>(rounded));
  if (wordsOf(signal) == 1) return Words{static_cast<std::uint16_t>(both), 0};
  Words words{static_cast<std::uint16_t>(both >> 16), static_cast<std::uint16_t>(both)};
  if (signal.words == WordOrder::LowFirst) std::swap(words[0], words[1]);
  return words;
}

const char* nameOf(Memory memory) {
  switch (memory) {
    case Memory::Coil:
      return "coil";
    case Memory::Discrete:
      return "discrete input";
    case Memory::Holding:
      return "holding register";
    case Memory::Input:
      return "input register";
  }
  return "";
}

bool isException(int number) {
  return number > MODBUS_ENOBASE && number < MODBUS_ENOBASE + MODBUS_EXCEPTION_MAX;
}

}  // namespace

struct Bus::Line {
  modbus_t* context = nullptr;
  std::string where;
  bool is_up = false;

  ~Line() {
    down();
    modbus_free(context);
  }
  void down() {
    if (is_up) modbus_close(context);
    is_up = false;
  }
  Result<> up() {
    if (is_up) return {};
    if (modbus_connect(context) != 0) {
      return Error{
          Error::Code::Disconnected,
          fmt::format("rig {}: {}; check power, network cable and the rig file's host and port",
                      where, modbus_strerror(errno))};
    }
    is_up = true;
    return {};
  }
  /// `call` gives -1 and errno if it fails. Whatever is no answer of the controller's leaves the
  /// line in a state that nobody knows: it is made anew, lest a late answer be taken for the next
  /// one.
  template <class Call>
  Result<> run(const Signal& signal, std::string_view name, const char* doing, Call call) {
    if (auto connected = up(); !connected) return connected;
    if (call() != -1) return {};
    const int number = errno;
    const bool is_refused = isException(number);
    if (!is_refused) down();
    return Error{
        is_refused            ? Error::Code::PermissionDenied
        : number == ETIMEDOUT ? Error::Code::Timeout
                              : Error::Code::Disconnected,
        fmt::format("rig {}: {} {} ({} {}): {}", where, doing, name, rig::nameOf(signal.memory),
                    signal.address,
                    is_refused ? fmt::format("exception {} of the controller ({})",
                                             number - MODBUS_ENOBASE, modbus_strerror(number))
                               : modbus_strerror(number))};
  }
  Result<Words> words(const Signal& signal, std::string_view name, int count) {
    Words words{};
    auto read = run(signal, name, "reading", [&] {
      std::uint8_t bit = 0;
      int got = -1;
      switch (signal.memory) {
        case Memory::Coil:
          got = modbus_read_bits(context, signal.address, 1, &bit);
          break;
        case Memory::Discrete:
          got = modbus_read_input_bits(context, signal.address, 1, &bit);
          break;
        case Memory::Holding:
          return modbus_read_registers(context, signal.address, count, words.data());
        case Memory::Input:
          return modbus_read_input_registers(context, signal.address, count, words.data());
      }
      words[0] = bit;
      return got;
    });
    if (!read) return read.error();
    return words;
  }
};

bool hasModbus() { return true; }
Bus::Bus(std::unique_ptr<Line> line) : line_(std::move(line)) {}
Bus::~Bus() = default;

Result<std::unique_ptr<Bus>> Bus::open(const RigFile& rig) {
  auto line = std::make_unique<Line>();
  line->where = fmt::format("{}:{}", rig.host, rig.port);
  line->context = modbus_new_tcp_pi(rig.host.c_str(), std::to_string(rig.port).c_str());
  if (line->context == nullptr) {
    return Error{Error::Code::InvalidArgument,
                 fmt::format("rig {}: {}", line->where, modbus_strerror(errno))};
  }
  const auto us = static_cast<std::uint32_t>(rig.answer_time.in(microsecond));
  modbus_set_slave(line->context, rig.unit);
  modbus_set_response_timeout(line->context, us / 1'000'000, us % 1'000'000);
  if (auto up = line->up(); !up) return up.error();
  return std::unique_ptr<Bus>{new Bus{std::move(line)}};
}

Result<double> Bus::read(const Signal& signal, std::string_view name) {
  const bool is_bit = signal.memory == Memory::Coil || signal.memory == Memory::Discrete;
  const auto words = line_->words(signal, name, is_bit ? 1 : wordsOf(signal));
  if (!words) return words.error();
  const double number = is_bit ? (*words)[0] : decode(signal, *words);
  if (!std::isfinite(number)) {
    return Error{Error::Code::Malformed,
                 fmt::format("rig {}: {} is no number", line_->where, name)};
  }
  return number * signal.scale + signal.offset;
}

Result<bool> Bus::isSet(const Signal& signal, std::string_view name) {
  const auto words = line_->words(signal, name, 1);
  if (!words) return words.error();
  const unsigned mask = signal.bit < 0 ? 0xFFFFU : 1U << static_cast<unsigned>(signal.bit);
  return (((*words)[0] & mask) != 0) != signal.inverted;
}

Result<> Bus::write(const Signal& signal, double value, std::string_view name) {
  const auto words = encode(signal, (value - signal.offset) / signal.scale);
  if (!words) {
    return Error{
        Error::Code::InvalidArgument,
        fmt::format("rig {}: {} = {} does not fit into its register", line_->where, name, value)};
  }
  return line_->run(signal, name, "writing", [&] {
    if (signal.memory == Memory::Coil)
      return modbus_write_bit(line_->context, signal.address, value != 0.0);
    return modbus_write_registers(line_->context, signal.address, wordsOf(signal), words->data());
  });
}

Result<> Bus::set(const Signal& signal, bool value, std::string_view name) {
  const bool raw = value != signal.inverted;
  std::uint16_t word = raw ? 1 : 0;
  if (signal.memory == Memory::Holding && signal.bit >= 0) {  // its neighbours stay as they are
    const auto now = line_->words(signal, name, 1);
    if (!now) return now.error();
    const unsigned mask = 1U << static_cast<unsigned>(signal.bit);
    word = static_cast<std::uint16_t>(raw ? (*now)[0] | mask : (*now)[0] & ~mask);
  }
  return line_->run(signal, name, "writing", [&] {
    if (signal.memory == Memory::Coil)
      return modbus_write_bit(line_->context, signal.address, raw ? 1 : 0);
    return modbus_write_register(line_->context, signal.address, word);
  });
}

}  // namespace toftwin::rig
