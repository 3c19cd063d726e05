// SPDX-License-Identifier: Apache-2.0
#include "drivers/aravis/connection.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <mutex>
#include <utility>

#include "drivers/aravis/discovery.h"
#include "drivers/usb/cameras.h"

namespace toftwin::drivers::aravis {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kAnswer{300};         // of one camera; a GigE camera answers within a few
constexpr milliseconds kDiscoveryWait{400};  // open() of an absent camera may take half a second
constexpr std::uint32_t kHasController = 0x3;

std::mutex library_mutex;

/// A USB3 Vision camera by what it calls itself, in ASCII, as the library asks for it.
struct UsbCamera {
  std::string maker, product, serial;
  [[nodiscard]] std::string name() const { return fmt::format("{}-{}-{}", maker, product, serial); }
};

/// Other characters than ASCII are question marks to libusb; the kernel says them in UTF-8.
std::string asciiOf(std::string_view text) {
  std::string ascii;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    const bool is_first = (byte & 0xC0U) != 0x80U;
    if (is_first) ascii.push_back(byte < 0x80U ? c : '?');
  }
  return ascii;
}

/// The library's own list knows no camera that came after it was first made, unless udev tells it: not in a
/// container.
std::vector<UsbCamera> usbCameras() {
  std::vector<UsbCamera> cameras;
  for (const usb::Device& one : usb::list()) {
    if (one.camera == &usb::usb3VisionCamera())
      cameras.push_back({asciiOf(one.maker), asciiOf(one.product), asciiOf(one.serial)});
  }
  return cameras;
}

/// The one that a user means by that. The library's tools have its GUID where we have its product's name.
std::optional<UsbCamera> usbCameraCalled(const std::string& called) {
  const auto cameras = usbCameras();
  const auto found = std::ranges::find_if(cameras, [&](const UsbCamera& one) {
    const bool is_name = called.starts_with(one.maker + "-") && called.ends_with("-" + one.serial);
    return called == "any" || called == one.serial || is_name;
  });
  if (found == cameras.end()) return std::nullopt;
  return *found;
}

Object<GInetAddress> inetAddress(std::uint32_t address) {
  return Object<GInetAddress>{g_inet_address_new_from_string(textOf(address).c_str())};
}

/// The port of a UDP socket that is bound to that address.
std::optional<std::uint16_t> portOf(int file, std::uint32_t address) {
  int type = 0;
  sockaddr_in own{};
  socklen_t size = sizeof own, type_size = sizeof type;
  const bool is_it = ::getsockopt(file, SOL_SOCKET, SO_TYPE, &type, &type_size) == 0 &&
                     type == SOCK_DGRAM &&
                     ::getsockname(file, reinterpret_cast<sockaddr*>(&own), &size) == 0 &&
                     own.sin_family == AF_INET && ntohl(own.sin_addr.s_addr) == address;
  if (!is_it) return std::nullopt;
  return ntohs(own.sin_port);
}

void noteLoss(ArvDevice*, std::atomic<bool>* is_lost) { *is_lost = true; }

}  // namespace

std::unique_lock<std::mutex> lockLibrary() { return std::unique_lock{library_mutex}; }

std::vector<std::string> listCameras() {
  std::vector<std::string> names;
  for (const GigeCamera& one : discover({.wait = kDiscoveryWait})) names.push_back(one.name());
  for (const UsbCamera& one : usbCameras()) names.push_back(one.name());
  std::ranges::sort(names);
  return names;
}

Connection::Connection(Object<ArvCamera> camera, std::optional<std::uint32_t> address)
    : camera_(std::move(camera)), address_(address) {
  lost_signal_ = g_signal_connect(device(), "control-lost", G_CALLBACK(noteLoss), is_lost_.get());
}

Connection::~Connection() {
  if (camera_ == nullptr) return;
  g_signal_handler_disconnect(device(), lost_signal_);
}

/// This process' UDP sockets that are bound to that address.
std::vector<Connection::ControlSocket> Connection::socketsOn(std::uint32_t address) {
  std::vector<ControlSocket> sockets;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator{"/proc/self/fd", error}) {
    const std::string text = entry.path().filename().string();
    int file = -1;
    std::from_chars(text.data(), text.data() + text.size(), file);
    if (const auto port = portOf(file, address)) sockets.push_back({file, *port});
  }
  return sockets;
}

