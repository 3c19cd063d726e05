// SPDX-License-Identifier: Apache-2.0
#include "drivers/openni2/library.h"

#include <fmt/format.h>

#include <cstring>
#include <mutex>

namespace toftwin::drivers::openni2 {
namespace {

std::mutex start_mutex;
bool is_started = false;

std::string_view textOf(OniStatus status) {
  switch (status) {
    case ONI_STATUS_NOT_IMPLEMENTED:
      return "not implemented";
    case ONI_STATUS_NOT_SUPPORTED:
      return "not supported";
    case ONI_STATUS_BAD_PARAMETER:
      return "bad parameter";
    case ONI_STATUS_OUT_OF_FLOW:
      return "not now";
    case ONI_STATUS_NO_DEVICE:
      return "no such device";
    case ONI_STATUS_TIME_OUT:
      return "timeout";
    default:
      return "error";
  }
}

}  // namespace

Result<Library> Library::acquire() {
  const std::lock_guard lock{start_mutex};
  if (!is_started) {
    if (const OniStatus status = oniInitialize(ONI_API_VERSION); status != ONI_STATUS_OK) {
      oniShutdown();
      return failure(
          "the library does not start; are its drivers installed (OpenNI2/Drivers beside "
          "libOpenNI2)?",
          status);
    }
  }
  is_started = true;
  return Library{};
}

std::vector<OniDeviceInfo> Library::devices() const {
  OniDeviceInfo* list = nullptr;
  int count = 0;
  if (oniGetDeviceList(&list, &count) != ONI_STATUS_OK) return {};
  std::vector<OniDeviceInfo> devices(list, list + count);
  oniReleaseDeviceList(list);
  return devices;
}

Error failure(std::string_view what, OniStatus status) {
  std::string said = oniGetExtendedError();
  const std::size_t begin = said.find_first_not_of(" \t\n"), end = said.find_last_not_of(" \t\n");
  said = begin == std::string::npos ? std::string{textOf(status)}
                                    : said.substr(begin, end - begin + 1);
  for (char& c : said) c = c == '\n' || c == '\t' ? ' ' : c;
  return {status == ONI_STATUS_NO_DEVICE ? Error::Code::NotFound : Error::Code::Disconnected,
          fmt::format("openni2: {}: {}", what, said)};
}

Watch::Watch(std::string uri) : uri_(std::move(uri)) {
  OniDeviceCallbacks callbacks{nullptr, disconnected, changed};
  oniRegisterDeviceCallbacks(&callbacks, this, &handle_);
}

Watch::~Watch() {
  if (handle_ != nullptr) oniUnregisterDeviceCallbacks(handle_);
}

void Watch::disconnected(const OniDeviceInfo* device, void* self) {
  auto& watch = *static_cast<Watch*>(self);
  if (watch.uri_ == device->uri) watch.is_lost_ = true;
}

void Watch::changed(const OniDeviceInfo* device, OniDeviceState state, void* self) {
  auto& watch = *static_cast<Watch*>(self);
  if (watch.uri_ != device->uri) return;
  if (state == ONI_DEVICE_STATE_EOF) watch.is_at_end_ = true;
  if (state == ONI_DEVICE_STATE_ERROR) watch.is_lost_ = true;
}

}  // namespace toftwin::drivers::openni2
