// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>  // before asio: Boost 1.74 uses std::exchange without it

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/udp.hpp>

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <toftwin/result.h>

namespace toftwin::daemon::ifm {

/// What the camera says of itself to the vendor's search.
struct Announcement {
  std::array<std::uint8_t, 4> address{}, gateway{}, netmask{};
  std::uint16_t port = 80;
  std::uint16_t device = 2;  ///< the second number of DeviceType: 2 of an O3D303
  std::array<std::uint8_t, 6> mac{};
  std::string host_name, device_name;
};
std::vector<std::byte> encode(const Announcement& announcement);
/// The port that a search wants its answer on. Nothing for whatever is no search.
std::optional<std::uint16_t> readSearch(std::span<const std::byte> datagram);

/// Answers searches at the address where the facade listens, and on its broadcast addresses. Used on the
/// facade's thread only.
class Discovery {
 public:
  /// At that address and by broadcasts of its interface; at 0.0.0.0, of all.
  static Result<std::unique_ptr<Discovery>> listen(boost::asio::io_context& io, const std::string& address,
                                                   std::uint16_t port, Announcement announcement);
  ~Discovery() { *is_alive_ = false; }
  Discovery(const Discovery&) = delete;
  Discovery& operator=(const Discovery&) = delete;
  void setOpen(bool is_open) { is_open_ = is_open; }

 private:
  struct Ear {
    explicit Ear(boost::asio::io_context& io) : socket(io) {}
    boost::asio::ip::udp::socket socket;
    boost::asio::ip::udp::endpoint from;
    std::array<std::byte, 64> datagram{};
  };
  explicit Discovery(std::vector<std::byte> reply) : reply_(std::move(reply)) {}
  void receive(const std::shared_ptr<Ear>& ear);

  const std::vector<std::byte> reply_;
  bool is_open_ = true;
  std::vector<std::shared_ptr<Ear>> ears_;  // shared with the handlers
  const std::shared_ptr<bool> is_alive_ = std::make_shared<bool>(true);
};

}  // namespace toftwin::daemon::ifm
