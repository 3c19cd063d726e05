// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "drivers/kinect2/link.h"
#include "emulated_kinect2.h"

namespace toftwin::test {

/// A bus with one emulated camera on it, or none: the tests without a kernel.
class EmulatedKinect2Bus final : public drivers::kinect2::Bus {
 public:
  explicit EmulatedKinect2Bus(EmulatedKinect2::Options options = {})
      : state_(std::make_shared<State>(std::move(options))) {}

  std::vector<drivers::kinect2::Found> cameras() override {
    if (!state_->is_plugged) return {};
    return {{.name = "Emulated Kinect v2",
             .serial = state_->device.options().serial,
             .port = "2-1.4",
             .warning = {}}};
  }
  Result<std::unique_ptr<drivers::kinect2::Link>> open(const drivers::kinect2::Found&, bool reset) override {
    if (!state_->is_plugged) return gone();
    if (state_->is_open.exchange(true)) return Error{Error::Code::Busy, "another program has it"};
    if (reset) state_->device.restart();
    return std::unique_ptr<drivers::kinect2::Link>{std::make_unique<EmulatedLink>(state_)};
  }

  EmulatedKinect2& device() { return state_->device; }
  void unplug() { state_->is_plugged = false; }
  void plugIn() {
    state_->device.restart();
    state_->is_plugged = true;
  }
  [[nodiscard]] bool isOpen() const { return state_->is_open; }
  /// Between frames.
  std::atomic<std::int64_t>& interval_us() { return state_->interval_us; }
  /// From the start until the first one; at once, if nobody says otherwise.
  std::atomic<std::int64_t>& first_us() { return state_->first_us; }

 private:
  struct State {
    explicit State(EmulatedKinect2::Options options) : device(std::move(options)) {}
    EmulatedKinect2 device;
    std::atomic<bool> is_plugged{true}, is_open{false};
    std::atomic<std::int64_t> interval_us{33'333}, first_us{0};
  };
  static Error gone() { return {Error::Code::Disconnected, "the cable is not plugged in"}; }

  class EmulatedLink final : public drivers::kinect2::Link {
   public:
    explicit EmulatedLink(std::shared_ptr<State> state) : state_(std::move(state)) {}
    ~EmulatedLink() override {
      stopPackets();
      state_->is_open = false;
    }
    Result<> send(std::span<const std::byte> bytes) override {
      if (!state_->is_plugged) return gone();
      state_->device.command(bytes);
      return {};
    }
    Result<Bytes> receive(std::size_t most) override {
      if (!state_->is_plugged) return gone();
      auto answer = state_->device.answer();
      if (!answer) {
        std::this_thread::sleep_for(std::chrono::milliseconds{50});
        return Error{Error::Code::Timeout, "no answer"};
      }
      if (answer->size() > most) answer->resize(most);
      return *std::move(answer);
    }
    Result<> suspend(bool is_suspended) override {
      if (!state_->is_plugged) return gone();
      state_->device.suspend(is_suspended);
      return {};
    }
    Result<> enableStream(bool on) override {
      if (!state_->is_plugged) return gone();
      state_->device.alternate(on ? 1 : 0);
      return {};
    }
    Result<> startPackets(drivers::kinect2::PacketSink& sink, int) override {
      thread_ = std::jthread{[this, &sink](const std::stop_token& stop) { run(sink, stop); }};
      return {};
    }
    void stopPackets() override { thread_ = {}; }

   private:
    using Time = std::chrono::steady_clock::time_point;
    void run(drivers::kinect2::PacketSink& sink, const std::stop_token& stop) {
      pauseUntil(after(state_->first_us), stop);
      while (!stop.stop_requested()) {
        if (!state_->is_plugged) {
          sink.lost(gone());
          return;
        }
        const auto due = after(state_->interval_us);
        if (state_->device.isStreaming()) {
          sink.packet({});
          for (const auto& packet : state_->device.nextFrame()) {
            if (packet.is_lost)
              sink.missed();
            else
              sink.packet(packet.bytes);
          }
        }
        pauseUntil(due, stop);
      }
    }
    static Time after(std::int64_t us) {
      return std::chrono::steady_clock::now() + std::chrono::microseconds{us};
    }
    /// Or until it is told to stop, or the cable is pulled.
    void pauseUntil(Time due, const std::stop_token& stop) {
      std::unique_lock lock{pause_};
      while (!stop.stop_requested() && state_->is_plugged && std::chrono::steady_clock::now() < due)
        told_.wait_until(lock, stop, std::min(due, after(1000)), [] { return false; });
    }
    std::shared_ptr<State> state_;  // the test may take the bus away first
    std::mutex pause_;
    std::condition_variable_any told_;
    std::jthread thread_;
  };

  std::shared_ptr<State> state_;
};

}  // namespace toftwin::test
