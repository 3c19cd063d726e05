// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/gige_vision/sender.h"

#include <fmt/format.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <algorithm>
#include <bit>

#include "drivers/logging.h"

namespace toftwin::daemon::gige_vision {
namespace {

using boost::system::error_code;
using std::chrono::steady_clock;

constexpr std::size_t kMostBlocks = 4, kMostAgain = 4096, kLeastKept = 2;
constexpr int kBatch = 64;  ///< packets in one go, so that commands are answered in between
constexpr std::chrono::microseconds kFull{200};  ///< until a socket that was full is tried again
constexpr std::chrono::nanoseconds kMostSpread = std::chrono::milliseconds{10};
constexpr int kSocketBytes = 4 << 20;
constexpr std::uint32_t kMostUnavailable = 64;

}  // namespace

std::chrono::nanoseconds pauseBetween(std::uint32_t packets, std::chrono::nanoseconds delay,
                                      std::chrono::nanoseconds between_blocks) {
  return std::max(delay, std::min(kMostSpread, between_blocks / 2) / packets);
}

void BlockInterval::note(std::chrono::steady_clock::time_point block) {
  constexpr std::size_t kMost = 5;
  if (last_) intervals_.push_back(block - *last_);
  if (intervals_.size() > kMost) intervals_.pop_front();
  last_ = block;
}

std::chrono::nanoseconds BlockInterval::median() const {
  if (intervals_.empty()) return 2 * kMostSpread;
  auto sorted = intervals_;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::ranges::nth_element(sorted, middle);
  return *middle;
}

int packetsAtOnce(std::uint32_t packet_size) {
  constexpr std::uint32_t kThird = 212'992 / 3;              // of net.core.rmem_default
  constexpr std::uint32_t kAllocated = 384, kCounted = 256;  // beside a datagram's own bytes
  const std::uint32_t taken = std::bit_ceil(packet_size + kAllocated) + kCounted;  // as kmalloc gives them
  return static_cast<int>(std::max(1U, kThird / taken));
}

Sender::Sender(boost::asio::io_context& io, boost::asio::ip::udp::socket socket, LineFaults faults,
               Duration late, std::size_t bytes_kept, std::string name)
    : socket_(std::move(socket)),
      timer_(io),
      line_(std::move(faults), late, [this](const Bytes& packet) { return put(packet); }),
      bytes_kept_(bytes_kept),
      name_(std::move(name)) {
  error_code ignored;
  socket_.non_blocking(true, ignored);
  socket_.set_option(boost::asio::socket_base::send_buffer_size{kSocketBytes}, ignored);
  // A packet that is too large for the line must not come in pieces: that is how clients find the size.
  const int never = IP_PMTUDISC_DO;
  ::setsockopt(socket_.native_handle(), IPPROTO_IP, IP_MTU_DISCOVER, &never, sizeof never);
}

void Sender::aim(const Endpoint& to, std::uint32_t packet_size, std::chrono::nanoseconds delay) {
  to_ = to;
  at_once_ = packetsAtOnce(packet_size);
  delay_ = delay;
}

bool Sender::send(std::shared_ptr<const Block> block) {
  if (waiting_.size() >= kMostBlocks) return false;
  sent_.push_back(block);
  sent_bytes_ += block->size();
  while (sent_.size() > kLeastKept && sent_bytes_ > bytes_kept_) {
    sent_bytes_ -= sent_.front()->size();
    sent_.pop_front();
  }
  interval_.note(steady_clock::now());
  const std::uint32_t last = block->packets() - 1;
  waiting_.push_back({std::move(block), 0, last, false});
  if (!is_pumping_) pump();
  return true;
}

void Sender::sendAgain(const Resend& asked) {
  const auto block = std::ranges::find_if(sent_, [&](const auto& one) {
    return one->id() == asked.block && one->hasLongIds() == asked.has_long_ids;
  });
  if (block == sent_.end()) {
    const std::uint64_t end =
        std::min<std::uint64_t>(std::uint64_t{asked.last} + 1, std::uint64_t{asked.first} + kMostUnavailable);
    for (std::uint64_t i = asked.first; i < end; ++i)
      put(unavailablePacket(asked, static_cast<std::uint32_t>(i)));
    return;
  }
  std::uint64_t end = std::min<std::uint64_t>(std::uint64_t{asked.last} + 1, (*block)->packets());
  for (const Waiting& one : waiting_) {
    if (one.block == *block) end = std::min<std::uint64_t>(end, one.next);  // those come anyway
  }
  if (asked.first >= end || again_.size() >= kMostAgain) return;
  again_.push_back({*block, asked.first, static_cast<std::uint32_t>(end - 1), true});
  if (!is_pumping_) pump();
}

void Sender::sendTestPacket(std::uint32_t size) { put(testPacket(size)); }

void Sender::finish() {
  if (waiting_.size() > 1) waiting_.resize(1);
}

void Sender::clear() {
  waiting_.clear();
  again_.clear();
  sent_.clear();
  sent_bytes_ = 0;
  line_.clear();
}

void Sender::pump() {
  is_pumping_ = false;
  const auto now = steady_clock::now();
  due_ = std::max(due_, now - at_once_ * pause());
  for (int i = 0; due_ <= now; ++i) {
    if (waiting_.empty() && again_.empty()) {
      if (!line_.finish()) wake(now + kFull);
      return;
    }
    if (i == kBatch) break;
    const auto pause_after = pause();
    if (!sendNext()) return wake(now + kFull);
    due_ += pause_after;
  }
  wake(due_);
}

/// Half as long where the last block waits that may: the next would be lost.
std::chrono::nanoseconds Sender::pause() const {
  const auto& queue = again_.empty() ? waiting_ : again_;
  if (queue.empty() || (again_.empty() && delay_.count() == 0)) return delay_;
  const auto pause = pauseBetween(queue.front().block->packets(), delay_, interval_.median());
  return waiting_.size() < kMostBlocks ? pause : std::max(delay_, pause / 2);
}

void Sender::wake(steady_clock::time_point when) {
  is_pumping_ = true;
  timer_.expires_at(when);
  timer_.async_wait([this, alive = is_alive_](error_code cancelled) {
    if (!cancelled && *alive) pump();
  });
}

bool Sender::sendNext() {
  if (!line_.flush()) return false;
  auto& queue = again_.empty() ? waiting_ : again_;
  Waiting& front = queue.front();
  const Block& block = *front.block;
  line_.take(block.packet(front.next, front.is_again), [&] {
    return fmt::format("block {} packet {}{}", block.id(), front.next, front.is_again ? " again" : "");
  });
  if (front.next++ == front.last) queue.pop_front();
  return line_.flush();
}

bool Sender::put(const Bytes& packet) {
  if (to_.port() == 0 || to_.address().is_unspecified()) return true;
  error_code error;
  socket_.send_to(boost::asio::buffer(packet), to_, 0, error);
  if (error == boost::asio::error::would_block || error == boost::asio::error::no_buffer_space) return false;
  if (error == boost::asio::error::message_size && !std::exchange(is_too_large_told_, true)) {
    logging::warn("{}: packets of {} bytes do not fit through the line; a client must set a smaller size",
                  name_, packet.size() + 28);
  }
  return true;  // what cannot be sent is lost on the line
}

}  // namespace toftwin::daemon::gige_vision
