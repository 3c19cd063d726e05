// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <toftwin/result.h>

#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/udp.hpp>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <utility>  // before asio: Boost 1.74 uses std::exchange without it
#include <vector>

#include "daemon/facades/gige_vision/device.h"
#include "daemon/facades/local_place.h"

namespace toftwin::daemon::gige_vision {

inline constexpr std::uint16_t kControlPort = 3956;

/// One of this computer's, or localhost.
Result<LocalPlace> localPlace(const std::string& address);

/// Bound; with an `interface`, to what comes in there alone, and shared with others on that port.
Result<boost::asio::ip::udp::socket> udpSocket(boost::asio::io_context& io,
                                               boost::asio::ip::address_v4 address, std::uint16_t port,
                                               const std::string& interface = {});

/// Where commands come in: the facade's own address, and broadcasts, of which only searches are taken. Used
/// on the facade's thread only.
class ControlSockets {
 public:
  using Take = std::function<void(const Peer&, std::span<const std::byte>)>;
  static Result<std::unique_ptr<ControlSockets>> open(boost::asio::io_context& io, const LocalPlace& place,
                                                      Take take);
  ~ControlSockets() { *is_alive_ = false; }
  ControlSockets(const ControlSockets&) = delete;
  ControlSockets& operator=(const ControlSockets&) = delete;

  [[nodiscard]] bool hearsBroadcasts() const { return ears_.size() > 1; }
  /// Nothing where there is no answer.
  void send(const Peer& to, std::span<const std::byte> answer);

 private:
  struct Ear {
    explicit Ear(boost::asio::ip::udp::socket bound) : socket(std::move(bound)) {}
    boost::asio::ip::udp::socket socket;
    boost::asio::ip::udp::endpoint from;
    std::array<std::byte, 2048> datagram{};
    bool takes_all = false;
  };
  ControlSockets(const LocalPlace& place, Take take) : place_(place), take_(std::move(take)) {}
  void receive(const std::shared_ptr<Ear>& ear);
  void hear(const Ear& ear, std::size_t size);

  const LocalPlace place_;
  const Take take_;
  std::vector<std::shared_ptr<Ear>> ears_;  // shared with the handlers
  const std::shared_ptr<bool> is_alive_ = std::make_shared<bool>(true);
};

}  // namespace toftwin::daemon::gige_vision
