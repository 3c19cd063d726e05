// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include <toftwin/result.h>
#include <toftwin/units.h>

#include "drivers/v4l2/pixel_format.h"
#include "drivers/v4l2/system.h"

namespace toftwin::drivers::v4l2 {

/// What failed on a node, as an Error whose code tells the daemon what it can do: a camera that
/// went away is Disconnected, whichever of the kernel's words for it was used.
Error failure(const std::string& node, std::string_view what, int negative_errno);

/// An open video node; closes it.
class Device {
 public:
  static Result<Device> open(System& system, const std::string& node);
  Device(Device&& other) noexcept
      : system_(other.system_),
        node_(std::move(other.node_)),
        file_(std::exchange(other.file_, -1)) {}
  Device& operator=(Device&&) = delete;
  ~Device() {
    if (file_ >= 0) system_->close(file_);
  }

  /// 0, or a negative errno.
  int control(unsigned long request, void* argument) const {
    return system_->ioctl(file_, request, argument);
  }
  [[nodiscard]] System& system() const { return *system_; }
  [[nodiscard]] int file() const { return file_; }
  [[nodiscard]] const std::string& node() const { return node_; }

 private:
  Device(System& system, std::string node, int file)
      : system_(&system), node_(std::move(node)), file_(file) {}
  System* system_;
  std::string node_;
  int file_;
};

/// A node that gives pictures, and which camera it belongs to.
struct Node {
  std::string path;      ///< "/dev/video0"
  std::string driver;    ///< of the kernel: "uvcvideo"
  std::string card;      ///< the camera's name
  std::string bus_info;  ///< where it is plugged in; the same for all nodes of a camera
  std::string usb_ids;   ///< "1d27:0601", or empty
  std::string serial;    ///< of USB, or empty
  std::vector<std::uint32_t> formats;

  [[nodiscard]] bool offersDepth() const;
};

/// The capture nodes that can be asked; `denied` gets those that exist but may not be opened.
std::vector<Node> captureNodes(System& system, std::vector<Error>* denied = nullptr);

/// A picture's format as the node was set to.
struct Layout {
  PixelFormat format{};
  int width = 0, height = 0;
  std::size_t stride = 0;
};
struct Size {
  int width = 0, height = 0;
  bool operator==(const Size&) const = default;
};
/// Sizes that the node offers of a format; of a range, its least and its largest.
std::vector<Size> sizesOf(const Device& device, std::uint32_t fourcc);
/// Frame rates that the node offers at that size, as text for errors ("30, 15").
std::string frameRatesOf(const Device& device, std::uint32_t fourcc, Size size);

/// Sets format and size (0 x 0: as it is set, or the first it offers) and reads back what came of
/// it.
Result<Layout> setLayout(const Device& device, const PixelFormat& format, Size wanted);
/// Sets the frame rate (0: as it is set) and gives the frame interval, 0 where the node has none.
Result<Duration> setFrameRate(const Device& device, const Layout& layout, Frequency wanted);

}  // namespace toftwin::drivers::v4l2
