// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <toftwin/client.h>

#include "../kept_log.h"
#include "../open_folder.h"
#include "daemon/daemon.h"
#include "fakes.h"
#include "protocol/transport/memfd.h"
#include "protocol/wire/codec.h"

/// The whole daemon in the test's process, with real clients on its sockets.
namespace toftwin::daemon::test {

inline constexpr std::chrono::seconds kSoon{30};  // only a broken daemon needs that long

/// A folder of its own for a test, and a daemon in it.
class RunningDaemon : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = toftwin::test::makeOpenFolder("toftwind");
    ASSERT_FALSE(folder_.empty());
  }
  void TearDown() override {
    stop();
    std::filesystem::remove_all(folder_);
  }

  void configure(const std::string& toml) { std::ofstream{folder_ / "toftwind.toml"} << toml; }
  [[nodiscard]] Daemon::Options options() const {
    return {.config = folder_ / "toftwind.toml", .port = 0, .socket = (folder_ / "s").string()};
  }
  void start(const std::string& sources) {
    configure("recording_folder = 'recordings'\n" + sources);
    start(options());
  }
  void start(Daemon::Options options) {
    auto started = Daemon::start(std::move(options));
    ASSERT_TRUE(started.ok()) << started.error().message;
    daemon_ = *std::move(started);
    thread_ = std::thread{[this] { daemon_->run(); }};
  }
  void stop() {
    if (!daemon_) return;
    daemon_->stop();
    thread_.join();
    daemon_.reset();
  }
  Client client(bool over_tcp = false) {
    auto connected = Client::connect(over_tcp ? "tcp:127.0.0.1:" + std::to_string(daemon_->port())
                                              : "unix:" + daemon_->socketPath());
    EXPECT_TRUE(connected.ok()) << connected.error().message;
    return *std::move(connected);
  }

  /// Of the only facade, as health tells them; nothing: not known.
  std::optional<std::uint32_t> facadeClients() {
    const auto health = client().health();
    EXPECT_TRUE(health.ok() && health->facades.size() == 1);
    return health.ok() && health->facades.size() == 1 ? health->facades.front().clients : std::nullopt;
  }

  FakeClock clock_;  // for the test that wants it; outlives the daemon
  std::shared_ptr<toftwin::test::KeptLog> log_ =
      std::make_shared<toftwin::test::KeptLog>();  // shared with spdlog
  toftwin::test::LoggingTo logging_{log_};
  std::filesystem::path folder_;
  std::unique_ptr<Daemon> daemon_;
  std::thread thread_;
};

inline const std::string kTriggered =
    "[[source]]\nname = 'cam'\ndriver = 'pattern'\npace = 'trigger'\n"
    "width = 32\nheight = 16\n";
inline const std::string kFast =
    "[[source]]\nname = 'cam'\ndriver = 'pattern'\npace = 'fast'\n"
    "width = 32\nheight = 16\n";

/// Waits until `holds`; for what other threads do without telling.
template <class Condition>
testing::AssertionResult eventually(Condition holds) {
  const auto deadline = std::chrono::steady_clock::now() + kSoon;
  while (!holds()) {
    if (std::chrono::steady_clock::now() > deadline)
      return testing::AssertionFailure() << "it did not come";
    std::this_thread::yield();
  }
  return testing::AssertionSuccess();
}

/// A client of bytes, which says and reads what the test wants.
class RawClient {
 public:
  explicit RawClient(const std::string& path)
      : fd_(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path.copy(address.sun_path, sizeof address.sun_path - 1);
    EXPECT_EQ(::connect(fd_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  }
  void send(const wire::Message& message) { sendBytes(wire::toBytes(*wire::encode(message))); }
  void sendBytes(const std::vector<std::byte>& bytes) {
    EXPECT_EQ(::send(fd_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL),
              static_cast<ssize_t>(bytes.size()));
  }
  /// Some bytes, at least one unless the daemon closed.
  std::size_t receive(std::size_t count) {
    std::vector<std::byte> bytes(count);
    const ssize_t got = ::recv(fd_.get(), bytes.data(), count, 0);
    return got > 0 ? static_cast<std::size_t>(got) : 0;
  }
  /// The next message, or nothing when the daemon closed.
  std::optional<wire::Message> message() {
    std::vector<std::byte> bytes(wire::kPreambleSize);
    if (!fill(bytes, 0)) return std::nullopt;
    const auto preamble = wire::decodePreamble(std::span{bytes}.first<wire::kPreambleSize>(), {});
    EXPECT_TRUE(preamble.ok());
    const std::size_t size = wire::kPreambleSize + preamble->header_bytes + preamble->body_bytes;
    bytes.resize(size);
    if (!fill(bytes, wire::kPreambleSize)) return std::nullopt;
    auto decoded = wire::decode(Buffer::adopt(bytes));
    EXPECT_TRUE(decoded.ok());
    return *std::move(decoded);
  }

 private:
  bool fill(std::vector<std::byte>& bytes, std::size_t from) {
    while (from < bytes.size()) {
      const ssize_t got = ::recv(fd_.get(), bytes.data() + from, bytes.size() - from, 0);
      if (got <= 0) return false;
      from += static_cast<std::size_t>(got);
    }
    return true;
  }
  transport::FileDescriptor fd_;
};

}  // namespace toftwin::daemon::test
