// SPDX-License-Identifier: Apache-2.0
#include "drivers/visionary/control.h"

#include <fmt/format.h>

#include <boost/asio/write.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "drivers/visionary/wire/password.h"

namespace toftwin::drivers::visionary {
namespace {

using boost::system::error_code;
using toftwin::visionary::ColaCommand;
using toftwin::visionary::ColaError;
using toftwin::visionary::Reader;
using toftwin::visionary::Telegram;
using toftwin::visionary::UserLevel;
using toftwin::visionary::Writer;
using Kind = ColaCommand::Kind;
using Clock = std::chrono::steady_clock;

constexpr std::uint8_t kSessionSeconds = 60;

Error refusal(ColaError error, const std::string& name) {
  using Code = Error::Code;
  const auto code =
      error == ColaError::WriteDenied || error == ColaError::AccessDenied        ? Code::PermissionDenied
      : error == ColaError::UnknownVariable || error == ColaError::UnknownMethod ? Code::NotFound
                                                                                 : Code::InvalidArgument;
  return {code,
          fmt::format("visionary: the camera refused \"{}\" (CoLa error {})", name, static_cast<int>(error))};
}

}  // namespace

Error Line::lost(std::string_view what) const {
  return {Error::Code::Disconnected, fmt::format("visionary: {}: {}", name_, what)};
}

Result<> Line::connect(const Endpoint& to) {
  close();
  name_ = fmt::format("{}:{}", to.address().to_string(), to.port());
  std::optional<error_code> done;
  socket_.async_connect(to, [&](error_code error) { done = error; });
  if (loop_.waitUntil([&] { return done.has_value(); }, Clock::now() + kConnectTime) !=
      EventLoop::End::Done) {
    error_code ignored;
    socket_.close(ignored);
    loop_.waitUntil([&] { return done.has_value(); }, SteadyTime::max());
    return lost("connecting takes too long (is the camera powered, its cable in, its address right?)");
  }
  if (!*done) return {};
  error_code ignored;
  socket_.close(ignored);
  return lost(done->message());
}

void Line::close() {
  error_code ignored;
  socket_.close(ignored);
  loop_.waitUntil([this] { return !is_reading_; }, SteadyTime::max());
  failure_.reset();
  size_ = 0;
}

Result<> Line::send(const Bytes& bytes) {
  std::optional<error_code> sent;
  boost::asio::async_write(socket_, boost::asio::buffer(bytes),
                           [&](error_code error, std::size_t) { sent = error; });
  if (loop_.waitUntil([&] { return sent.has_value(); }, Clock::now() + kAnswerTime) != EventLoop::End::Done) {
    error_code ignored;
    socket_.close(ignored);
    loop_.waitUntil([&] { return sent.has_value(); }, SteadyTime::max());
    return lost("the camera takes no commands");
  }
  return *sent ? lost(sent->message()) : Result<>{};
}

Result<std::span<const std::byte>> Line::receive(SteadyTime deadline, const std::stop_token& stop) {
  if (!is_reading_ && size_ == 0 && !failure_) {
    is_reading_ = true;
    socket_.async_read_some(boost::asio::buffer(piece_), [this](error_code error, std::size_t size) {
      is_reading_ = false;
      size_ = size;
      if (error) failure_ = error;
    });
  }
  const auto end = loop_.waitUntil([this] { return !is_reading_; }, deadline, stop);
  if (end == EventLoop::End::Stopped) return Error{Error::Code::Stopped, "asked to stop"};
  if (end == EventLoop::End::TooLate) return Error{Error::Code::Timeout, "nothing has come"};
  if (failure_) return lost(fmt::format("the connection ended: {}", failure_->message()));
  return std::span<const std::byte>{piece_}.first(std::exchange(size_, 0));
}

Result<Telegram> Control::exchange(const Bytes& command) {
  if (auto sent = line_.send(encode(Telegram{session_, ++request_, command})); !sent) return sent.error();
  const auto deadline = Clock::now() + kAnswerTime;
  while (true) {
    auto telegram = reader_.next();
    if (!telegram) return Error{Error::Code::Disconnected, "visionary: " + telegram.error().message};
    if (*telegram && (*telegram)->request == request_) return **std::move(telegram);
    if (*telegram) continue;  // of a question that nobody waits for any more
    const auto piece = line_.receive(deadline, {});
    if (!piece && piece.error().code == Error::Code::Timeout)
      return Error{Error::Code::Disconnected,
                   fmt::format("visionary: no answer within {} ms", kAnswerTime.count())};
    if (!piece) return piece.error();
    reader_.feed(*piece);
  }
}

Result<> Control::open() {
  if (line_.isOpen()) return {};
  if (auto connected = line_.connect(camera_); !connected) return connected;
  reader_ = toftwin::visionary::TelegramReader{1 << 20};
  session_ = 0;
  const ColaCommand asked{
      .kind = Kind::Open, .name = {}, .params = Writer{}.number(kSessionSeconds).text("toftwin").bytes()};
  auto opened = exchange(askedOf(asked));
  if (!opened) {
    line_.close();
    return opened.error();
  }
  session_ = opened->session;
  return {};
}

/// A session that ended by itself is opened once more.
Result<Bytes> Control::ask(const ColaCommand& command) {
  for (int attempt = 0;; ++attempt) {
    if (auto opened = open(); !opened) return opened.error();
    const auto telegram = exchange(askedOf(command));
    if (!telegram) {
      line_.close();
      return telegram.error();
    }
    auto answer = toftwin::visionary::readAnswer(telegram->command, command);
    if (!answer) return Error{Error::Code::Disconnected, "visionary: " + answer.error().message};
    if (!answer->error) return std::move(answer->told);
    if (*answer->error != ColaError::UnknownSession || attempt > 0)
      return refusal(*answer->error, command.name);
    line_.close();
  }
}

Result<Bytes> Control::read(const std::string& variable) {
  return ask({.kind = Kind::Read, .name = variable, .params = {}});
}

Result<> Control::write(const std::string& variable, const Bytes& value) {
  const auto written = ask({.kind = Kind::Write, .name = variable, .params = value});
  return written ? Result<>{} : written.error();
}

Result<Bytes> Control::call(const std::string& method, const Bytes& params) {
  return ask({.kind = Kind::Call, .name = method, .params = params});
}

Result<> Control::logIn(std::string_view password) {
  constexpr auto kLevel = UserLevel::AuthorizedClient;
  const auto number = static_cast<std::uint8_t>(kLevel);
  // Older firmware takes no level, and gives no salt.
  auto told = call("GetChallenge", Writer{}.number(number).bytes());
  if (!told && told.error().code != Error::Code::Disconnected) told = call("GetChallenge");
  if (!told) return told.error();
  std::vector<std::uint8_t> numbers;
  for (const std::byte one : *told) numbers.push_back(std::to_integer<std::uint8_t>(one));
  constexpr auto kSize = toftwin::visionary::kChallengeSize;
  if (numbers.size() < 1 + kSize || numbers[0] != 0)
    return Error{Error::Code::PermissionDenied, "visionary: the camera lets nobody log in now"};
  const std::span all{numbers};
  const auto salt =
      numbers.size() >= 1 + 2 * kSize ? all.subspan(1 + kSize, kSize) : std::span<std::uint8_t>{};
  Writer writer;
  for (const std::uint8_t one : toftwin::visionary::responseTo(all.subspan(1, kSize), salt, kLevel, password))
    writer.number(one);
  const auto answer = call("SetUserLevel", writer.number(number).bytes());
  if (!answer) return answer.error();
  if (Reader{*answer}.number<std::uint8_t>() == std::uint8_t{0}) return {};
  return Error{Error::Code::PermissionDenied,
               "visionary: wrong password; set the key password to the camera's"};
}

}  // namespace toftwin::drivers::visionary
