// SPDX-License-Identifier: Apache-2.0
// The cable, by libusb. Interfaces, endpoints and the order of requests as in libfreenect2's usb_control.h
// and usb_control.cpp.
#include <fmt/format.h>
#include <libusb.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <stop_token>
#include <string_view>
#include <thread>
#include <utility>

#include "drivers/kinect2/kinect2.h"
#include "drivers/kinect2/link.h"
#include "drivers/logging.h"
#include "drivers/usb/cameras.h"
#include "drivers/usb/libusb_parts.h"

namespace toftwin::drivers::kinect2 {
namespace {

using Clock = std::chrono::steady_clock;
using usb::Context;

constexpr int kConfiguration = 1, kControlInterface = 0, kStreamInterface = 1;
constexpr unsigned char kCommandEndpoint = 0x02, kAnswerEndpoint = 0x81, kStreamEndpoint = 0x84;
constexpr int kLeastPacketBytes = 33'792;  ///< 11 × 3 of 1024, in each 125 µs
constexpr int kPacketsPerTransfer = 8;
constexpr unsigned kTimeout_ms = 1000;
constexpr std::chrono::milliseconds kBackWithin{1000}, kLookAgain{50};
// Requests and features of USB 3 that libusb has no names for [USB 3.1, tables 9-4 and 9-6].
constexpr std::uint8_t kSetIsochronousDelay = 0x31;
constexpr std::uint16_t kFunctionSuspend = 0, kU1Enable = 48, kU2Enable = 49, kHostDelay_ns = 40;
/// Low power, and allowed to wake the host up.
constexpr std::uint16_t kSuspended = 3U << 8U;

Error failed(std::string_view doing, int error) {
  using enum Error::Code;
  const Error::Code code = error == LIBUSB_ERROR_ACCESS    ? PermissionDenied
                           : error == LIBUSB_ERROR_BUSY    ? Busy
                           : error == LIBUSB_ERROR_TIMEOUT ? Timeout
                                                           : Disconnected;
  std::string text = fmt::format("kinect2: {}: {}", doing, libusb_strerror(static_cast<libusb_error>(error)));
  if (code == PermissionDenied) text += "; install the udev rules: toftwin doctor says how";
  if (code == Busy) text += "; another program has it";
  return {code, text};
}

struct Closer {
  void operator()(libusb_device_handle* handle) const { libusb_close(handle); }
  void operator()(libusb_transfer* transfer) const { libusb_free_transfer(transfer); }
};
using Handle = std::unique_ptr<libusb_device_handle, Closer>;

/// Before 1.0.27, libusb_set_interface_alt_setting of a device that is gone leaves its handle locked, and
/// closing that fails an assertion [libusb, issue 1199].
bool leavesHandlesLocked() {
  const libusb_version* version = libusb_get_version();
  return version->major == 1 && version->minor == 0 && version->micro < 27;
}

Result<Handle> openAt(libusb_context* context, const std::string& port) {
  libusb_device** devices = nullptr;
  const ssize_t count = libusb_get_device_list(context, &devices);
  if (count < 0) return failed("listing the USB devices", static_cast<int>(count));
  Result<Handle> opened =
      Error{Error::Code::NotFound, fmt::format("kinect2: there is no device at port {} any more", port)};
  for (ssize_t i = 0; i < count; ++i) {
    libusb_device_descriptor about{};
    if (usb::portOf(devices[i]) != port || libusb_get_device_descriptor(devices[i], &about) != 0) continue;
    const usb::KnownCamera* camera = usb::find(about.idVendor, about.idProduct);
    if (camera == nullptr || camera->driver != About::name) continue;
    libusb_device_handle* handle = nullptr;
    const int error = libusb_open(devices[i], &handle);
    opened = error == 0 ? Result<Handle>{Handle{handle}} : Result<Handle>{failed("opening " + port, error)};
    break;
  }
  libusb_free_device_list(devices, 1);
  return opened;
}

/// Bytes that the stream's endpoint gives in each 125 µs; 0 where it is not on USB 3.
int packetBytes(libusb_context* context, libusb_device_handle* handle) {
  libusb_config_descriptor* configuration = nullptr;
  if (libusb_get_config_descriptor_by_value(libusb_get_device(handle), kConfiguration, &configuration) != 0)
    return 0;
  int bytes = 0;
  for (int i = 0; i < configuration->bNumInterfaces; ++i) {
    const libusb_interface& one = configuration->interface[i];
    for (int a = 0; a < one.num_altsetting; ++a) {
      for (int e = 0; e < one.altsetting[a].bNumEndpoints; ++e) {
        const libusb_endpoint_descriptor& endpoint = one.altsetting[a].endpoint[e];
        libusb_ss_endpoint_companion_descriptor* companion = nullptr;
        if (endpoint.bEndpointAddress != kStreamEndpoint ||
            libusb_get_ss_endpoint_companion_descriptor(context, &endpoint, &companion) != 0) {
          continue;
        }
        bytes = std::max<int>(bytes, companion->wBytesPerInterval);
        libusb_free_ss_endpoint_companion_descriptor(companion);
      }
    }
  }
  libusb_free_config_descriptor(configuration);
  return bytes;
}

class UsbLink final : public Link {
 public:
  static Result<std::unique_ptr<Link>> open(const std::string& port, bool reset);
  UsbLink() : context_(std::make_unique<Context>()) {}
  UsbLink(const UsbLink&) = delete;
  UsbLink& operator=(const UsbLink&) = delete;
  ~UsbLink() override;

