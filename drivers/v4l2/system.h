// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <poll.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

/// Video4Linux: cameras through the kernel's own interface.
namespace toftwin::drivers::v4l2 {

/// The few system calls that this driver makes. They are virtual so that tests can be the kernel:
/// its timeouts, errors and removals, which no emulation from outside of the process gives
/// (umockdev has no poll() for device nodes that can be mapped).
class System {
 public:
  virtual ~System() = default;

  /// Device files of video nodes, by number.
  virtual std::vector<std::string> nodes() = 0;
  /// An attribute of the USB device that a node belongs to ("idVendor", "serial"), empty if it has
  /// none.
  virtual std::string usbAttribute(const std::string& node, std::string_view name) = 0;

  // As the calls of that name, but an error is the negative errno, and they begin again after
  // EINTR.
  virtual int open(const std::string& node) = 0;
  virtual void close(int file) = 0;
  virtual int ioctl(int file, unsigned long request, void* argument) = 0;
  virtual int poll(std::span<pollfd> files, int timeout_ms) = 0;
  /// Empty if it cannot be mapped.
  virtual std::span<std::byte> map(int file, std::size_t length, std::int64_t offset) = 0;
  virtual void unmap(std::span<std::byte> bytes) = 0;
};

/// The kernel that we run on.
System& kernel();

}  // namespace toftwin::drivers::v4l2
