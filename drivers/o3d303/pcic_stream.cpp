// SPDX-License-Identifier: Apache-2.0
#include "drivers/o3d303/pcic_stream.h"

#include <fmt/format.h>

#include <boost/asio/buffer.hpp>
#include <boost/asio/write.hpp>
#include <chrono>
#include <utility>

namespace toftwin::drivers::o3d303 {
namespace {

using boost::system::error_code;
using Clock = std::chrono::steady_clock;
using toftwin::o3d303::Bytes;
using toftwin::o3d303::PcicReader;

bool isAnswer(const PcicStream::Message& one) { return one.message.ticket >= "1000"; }

}  // namespace

Error PcicStream::lost(std::string_view what) const {
  return {Error::Code::Disconnected, fmt::format("{}: {}: {}", driver_, name_, what)};
}

Result<> PcicStream::open(const Endpoint& camera, const toftwin::o3d303::Schema& schema) {
  close();
  name_ = fmt::format("{}:{}", camera.address().to_string(), camera.port());
  if (auto connected = connect(loop_, socket_, camera, {}, driver_); !connected) return connected;
  const auto answer = command(toftwin::o3d303::schemaCommand(toJson(schema)));
  if (!answer) return answer.error();
  if (*answer == toftwin::o3d303::kDone) return {};
  close();
  return Error{Error::Code::Incompatible,
               fmt::format("{}: {}: the camera's firmware does not know our schema", driver_, name_)};
}

void PcicStream::close() {
  error_code ignored;
  socket_.close(ignored);
  loop_.waitUntil([this] { return !is_reading_; }, SteadyTime::max());
  reader_ = PcicReader{kLongestMessage};
  kept_.clear();
  failure_.reset();
}

Result<char> PcicStream::command(std::string_view command) {
  const std::string ticket = std::to_string(next_ticket_);
  next_ticket_ = next_ticket_ == 9999 ? 1000 : next_ticket_ + 1;
  const Bytes bytes = toftwin::o3d303::encodePcic(ticket, command);
  const auto deadline = Clock::now() + kAnswerTime;
  std::optional<error_code> sent;
  boost::asio::async_write(socket_, boost::asio::buffer(bytes),
                           [&](error_code error, std::size_t) { sent = error; });
  if (loop_.waitUntil([&] { return sent.has_value(); }, deadline) != EventLoop::End::Done) {
    error_code ignored;
    socket_.close(ignored);
    loop_.waitUntil([&] { return sent.has_value(); }, SteadyTime::max());
    return lost("the camera takes no commands");
  }
  if (*sent) return lost(sent->message());
  while (true) {
    auto received = receive(deadline, {});
    if (!received && received.error().code == Error::Code::Timeout) {
      return lost(fmt::format("no answer to a command within {} ms", kAnswerTime.count()));
    }
    if (!received) return received.error();
    if (received->message.ticket == ticket) {
      const Bytes& content = received->message.content;
      return content.empty() ? toftwin::o3d303::kUnknown : static_cast<char>(content.front());
    }
    if (!isAnswer(*received)) kept_.push_back(*std::move(received));
  }
}

Result<PcicStream::Message> PcicStream::next(SteadyTime deadline, const std::stop_token& stop) {
  while (kept_.empty()) {
    auto received = receive(deadline, stop);
    if (!received) return received;
    if (!isAnswer(*received)) return received;
  }
  Message message = std::move(kept_.front());
  kept_.pop_front();
  return message;
}

Result<PcicStream::Message> PcicStream::receive(SteadyTime deadline, const std::stop_token& stop) {
  while (true) {
    auto message = reader_.next();
    if (!message) return lost(message.error().message);
    // What is left of the last piece is the beginning of the next one.
    if (*message) return Message{**std::move(message), std::exchange(arrived_, read_at_)};
    if (!is_reading_ && !failure_) beginRead();
    const auto end = loop_.waitUntil([this] { return !is_reading_; }, deadline, stop);
    if (end == EventLoop::End::Stopped) return Error{Error::Code::Stopped, "asked to stop"};
    if (end == EventLoop::End::TooLate) return Error{Error::Code::Timeout, "nothing has come"};
    if (failure_) return lost(fmt::format("the stream ended: {}", failure_->message()));
  }
}

void PcicStream::beginRead() {
  is_reading_ = true;
  socket_.async_read_some(boost::asio::buffer(piece_), [this](error_code error, std::size_t size) {
    is_reading_ = false;
    if (error) {
      failure_ = error;
      return;
    }
    read_at_ = Clock::now();
    if (!reader_.isWithinMessage()) arrived_ = read_at_;
    reader_.feed(std::span{piece_}.first(size));
  });
}

}  // namespace toftwin::drivers::o3d303