  Result<> send(std::span<const std::byte> bytes) override {
    // libusb does not write to what it sends.
    auto* data = const_cast<unsigned char*>(reinterpret_cast<const unsigned char*>(bytes.data()));
    const auto size = static_cast<int>(bytes.size());
    int sent = 0;
    const int error = libusb_bulk_transfer(handle_.get(), kCommandEndpoint, data, size, &sent, kTimeout_ms);
    if (error != 0) return failed("sending a command", error);
    if (sent == size) return {};
    return Error{Error::Code::Disconnected, "kinect2: the camera took only a part of a command"};
  }

  Result<Bytes> receive(std::size_t most) override {
    Bytes bytes(most);
    int got = 0;
    const int error =
        libusb_bulk_transfer(handle_.get(), kAnswerEndpoint, reinterpret_cast<unsigned char*>(bytes.data()),
                             static_cast<int>(most), &got, kTimeout_ms);
    if (error != 0) return failed("waiting for an answer", error);
    bytes.resize(static_cast<std::size_t>(got));
    return bytes;
  }

  Result<> suspend(bool is_suspended) override {
    return request(LIBUSB_RECIPIENT_INTERFACE, LIBUSB_REQUEST_SET_FEATURE, kFunctionSuspend,
                   static_cast<std::uint16_t>((is_suspended ? kSuspended : 0U) | kControlInterface),
                   is_suspended ? "suspending it" : "waking it up");
  }

  Result<> enableStream(bool on) override {
    if (is_lost_) return failed("changing the stream's setting", LIBUSB_ERROR_NO_DEVICE);
    const int error = libusb_set_interface_alt_setting(handle_.get(), kStreamInterface, on ? 1 : 0);
    is_locked_ = is_locked_ || (error == LIBUSB_ERROR_NO_DEVICE && leavesHandlesLocked());
    return error == 0 ? Result<>{} : failed(on ? "enabling the stream" : "disabling the stream", error);
  }

  Result<> startPackets(PacketSink& sink, int transfers) override;
  void stopPackets() override;

 private:
  struct Transfer {
    std::unique_ptr<libusb_transfer, Closer> transfer;
    std::vector<unsigned char> buffer;
  };
  Result<> prepare();
  Result<> request(int recipient, std::uint8_t what, std::uint16_t value, std::uint16_t index,
                   std::string_view doing) {
    const int error = libusb_control_transfer(handle_.get(), static_cast<std::uint8_t>(recipient), what,
                                              value, index, nullptr, 0, kTimeout_ms);
    return error < 0 ? failed(doing, error) : Result<>{};
  }
  static void LIBUSB_CALL onDone(libusb_transfer* transfer);
  void done(libusb_transfer& transfer);
  void hand(const libusb_transfer& transfer);

