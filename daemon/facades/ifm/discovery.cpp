// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/ifm/discovery.h"

#include <fmt/format.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>

#include "daemon/facades/local_place.h"

namespace toftwin::daemon::ifm {
namespace {

using boost::asio::ip::udp;
using boost::system::error_code;

constexpr std::uint32_t kSearchMagic = 0x1020'EFCF, kReplyMagic = 0x1911'1981;
constexpr std::size_t kSearchSize = 8, kHostName = 64, kDeviceName = 256;
constexpr std::uint16_t kVendor = 310;  // ifm's number at IO-Link; clients do not look at it

void appendBig(std::vector<std::byte>& bytes, std::uint64_t number, int count) {
  for (int shift = 8 * (count - 1); shift >= 0; shift -= 8)
    bytes.push_back(static_cast<std::byte>(number >> shift));
}

/// Padded with zeros, of which there is at least one.
void appendText(std::vector<std::byte>& bytes, const std::string& text, std::size_t size) {
  for (std::size_t i = 0; i < size; ++i) {
    bytes.push_back(i + 1 < size && i < text.size() ? static_cast<std::byte>(text[i]) : std::byte{0});
  }
}

/// It hears that interface alone; all where there is none of a name.
error_code keepTo(const std::string& interface, udp::socket& socket) {
  if (interface.empty() || ::setsockopt(socket.native_handle(), SOL_SOCKET, SO_BINDTODEVICE,
                                        interface.c_str(), static_cast<socklen_t>(interface.size())) == 0)
    return {};
  return {errno, boost::system::system_category()};
}

}  // namespace

std::vector<std::byte> encode(const Announcement& a) {
  std::vector<std::byte> bytes;
  appendBig(bytes, kReplyMagic, 4);
  for (const auto& part : {a.address, a.gateway, a.netmask}) {
    for (const std::uint8_t byte : part) bytes.push_back(std::byte{byte});
  }
  for (const std::uint16_t number : {a.port, kVendor, a.device, std::uint16_t{0}})
    appendBig(bytes, number, 2);
  appendBig(bytes, 0, 8);  // reserved
  for (const std::uint8_t byte : a.mac) bytes.push_back(std::byte{byte});
  appendBig(bytes, 0, 2);  // flags: in the right subnet, no DHCP, not temporary
  appendText(bytes, a.host_name, kHostName);
  appendText(bytes, a.device_name, kDeviceName);
  return bytes;
}

std::optional<std::uint16_t> readSearch(std::span<const std::byte> datagram) {
  if (datagram.size() < kSearchSize) return std::nullopt;
  std::uint32_t magic = 0;
  for (std::size_t i = 0; i < 4; ++i) magic = magic << 8 | std::to_integer<std::uint32_t>(datagram[i]);
  const unsigned port = std::to_integer<unsigned>(datagram[4]) << 8 | std::to_integer<unsigned>(datagram[5]);
  if (magic != kSearchMagic || port == 0) return std::nullopt;
  return static_cast<std::uint16_t>(port);
}

Result<std::unique_ptr<Discovery>> Discovery::listen(boost::asio::io_context& io, const std::string& address,
                                                     std::uint16_t port, Announcement announcement) {
  namespace ip = boost::asio::ip;
  error_code error;
  const auto own = ip::make_address_v4(address == "localhost" ? "127.0.0.1" : address, error);
  if (error) return Error{Error::Code::Unsupported, "searches are answered on IPv4 addresses only"};
  const LocalPlace place = placeOf(own);
  announcement.address = own.to_bytes();
  announcement.netmask = ip::address_v4{place.netmask}.to_bytes();
  std::unique_ptr<Discovery> discovery{new Discovery{encode(announcement)}};
  // A socket that is bound to an address hears no broadcasts; one that is bound to the broadcast address
  // does, of every interface unless it is bound to one.
  std::vector<ip::address_v4> addresses{own};
  if (!own.is_unspecified()) addresses.push_back(place.broadcast());
  if (!own.is_unspecified() && !own.is_loopback()) addresses.push_back(ip::address_v4::broadcast());
  for (const auto& one : addresses) {
    auto ear = std::make_shared<Ear>(io);
    ear->socket.open(udp::v4(), error);
    if (!error) ear->socket.set_option(udp::socket::reuse_address{true}, error);
    const bool is_of_one_interface = one == own || own.is_loopback();
    if (!error && !is_of_one_interface) error = keepTo(place.interface_name, ear->socket);
    if (!error) ear->socket.bind({one, port}, error);
    if (error) {
      return Error{Error::Code::Busy,
                   fmt::format("UDP port {} of {}: {}; choose another with discovery_port, or set "
                               "discoverable = false",
                               port, one.to_string(), error.message())};
    }
    discovery->ears_.push_back(ear);
  }
  for (const auto& ear : discovery->ears_) discovery->receive(ear);
  return discovery;
}

/// The answer goes to the address that asked, at the port that it names: 45 times the bytes of the question,
/// which is one reason more to listen beyond loopback only where all are trusted.
void Discovery::receive(const std::shared_ptr<Ear>& ear) {
  ear->socket.async_receive_from(boost::asio::buffer(ear->datagram), ear->from,
                                 [this, ear, alive = is_alive_](error_code error, std::size_t size) {
                                   if (!*alive || error == boost::asio::error::operation_aborted) return;
                                   const auto port = error ? std::nullopt
                                                           : readSearch(std::span{ear->datagram}.first(size));
                                   if (port && is_open_) {
                                     error_code ignored;
                                     ears_.front()->socket.send_to(boost::asio::buffer(reply_),
                                                                   {ear->from.address(), *port}, 0, ignored);
                                   }
                                   receive(ear);
                                 });
}

}  // namespace toftwin::daemon::ifm
