// SPDX-License-Identifier: Apache-2.0
#include "drivers/usb/watch.h"

#include <fmt/format.h>
#include <libusb.h>
#include <sys/time.h>

#include <algorithm>
#include <utility>

#include "drivers/usb/libusb_parts.h"

namespace toftwin::usb {
namespace {

Error failed(const char* doing, int error) {
  return {Error::Code::Internal,
          fmt::format("usb: {}: {}", doing, libusb_strerror(static_cast<libusb_error>(error)))};
}

/// By the first configuration, which libusb keeps: also of one that has left.
bool hasUsb3Vision(libusb_device* device) {
  libusb_config_descriptor* configuration = nullptr;
  if (libusb_get_config_descriptor(device, 0, &configuration) != 0) return false;
  const auto speaks = [](const libusb_interface& one) {
    return one.num_altsetting > 0 &&
           isUsb3Vision(one.altsetting[0].bInterfaceClass, one.altsetting[0].bInterfaceSubClass,
                        one.altsetting[0].bInterfaceProtocol);
  };
  const bool is =
      std::any_of(configuration->interface, configuration->interface + configuration->bNumInterfaces, speaks);
  libusb_free_config_descriptor(configuration);
  return is;
}

const KnownCamera* cameraOf(libusb_device* device) {
  libusb_device_descriptor about{};
  if (libusb_get_device_descriptor(device, &about) != 0) return nullptr;
  const KnownCamera* known = find(about.idVendor, about.idProduct);
  return known == nullptr && hasUsb3Vision(device) ? &usb3VisionCamera() : known;
}

Result<> resetDevice(libusb_device* device, const KnownCamera& camera, const std::string& port) {
  libusb_device_handle* handle = nullptr;
  if (const int error = libusb_open(device, &handle); error != 0) {
    if (error != LIBUSB_ERROR_ACCESS) return failed("opening it", error);
    return Error{Error::Code::PermissionDenied,
                 fmt::format("usb: {} at {} may not be opened by you; install the udev rules: "
                             "toftwin doctor says how",
                             camera.name, port)};
  }
  const int error = libusb_reset_device(handle);
  libusb_close(handle);
  if (error == LIBUSB_ERROR_NOT_FOUND || error == LIBUSB_ERROR_NO_DEVICE) {
    return Error{
        Error::Code::Disconnected,
        fmt::format("usb: {} at {} came back as another device, or not at all", camera.name, port)};
  }
  return error == 0 ? Result<>{} : failed("resetting it", error);
}

}  // namespace

struct Watch::State {
  Context context;
  Listener listener;
  libusb_hotplug_callback_handle handle = 0;
  bool is_registered = false;

  ~State() {
    if (is_registered) libusb_hotplug_deregister_callback(context.get(), handle);
  }
  /// Called within libusb_handle_events, on the thread that waits.
  static int LIBUSB_CALL onEvent(libusb_context*, libusb_device* device, libusb_hotplug_event event,
                                 void* user) {
    const KnownCamera* camera = cameraOf(device);
    if (camera == nullptr) return 0;
    static_cast<State*>(user)->pending.push_back(
        {.has_arrived = event == LIBUSB_HOTPLUG_EVENT_DEVICE_ARRIVED,
         .port = portOf(device),
         .camera = camera});
    return 0;
  }
  std::vector<Event> pending;  // told outside of libusb's calls, which a listener may want to make
};

bool hasLibusb() { return true; }
Watch::Watch(std::unique_ptr<State> state) : state_(std::move(state)) {}
Watch::~Watch() = default;

Result<std::unique_ptr<Watch>> Watch::begin(Listener listener) {
  auto state = std::make_unique<State>();
  state->listener = std::move(listener);
  if (state->context.error() != 0) return failed("starting libusb", state->context.error());
  if (libusb_has_capability(LIBUSB_CAP_HAS_HOTPLUG) == 0) {
    return Error{Error::Code::Unsupported,
                 "usb: this system's libusb does not tell what comes and goes"};
  }
  const int error = libusb_hotplug_register_callback(
      state->context.get(), LIBUSB_HOTPLUG_EVENT_DEVICE_ARRIVED | LIBUSB_HOTPLUG_EVENT_DEVICE_LEFT,
      LIBUSB_HOTPLUG_ENUMERATE, LIBUSB_HOTPLUG_MATCH_ANY, LIBUSB_HOTPLUG_MATCH_ANY,
      LIBUSB_HOTPLUG_MATCH_ANY, State::onEvent, state.get(), &state->handle);
  if (error != 0) return failed("watching the bus", error);
  state->is_registered = true;
  return std::unique_ptr<Watch>{new Watch{std::move(state)}};
}

Result<> Watch::wait(std::chrono::milliseconds timeout) {
  if (state_->pending.empty()) {
    timeval left{};
    left.tv_sec = static_cast<time_t>(timeout.count() / 1000);
    left.tv_usec = static_cast<suseconds_t>(timeout.count() % 1000 * 1000);
    const int error = libusb_handle_events_timeout_completed(state_->context.get(), &left, nullptr);
    if (error != 0 && error != LIBUSB_ERROR_INTERRUPTED) return failed("waiting", error);
  }
  for (const Event& event : std::exchange(state_->pending, {})) state_->listener(event);
  return {};
}

Result<> reset(const std::string& port) {
  const Context context;
  if (context.error() != 0) return failed("starting libusb", context.error());
  libusb_device** devices = nullptr;
  const ssize_t count = libusb_get_device_list(context.get(), &devices);
  if (count < 0) return failed("listing devices", static_cast<int>(count));
  Result<> done = Error{
      Error::Code::NotFound,
      fmt::format("usb: there is no camera that we know at {}; toftwin usb lists them", port)};
  for (ssize_t i = 0; i < count; ++i) {
    const KnownCamera* camera = cameraOf(devices[i]);
    if (camera == nullptr || portOf(devices[i]) != port) continue;
    done = resetDevice(devices[i], *camera, port);
    break;
  }
  libusb_free_device_list(devices, 1);
  return done;
}

}  // namespace toftwin::usb