  // In the order of need; the context goes last.
  std::unique_ptr<Context> context_;
  Handle handle_;
  bool is_locked_ = false;  ///< by libusb, which would abort when the handle is closed
  int packet_bytes_ = 0;
  PacketSink* sink_ = nullptr;
  std::vector<Transfer> transfers_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::size_t in_flight_ = 0;
  bool is_stopping_ = false;
  std::atomic<bool> is_lost_{false};
  std::jthread events_;
};

/// A handle that libusb keeps locked is never closed: that costs some memory, where closing it would cost the
/// daemon. It happens only if the camera is unplugged at the moment in which its stream is enabled.
UsbLink::~UsbLink() {
  stopPackets();
  if (!is_locked_) return;
  static_cast<void>(handle_.release());
  static_cast<void>(context_.release());
}

Result<std::unique_ptr<Link>> UsbLink::open(const std::string& port, bool reset) {
  auto link = std::make_unique<UsbLink>();
  if (link->context_->error() != 0) return failed("starting libusb", link->context_->error());
  auto handle = openAt(link->context_->get(), port);
  if (!handle) return handle.error();
  link->handle_ = *std::move(handle);
  if (reset) {
    const int error = libusb_reset_device(link->handle_.get());
    if (error == LIBUSB_ERROR_NOT_FOUND) {
      // It is a new device to the system, and will be there in a moment.
      link->handle_.reset();
      const auto until = Clock::now() + kBackWithin;
      do {
        std::this_thread::sleep_for(kLookAgain);
        handle = openAt(link->context_->get(), port);
      } while (!handle && Clock::now() < until);
      if (!handle) return handle.error();
      link->handle_ = *std::move(handle);
    } else if (error != 0) {
      return failed("resetting it", error);
    }
  }
  if (auto prepared = link->prepare(); !prepared) return prepared.error();
  return std::unique_ptr<Link>{std::move(link)};
}

Result<> UsbLink::prepare() {
  int configuration = 0;
  if (const int error = libusb_get_configuration(handle_.get(), &configuration); error != 0) {
    return failed("asking for its configuration", error);
  }
  if (configuration != kConfiguration) {
    const int error = libusb_set_configuration(handle_.get(), kConfiguration);
    if (error != 0) return failed("setting its configuration", error);
  }
  for (const int interface : {kControlInterface, kStreamInterface}) {
    const int error = libusb_claim_interface(handle_.get(), interface);
    if (error != 0) return failed("claiming it", error);
  }
  packet_bytes_ = packetBytes(context_->get(), handle_.get());
  if (packet_bytes_ < kLeastPacketBytes) {
    return Error{
        Error::Code::Incompatible,
        fmt::format(
            "kinect2: the camera gives {} bytes in 125 us, and {} are needed: it is not on USB 3. Use a "
            "blue or SS port, without a hub in between",
            packet_bytes_, kLeastPacketBytes)};
  }
  if (auto disabled = enableStream(false); !disabled) return disabled;
  // To save power, and to be on time; a camera or a host that cannot streams all the same.
  for (const auto& [what, value] : {std::pair{kSetIsochronousDelay, kHostDelay_ns},
                                    std::pair{std::uint8_t{LIBUSB_REQUEST_SET_FEATURE}, kU1Enable},
                                    std::pair{std::uint8_t{LIBUSB_REQUEST_SET_FEATURE}, kU2Enable}}) {
    if (auto done = request(LIBUSB_RECIPIENT_DEVICE, what, value, 0, "telling it of the host"); !done) {
      logging::debug("{}", done.error().message);
    }
  }
  return {};
}

Result<> UsbLink::startPackets(PacketSink& sink, int transfers) {
  stopPackets();
  sink_ = &sink;
  is_stopping_ = false;
  is_lost_ = false;
  const auto size = static_cast<std::size_t>(kPacketsPerTransfer * packet_bytes_);
  int error = 0;
  for (int i = 0; i < transfers && error == 0; ++i) {
    Transfer one{std::unique_ptr<libusb_transfer, Closer>{libusb_alloc_transfer(kPacketsPerTransfer)},
                 std::vector<unsigned char>(size)};
    if (!one.transfer) {
      error = LIBUSB_ERROR_NO_MEM;
      break;
    }
    libusb_fill_iso_transfer(one.transfer.get(), handle_.get(), kStreamEndpoint, one.buffer.data(),
                             static_cast<int>(size), kPacketsPerTransfer, onDone, this, 0);
    libusb_set_iso_packet_lengths(one.transfer.get(), static_cast<unsigned>(packet_bytes_));
    const std::scoped_lock lock{mutex_};
    error = libusb_submit_transfer(one.transfer.get());
    if (error != 0) break;
    ++in_flight_;
    transfers_.push_back(std::move(one));
  }
  events_ = std::jthread{[this](const std::stop_token& stop) {
    timeval most{.tv_sec = 0, .tv_usec = 100'000};
    while (!stop.stop_requested()) libusb_handle_events_timeout_completed(context_->get(), &most, nullptr);
  }};
  if (error == 0) return {};
  Error why = failed(fmt::format("giving it transfer {} of {}", transfers_.size() + 1, transfers), error);
  stopPackets();
  why.message +=
      "; if the kernel has too little memory for USB (16 MB by default), set transfers to less or run: echo "
      "64 > /sys/module/usbcore/parameters/usbfs_memory_mb";
  return why;
}

void UsbLink::stopPackets() {
  if (!events_.joinable()) return;
  {
    std::unique_lock lock{mutex_};
    is_stopping_ = true;
  }
  for (const Transfer& one : transfers_) libusb_cancel_transfer(one.transfer.get());
  {
    std::unique_lock lock{mutex_};
    changed_.wait(lock, [this] { return in_flight_ == 0; });
  }
  events_.request_stop();
  libusb_interrupt_event_handler(context_->get());
  events_ = {};
  transfers_.clear();
  sink_ = nullptr;
}

void UsbLink::onDone(libusb_transfer* transfer) {
  static_cast<UsbLink*>(transfer->user_data)->done(*transfer);
}

void UsbLink::done(libusb_transfer& transfer) {
  bool is_stopping = false;
  {
    const std::scoped_lock lock{mutex_};
    is_stopping = is_stopping_;
  }
  if (!is_stopping) hand(transfer);
  const std::scoped_lock lock{mutex_};
  int error = LIBUSB_ERROR_NO_DEVICE;
  const bool is_gone = transfer.status == LIBUSB_TRANSFER_NO_DEVICE;
  if (!is_stopping_ && !is_gone) error = libusb_submit_transfer(&transfer);
  if (!is_stopping_ && !is_gone && error == 0) return;
  if ((is_gone || !is_stopping_) && !is_lost_.exchange(true) && !is_stopping_) {
    sink_->lost(is_gone ? Error{Error::Code::Disconnected, "kinect2: the camera was unplugged"}
                        : failed("asking for more of the stream", error));
  }
  --in_flight_;
  changed_.notify_all();
}

void UsbLink::hand(const libusb_transfer& transfer) {
  const unsigned char* at = transfer.buffer;
  for (int i = 0; i < transfer.num_iso_packets; ++i) {
    const libusb_iso_packet_descriptor& packet = transfer.iso_packet_desc[i];
    if (transfer.status == LIBUSB_TRANSFER_COMPLETED && packet.status == LIBUSB_TRANSFER_COMPLETED) {
      sink_->packet(std::as_bytes(std::span{at, packet.actual_length}));
    } else {
      sink_->missed();
    }
    at += packet.length;
  }
}

class UsbBus final : public Bus {
 public:
  std::vector<Found> cameras() override {
    std::vector<Found> all;
    for (const usb::Device& device : usb::list()) {
      if (device.camera->driver != About::name) continue;
      all.push_back({.name = std::string{device.camera->name},
                     .serial = device.serial,
                     .port = device.port,
                     .warning = usb::warningOf(device)});
    }
    return all;
  }
  Result<std::unique_ptr<Link>> open(const Found& camera, bool reset) override {
    return UsbLink::open(camera.port, reset);
  }
};

}  // namespace

Bus& usbBus() {
  static UsbBus bus;
  return bus;
}

}  // namespace toftwin::drivers::kinect2
