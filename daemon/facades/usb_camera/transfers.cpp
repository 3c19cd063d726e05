// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/usb_camera/transfers.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cerrno>

#include "daemon/facades/usb_camera/big_endian.h"

namespace toftwin::daemon::usb_camera {
namespace {

constexpr std::uint32_t kSubmit = 1, kUnlink = 2, kSubmitted = 3, kUnlinked = 4, kIn = 1;
constexpr std::uint32_t kNotIsochronous = 0xFFFF'FFFF;  // some hosts say 0
constexpr std::size_t kWords = 12, kCommandBytes = 4 * kWords, kPacketBytes = 16;
constexpr std::uint32_t kMostEndpoint = 15;
using Words = std::array<std::uint32_t, kWords>;

Words wordsOf(std::span<const std::byte> bytes) {
  Words words{};
  for (std::size_t i = 0; i < kWords; ++i) words[i] = big32At(bytes, 4 * i);
  return words;
}

std::uint32_t packetsOf(const Words& words) { return words[8] == kNotIsochronous ? 0 : words[8]; }

Error notOurs(std::string message) { return {Error::Code::InvalidArgument, std::move(message)}; }

/// The setup packet is bytes, not words. [USB 2.0, table 9-2: little-endian]
Setup setupIn(std::span<const std::byte> header) {
  const auto byte = [&](std::size_t at) { return std::to_integer<unsigned>(header[40 + at]); };
  const auto word = [&](std::size_t at) { return static_cast<std::uint16_t>(byte(at) | byte(at + 1) << 8U); };
  return {static_cast<std::uint8_t>(byte(0)), static_cast<std::uint8_t>(byte(1)), word(2), word(4), word(6)};
}

void appendHeader(Bytes& to, const Words& words) {
  for (const std::uint32_t word : words) appendBig32(to, word);
}

}  // namespace

Result<std::optional<std::size_t>> Transfers::sizeOf(std::span<const std::byte> bytes) {
  if (bytes.size() < kCommandBytes) return std::optional<std::size_t>{};
  const Words words = wordsOf(bytes);
  if (words[0] == kUnlink) return std::optional{kCommandBytes};
  if (words[0] != kSubmit) return notOurs(fmt::format("{:#x} is no command of USB/IP", words[0]));
  if (words[4] > kMostEndpoint) return notOurs(fmt::format("there is no endpoint {}", words[4]));
  const bool is_in = words[3] == kIn;
  const std::size_t most = is_in ? kMostBytes : kMostSentBytes;
  if (words[6] > most)
    return notOurs(fmt::format("a transfer of {} bytes, but {} are the most", words[6], most));
  if (packetsOf(words) > kMostPackets)
    return notOurs(fmt::format("a transfer of {} packets, but {} are the most", words[8], kMostPackets));
  return std::optional{kCommandBytes + (is_in ? 0 : words[6]) + kPacketBytes * packetsOf(words)};
}

Result<> Transfers::take(std::span<const std::byte> command) {
  const Words words = wordsOf(command);
  if (words[0] == kUnlink) {
    unlinked(words[1], words[5]);
    return {};
  }
  return submitted(words, command);
}

Result<> Transfers::submitted(std::span<const std::uint32_t> words, std::span<const std::byte> command) {
  if (waiting_count_ + controls_.size() >= kMostWaiting)
    return notOurs(fmt::format("more than {} transfers wait", kMostWaiting));
  const bool is_in = words[3] == kIn;
  const std::span<const std::byte> out = command.subspan(kCommandBytes, is_in ? 0 : words[6]);
  if (words[4] == 0) {
    controls_.push_back({words[1], is_in, words[6], setupIn(command), {out.begin(), out.end()}});
    serveControl();
    return {};
  }
  Transfer transfer;
  transfer.number = words[1];
  transfer.endpoint = static_cast<std::uint8_t>(words[4] | (is_in ? 0x80U : 0U));
  transfer.length = words[6];
  transfer.data.assign(out.begin(), out.end());
  for (std::size_t at = kCommandBytes + out.size(); at < command.size(); at += kPacketBytes)
    transfer.packets.push_back({.offset = big32At(command, at), .length = big32At(command, at + 4)});
  waiting_[transfer.endpoint].push_back(std::move(transfer));
  ++waiting_count_;
  return {};
}

/// A transfer that is unlinked is never answered itself.
void Transfers::unlinked(std::uint32_t number, std::uint32_t wanted) {
  std::size_t gone = 0;
  for (auto& [endpoint, queue] : waiting_)
    gone += std::erase_if(queue, [&](const Transfer& one) { return one.number == wanted; });
  waiting_count_ -= gone;
  for (std::size_t i = controls_.size(); i-- > 0;) {
    if (controls_[i].number != wanted) continue;
    ++gone;
    if (i == 0 && is_late_) {
      is_abandoned_ = true;  // what the device does cannot be taken back; its answer is
    } else {
      controls_.erase(controls_.begin() + static_cast<std::ptrdiff_t>(i));
    }
  }
  appendHeader(output_, {kUnlinked, number, 0, 0, 0, gone > 0 ? static_cast<std::uint32_t>(-ECONNRESET) : 0});
}

/// The endpoints take turns, so that one that always has something leaves the others their part of a slow
/// line.
void Transfers::serve(SteadyTime now) {
  serveControl();
  for (std::size_t in_vain = 0; in_vain < waiting_.size() && !isFull();) {
    auto turn = waiting_.upper_bound(served_last_);
    if (turn == waiting_.end()) turn = waiting_.begin();
    served_last_ = turn->first;
    in_vain = serveFirst(turn->second, now) ? 0 : in_vain + 1;
  }
}

bool Transfers::serveFirst(std::deque<Transfer>& queue, SteadyTime now) {
  if (queue.empty() || !device_.serve(queue.front(), now)) return false;
  const Transfer done = std::move(queue.front());
  queue.pop_front();
  --waiting_count_;
  answer(done);
  return true;
}

SteadyTime Transfers::due() const {
  SteadyTime next = SteadyTime::max();
  if (isFull()) return next;  // it is the host's turn
  for (const auto& [endpoint, queue] : waiting_) {
    if (!queue.empty()) next = std::min(next, device_.due(endpoint));
  }
  return next;
}

/// One after the other, as endpoint 0 does it.
void Transfers::serveControl() {
  while (!controls_.empty()) {
    const Control& control = controls_.front();
    if (is_late_) {
      const auto late = device_.lateAnswer();
      if (!late) return;
      if (!is_abandoned_) answerControl(control, *late);
      is_late_ = is_abandoned_ = false;
    } else {
      const Answer answer = controlOf(device_, control.setup, control.out);
      is_late_ = answer.comes_later;
      if (is_late_) continue;
      answerControl(control, answer);
    }
    controls_.pop_front();
  }
}

void Transfers::answerControl(const Control& control, const Answer& answer) {
  const bool is_short = control.is_in && answer.data.size() > control.length;  // host and setup packet differ
  const std::span<const std::byte> data{answer.data.data(), is_short ? control.length : answer.data.size()};
  // Of what came in, all was taken.
  const std::size_t actual = control.is_in ? data.size() : answer.status == 0 ? control.out.size() : 0;
  appendHeader(output_, {kSubmitted, control.number, 0, 0, 0, static_cast<std::uint32_t>(answer.status),
                         static_cast<std::uint32_t>(actual)});
  if (control.is_in) output_.insert(output_.end(), data.begin(), data.end());
}

void Transfers::answer(const Transfer& transfer) {
  appendHeader(output_, {kSubmitted, transfer.number, 0, 0, 0, static_cast<std::uint32_t>(transfer.status),
                         static_cast<std::uint32_t>(transfer.data.size()), 0,
                         static_cast<std::uint32_t>(transfer.packets.size())});
  if (transfer.isIn()) output_.insert(output_.end(), transfer.data.begin(), transfer.data.end());
  for (const Transfer::Packet& packet : transfer.packets) {
    for (const std::uint32_t word :
         {packet.offset, packet.length, packet.actual, static_cast<std::uint32_t>(packet.status)})
      appendBig32(output_, word);
  }
}

}  // namespace toftwin::daemon::usb_camera
