// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/gige_vision/control_sockets.h"

#include <fmt/format.h>
#include <sys/socket.h>

#include <cerrno>
#include <cstring>

#include "drivers/logging.h"

namespace toftwin::daemon::gige_vision {

using boost::asio::ip::address_v4;
using boost::asio::ip::udp;
using boost::system::error_code;

Result<LocalPlace> localPlace(const std::string& address) {
  error_code error;
  const auto own = boost::asio::ip::make_address_v4(address == "localhost" ? "127.0.0.1" : address, error);
  if (error || own.is_unspecified() || own.is_multicast()) {
    return Error{Error::Code::InvalidArgument,
                 fmt::format("address = \"{}\": a GigE Vision camera has one IPv4 address; name one of this "
                             "computer's",
                             address)};
  }
  return placeOf(own);
}

Result<udp::socket> udpSocket(boost::asio::io_context& io, address_v4 address, std::uint16_t port,
                              const std::string& interface) {
  udp::socket socket{io};
  error_code error;
  socket.open(udp::v4(), error);
  if (!error && !interface.empty()) {
    socket.set_option(udp::socket::reuse_address{true}, error);
    if (::setsockopt(socket.native_handle(), SOL_SOCKET, SO_BINDTODEVICE, interface.c_str(),
                     static_cast<socklen_t>(interface.size())) != 0) {
      return Error{Error::Code::Unsupported,
                   fmt::format("a socket cannot be bound to the interface {} alone: {}", interface,
                               std::strerror(errno))};
    }
  }
  if (!error) socket.bind({address, port}, error);
  if (!error) return socket;
  return Error{Error::Code::Busy,
               fmt::format("UDP port {} of {}: {}. GigE Vision has that port alone: give each camera another "
                           "address (127.0.0.2, or one more of an interface)",
                           port, address.to_string(), error.message())};
}

Result<std::unique_ptr<ControlSockets>> ControlSockets::open(boost::asio::io_context& io,
                                                             const LocalPlace& place, Take take) {
  auto own = udpSocket(io, place.address, kControlPort);
  if (!own) return own.error();
  std::unique_ptr<ControlSockets> sockets{new ControlSockets{place, std::move(take)}};
  sockets->ears_.push_back(std::make_shared<Ear>(*std::move(own)));
  sockets->ears_.front()->takes_all = true;
  // A socket that is bound to an address hears no broadcasts; one that is bound to the broadcast address
  // does, of every interface unless it is bound to one.
  if (place.interface_name.empty())
    logging::warn("gige_vision: it is not found by broadcasts: no interface has the address {}",
                  place.address.to_string());
  for (const address_v4& one : {place.broadcast(), address_v4::broadcast()}) {
    if (place.interface_name.empty()) break;
    auto ear = udpSocket(io, one, kControlPort, place.interface_name);
    if (ear) {
      sockets->ears_.push_back(std::make_shared<Ear>(*std::move(ear)));
    } else {
      logging::warn("gige_vision: it is not found by broadcasts to {}: {}", one.to_string(),
                    ear.error().message);
    }
  }
  for (const auto& ear : sockets->ears_) sockets->receive(ear);
  return sockets;
}

void ControlSockets::send(const Peer& to, std::span<const std::byte> answer) {
  if (answer.empty()) return;
  error_code ignored;  // who cannot be reached asks again
  ears_.front()->socket.send_to(boost::asio::buffer(answer.data(), answer.size()),
                                {address_v4{to.address}, to.port}, 0, ignored);
}

void ControlSockets::receive(const std::shared_ptr<Ear>& ear) {
  ear->socket.async_receive_from(boost::asio::buffer(ear->datagram), ear->from,
                                 [this, ear, alive = is_alive_](error_code error, std::size_t size) {
                                   if (!*alive || error == boost::asio::error::operation_aborted) return;
                                   try {
                                     if (!error) hear(*ear, size);
                                   } catch (...) {  // which the thread logs; it must not go deaf for that
                                     receive(ear);
                                     throw;
                                   }
                                   receive(ear);
                                 });
}

void ControlSockets::hear(const Ear& ear, std::size_t size) {
  const auto datagram = std::span{ear.datagram}.first(size);
  const address_v4 from = ear.from.address().to_v4();
  // Nobody but the address's own network, which loopback is one of, is told that there is a camera.
  const bool is_near = ((from.to_uint() ^ place_.address.to_uint()) & place_.netmask) == 0;
  if (place_.address.is_loopback() && !is_near) return;
  if (!ear.takes_all) {
    if (!is_near) return;
    const auto request = readRequest(datagram);
    if (!request || request->command != Command::kDiscovery) return;
  }
  take_({from.to_uint(), ear.from.port()}, datagram);
}

}  // namespace toftwin::daemon::gige_vision
