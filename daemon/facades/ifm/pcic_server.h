// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>  // before asio: Boost 1.74 uses std::exchange without it

#include <boost/asio/ip/tcp.hpp>

#include <list>
#include <memory>
#include <string_view>

#include "daemon/facades/accepting.h"
#include "daemon/facades/ifm/pcic_shared.h"
#include "daemon/facades/struck_frames.h"

namespace toftwin::daemon::ifm {

/// A camera's port for frames and commands. Every connection has a schema of its own; one that is slow
/// loses frames, one that stalls holds up nobody. Used on the facade's thread only.
class PcicServer {
 public:
  using Hooks = PcicHooks;
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
  bool publish(const FrameWriter& frame, const Damage& damage = {});
  void tellError(int code);
  void tellNotification(int code, std::string_view json);
  /// To every connection that wants what the maker's own people ask for.
  void tellAlgorithm(std::string_view content);
  /// Since the last such error, for the command "E?".
  [[nodiscard]] int lastError() const { return shared_.last_error; }

 private:
  void take(boost::asio::ip::tcp::socket socket);
  void tell(std::string_view ticket, unsigned output, std::string_view text);
  void remove(const std::shared_ptr<PcicConnection>& connection);
  [[nodiscard]] int freeNumber() const;

  PcicShared shared_;
  std::list<std::shared_ptr<PcicConnection>> connections_;  // shared with their handlers
  Accepting accepting_;
};

}  // namespace toftwin::daemon::ifm
