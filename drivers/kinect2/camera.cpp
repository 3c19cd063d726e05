// SPDX-License-Identifier: Apache-2.0
#include "drivers/kinect2/camera.h"

#include <fmt/format.h>

#include <thread>
#include <utility>

namespace toftwin::drivers::kinect2 {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::uint32_t kUsualMode = 0x0064'0064, kReady = 1;
constexpr int kMostStale = 4;  ///< messages of an earlier command that nobody read
constexpr std::chrono::milliseconds kAskAgain{50};

}  // namespace

Result<Bytes> CameraSession::execute(const Command& command) {
  if (!is_alive_) return Error{Error::Code::Disconnected, "kinect2: the camera does not answer any more"};
  const auto fail = [&](Error error) {
    is_alive_ = false;
    return error;
  };
  const std::uint32_t number = number_++;
  if (auto sent = link_->send(encode(command, number)); !sent) return fail(sent.error());
  Bytes data;
  bool has_data = command.most_bytes == 0;
  for (int messages = 0; messages < kMostStale + 2; ++messages) {
    auto message = link_->receive(has_data ? kDoneBytes : command.most_bytes);
    if (!message) return fail(message.error());
    if (const auto done = doneNumber(*message)) {
      if (*done != number) continue;  // of a command before this one
      if (has_data) return data;
      return fail({Error::Code::Unsupported,
                   fmt::format("kinect2: the camera's firmware does not know the command {:#04x}",
                               static_cast<std::uint32_t>(command.code))});
    }
    data = *std::move(message);
    has_data = true;
  }
  return fail({Error::Code::Malformed,
               fmt::format("kinect2: the camera does not end its answer to the command {:#04x}",
                           static_cast<std::uint32_t>(command.code))});
}

Result<CameraSession::About> CameraSession::open() {
  // As libfreenect2 leaves a camera that it has opened, and then wakes it up.
  for (const bool is_suspended : {true, false}) {
    if (auto set = link_->suspend(is_suspended); !set) return set.error();
  }
  is_suspended_ = false;
  is_open_ = true;
  About about;
  const auto firmware = execute(readFirmware());
  if (!firmware) return firmware.error();
  auto version = firmwareIn(*firmware);
  if (!version) return version.error();
  about.firmware = *std::move(version);
  if (const auto hardware = execute(readHardware()); !hardware) return hardware.error();
  const auto serial = execute(readSerial());
  if (!serial) return serial.error();
  auto digits = serialIn(*serial);
  if (!digits) return digits.error();
  about.serial = *std::move(digits);
  const auto page = execute(readLens());
  if (!page) return page.error();
  const auto lens = lensIn(*page);
  if (!lens) return lens.error();
  about.lens = *lens;
  return about;
}

Result<> CameraSession::sayMode() {
  for (const Command& command : {setMode(true, kUsualMode), setMode(false)}) {
    if (auto done = execute(command); !done) return done.error();
  }
  return {};
}

Result<> CameraSession::waitUntilReady() {
  const auto until = Clock::now() + kReadyWithin;
  while (true) {
    const auto answer = execute(readStatus());
    if (!answer) return answer.error();
    const auto status = statusIn(*answer);
    if (!status) return status.error();
    if ((*status & kReady) != 0) return {};
    if (Clock::now() >= until) {
      return Error{
          Error::Code::Timeout,
          fmt::format(
              "kinect2: the camera is not ready to stream (status {:#x}); is its power supply plugged in?",
              *status)};
    }
    std::this_thread::sleep_for(kAskAgain);
  }
}

Result<PhaseTables> CameraSession::start(PacketSink& sink, int transfers) {
  if (is_suspended_) {
    if (auto awake = link_->suspend(false); !awake) return awake.error();
    is_suspended_ = false;
  }
  const auto page = execute(readPhaseTables());
  if (!page) return page.error();
  auto tables = phaseTablesIn(*page);
  if (!tables) return tables.error();
  if (auto said = sayMode(); !said) return said.error();
  if (auto ready = waitUntilReady(); !ready) return ready.error();
  if (auto done = execute(initStreams()); !done) return done.error();
  is_streaming_ = true;  // what is begun is to be ended, however far it came
  if (auto enabled = link_->enableStream(true); !enabled) return enabled.error();
  for (const Command& command : {readStatus(), setStreaming(true)}) {
    if (auto done = execute(command); !done) return done.error();
  }
  if (auto started = link_->startPackets(sink, transfers); !started) return started.error();
  return *std::move(tables);
}

void CameraSession::stop() {
  if (!is_streaming_) return;
  is_streaming_ = false;
  link_->stopPackets();
  if (!is_alive_) return;
  is_alive_ = link_->enableStream(false).ok() && sayMode().ok() && execute(stopStreams()).ok() &&
              execute(setStreaming(false)).ok();
  for (int i = 0; i < 2 && is_alive_; ++i) {
    is_alive_ = execute(setMode(true)).ok() && execute(setMode(false)).ok();
  }
  if (is_alive_) is_suspended_ = link_->suspend(true).ok();
}

void CameraSession::close() {
  if (!link_ || !is_open_) return;
  stop();
  if (!is_alive_) return;
  if (is_suspended_ && !link_->suspend(false).ok()) return;
  if (sayMode().ok() && execute(shutDown()).ok()) static_cast<void>(link_->suspend(true));
}

}  // namespace toftwin::drivers::kinect2
