// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>  // before asio: Boost 1.74 uses std::exchange without it

#include <boost/asio/ip/tcp.hpp>

#include <array>
#include <functional>
#include <list>
#include <memory>
#include <string>
#include <string_view>

#include "daemon/facades/accepting.h"
#include "daemon/facades/struck_frames.h"
#include "drivers/o3d303/wire/frame_writer.h"
#include "drivers/o3d303/wire/pcic.h"

namespace toftwin::daemon::o3d303 {

/// Asynchronous errors that the camera tells its clients, by the vendor's numbers.
struct PcicError {
  static constexpr int kTooManyConnections = 100'000'001;
  static constexpr int kNoTriggerAllowed = 100'001'000;
  static constexpr int kTriggerOverrun = 110'001'006;
  static constexpr int kIlluminationTooHot = 110'004'000;
};

/// The camera's port for frames and commands. Every connection has a schema of its own; one that is slow
/// loses frames, one that stalls holds up nobody. Used on the facade's thread only.
class PcicServer {
 public:
  struct Hooks {
    /// Asks for a frame and says later with which error it was refused, 0: it comes.
    std::function<void(std::function<void(int)>)> trigger;
    /// What connections get that have asked for nothing, and its JSON.
    std::function<toftwin::o3d303::Schema()> default_schema;
    std::function<std::string()> default_schema_text = [] { return std::string{}; };
    /// Answers to questions about the device ("G?"), or nothing for a command that is not known.
    std::function<std::string(std::string_view command)> ask;
    /// How many there are, whenever that changed.
    std::function<void(std::size_t)> connections;
    /// Makes an application active and says later whether it could.
    std::function<void(int index, std::function<void(bool)>)> activate =
        [](int, const std::function<void(bool)>& done) { done(false); };
    /// The one that was published last, until the next is; null: none was.
    std::function<const toftwin::o3d303::CameraFrame*()> last_frame = [] { return nullptr; };
    /// The error that lasts, which a connection is told that did not hear it begin; 0: none does.
    std::function<int()> lasting_error = [] { return 0; };
  };
  PcicServer(Listening listening, Hooks hooks);
  ~PcicServer();
  PcicServer(const PcicServer&) = delete;
  PcicServer& operator=(const PcicServer&) = delete;

  [[nodiscard]] std::uint16_t port() const { return accepting_.port(); }
  /// Closes all connections and takes no more until it is open again: those that come wait for that.
  void setOpen(bool is_open);
  /// To every connection that wants frames, in its own schema; those with equal schemas share the bytes.
  /// Where the line is cut, half of the message leaves, and the connection ends with it. Whether it went to
  /// any.
  bool publish(const toftwin::o3d303::CameraFrame& frame, const Damage& damage = {});
  void tellError(int code);
  void tellNotification(int code, std::string_view json);
  /// Since the last such error, for the command "E?".
  [[nodiscard]] int lastError() const { return last_error_; }

 private:
  class Connection;
  void take(boost::asio::ip::tcp::socket socket);
  void tell(std::string_view ticket, unsigned output, std::string_view text);
  void remove(const std::shared_ptr<Connection>& connection);
  [[nodiscard]] int freeNumber() const;

  const Hooks hooks_;
  int last_error_ = 0;
  static constexpr int kWires = 2;
  std::array<bool, kWires> wires_{};  ///< states of the camera's outputs, which nothing is tied to
  std::list<std::shared_ptr<Connection>> connections_;  // shared with their handlers
  const std::shared_ptr<bool> is_alive_ = std::make_shared<bool>(true);
  Accepting accepting_;
};

}  // namespace toftwin::daemon::o3d303
