// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>  // before asio: Boost 1.74 uses std::exchange without it

#include <boost/asio/ip/tcp.hpp>

#include <chrono>
#include <memory>
#include <set>
#include <string>

#include "daemon/facades/accepting.h"
#include "daemon/facades/usb_camera/usb_device.h"

namespace toftwin::daemon::usb_camera {

/// USB/IP's connections, of which one at a time has the device. What each can make us hold is bounded, and
/// one that stalls or does not read costs nobody else. Used on the facade's thread only.
class Server {
 public:
  /// `name` of the facade, for the log. A host that has vanished without a word is found out within
  /// `patience`, and the device is free again.
  Server(Listening listening, std::string name,
         std::chrono::milliseconds patience = std::chrono::seconds{25});
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;
  [[nodiscard]] std::uint16_t port() const { return accepting_.port(); }

  /// The device that there is from now on, until it is unplugged.
  void plug(UsbDevice& device) { device_ = &device; }
  /// Pulls the cable: the host that has the device sees it go.
  void unplug();
  /// Whether a host has the device.
  [[nodiscard]] bool hasHost() const { return !host_.expired(); }
  /// To be called when the device may have something for its host.
  void pump();

 private:
  class Connection;
  void take(boost::asio::ip::tcp::socket socket);
  void remove(const std::shared_ptr<Connection>& connection);

  const std::string name_;
  const std::chrono::milliseconds patience_;
  UsbDevice* device_ = nullptr;
  std::set<std::shared_ptr<Connection>> connections_;  // shared with their handlers
  std::weak_ptr<Connection> host_;                     // that has the device
  const std::shared_ptr<bool> is_alive_ = std::make_shared<bool>(true);
  Accepting accepting_;
};

}  // namespace toftwin::daemon::usb_camera