Result<Connection> Connection::open(const std::string& name) {
  if (const auto address = addressOf(name)) return openGige(*address);
  const bool is_any = name == "any" || name.empty();
  // Looking takes no time, unlike waiting for answers from the network, and so it is done once more after
  // that.
  const auto onUsb = [&] { return usbCameraCalled(is_any ? "any" : name); };
  if (const auto usb = onUsb()) return openUsb(usb->maker, usb->product, usb->serial);
  std::vector<std::string> there;
  const auto is_it = [&](const GigeCamera& one) { return is_any || one.isCalled(name); };
  for (const GigeCamera& one :
       discover({.wait = kDiscoveryWait, .on_this_host = true, .enough = is_it})) {
    if (is_it(one)) return openGige(one.address);
    there.push_back(one.name());
  }
  if (const auto usb = onUsb()) return openUsb(usb->maker, usb->product, usb->serial);
  for (const UsbCamera& one : usbCameras()) there.push_back(one.name());
  std::string why =
      "none answers. Is it on, and in this computer's subnet? (toftwin doctor knows what keeps "
      "answers away)";
  if (!there.empty()) why = fmt::format("there is: {}", fmt::join(there, ", "));
  if (there.empty() && !seesInterfaces()) {
    why =
        "none is on USB, and this process may not see its network interfaces, so it cannot look for one "
        "there. "
        "Name its IP address, or allow AF_NETLINK (systemd: RestrictAddressFamilies)";
  }
  return Error{Error::Code::NotFound, fmt::format("there is no camera aravis:{}; {}", name, why)};
}

Result<Connection> Connection::openGige(std::uint32_t address) {
  const std::string name = textOf(address);
  const auto interface = interfaceTowards(address);
  if (!interface || !discoverAt(address, kAnswer)) {
    return Error{Error::Code::NotFound,
                 fmt::format("no camera answers at aravis:{}; is it on, and in this computer's "
                             "subnet? (toftwin doctor knows what keeps answers away)",
                             name)};
  }
  const auto lock = lockLibrary();
  const auto before = socketsOn(*interface);
  Failure failure;
  Object<ArvDevice> device{
      arv_gv_device_new(inetAddress(*interface).get(), inetAddress(address).get(), failure.slot())};
  if (failure || device == nullptr)
    return failure.toError(fmt::format("{} cannot be opened", name));
  if (arv_gv_device_is_controller(ARV_GV_DEVICE(device.get())) == FALSE) {
    return Error{Error::Code::Busy,
                 fmt::format("aravis: {} is controlled by another program, or was until a moment "
                             "ago: it waits for that one's heartbeat; close the other program",
                             name)};
  }
  auto since = socketsOn(*interface);
  std::erase_if(since, [&](const ControlSocket& one) {
    return std::ranges::find(before, one.port, &ControlSocket::port) != before.end();
  });
  Object<ArvCamera> camera{arv_camera_new_with_device(device.get(), failure.slot())};
  if (failure || camera == nullptr)
    return failure.toError(fmt::format("{} cannot be opened", name));
  Connection connection{std::move(camera), address};
  if (since.size() == 1) connection.control_ = since.front();
  connection.interface_ = *interface;
  return connection;
}

Result<Connection> Connection::openUsb(const std::string& maker, const std::string& product,
                                       const std::string& serial) {
  const auto lock = lockLibrary();
  const std::string what = fmt::format("{}-{}-{} cannot be opened", maker, product, serial);
  Failure failure;
  const Object<ArvDevice> device{
      arv_uv_device_new(maker.c_str(), product.c_str(), serial.c_str(), failure.slot())};
  if (failure || device == nullptr) {
    Error error = failure.toError(what);
    const bool is_busy = error.message.find("LIBUSB_ERROR_BUSY") != std::string::npos;
    if (is_busy) error.code = Error::Code::Busy;
    error.message +=
        is_busy ? "; another program has it, close that one" : "; may this user open it (udev rules)?";
    return error;
  }
  Object<ArvCamera> camera{arv_camera_new_with_device(device.get(), failure.slot())};
  if (failure || camera == nullptr) return failure.toError(what);
  return Connection{std::move(camera), std::nullopt};
}

Result<> Connection::check(milliseconds wait) {
  const auto gone = [this](std::string_view why) {
    return Error{Error::Code::Disconnected,
                 fmt::format("aravis: {}: {}", address_ ? textOf(*address_) : "the camera", why)};
  };
  if (isLost()) return gone("the control of the camera is lost");
  if (!address_) {
    Failure failure;
    std::uint32_t ignored = 0;
    arv_device_read_register(device(), 0, &ignored, failure.slot());
    if (failure && failure.toError("").code == Error::Code::Disconnected)
      return gone("it does not answer any more");
    return {};
  }
  const auto controller = readRegister(*address_, kControlPrivilege, wait);
  if (!controller) return gone("it does not answer any more");
  if ((*controller & kHasController) == 0)
    return gone("it has forgotten us: it was restarted, or the line was cut for too long");
  return {};
}

int Connection::socketOfPort(std::uint16_t port) const {
  for (const ControlSocket& one : socketsOn(interface_)) {
    if (one.port == port) return one.file;
  }
  return -1;
}

/// The library asks a camera that is gone five times, half a second each, whatever the question; a
/// closing asks twice. A socket that cannot send fails at once instead. Where the socket is not
/// known, closing takes a few seconds, and all is well otherwise.
void Connection::giveUp() {
  const auto control = std::exchange(control_, std::nullopt);
  if (control && portOf(control->file, interface_) == control->port)
    ::shutdown(control->file, SHUT_WR);
}

}  // namespace toftwin::drivers::aravis
