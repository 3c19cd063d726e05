// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include <toftwin/result.h>

#include "drivers/pace.h"
#include "drivers/v4l2/device.h"

namespace toftwin::drivers::v4l2 {

/// How a picture's memory is read.
enum class Memory {
  Mmap,   ///< the node's own mapping
  Dmabuf  ///< exported as DMA-BUF and mapped from there, with the caches told before and after
};

/// A node that streams into buffers of the kernel's. start() allocates and maps them, stop() gives
/// all back; both may be repeated.
class Stream {
 public:
  Stream(const Device& device, Layout layout, std::uint32_t buffers, Memory memory)
      : device_(&device), layout_(layout), wanted_(buffers), memory_(memory) {}
  Stream(Stream&& other) noexcept;
  Stream& operator=(Stream&&) = delete;
  ~Stream() { stop(); }

  Result<> start();
  void stop();

  /// A filled buffer, lent until it is given back.
  struct Picture {
    std::uint32_t index = 0;
    std::uint32_t sequence = 0;
    std::int64_t stamp_ns = 0;
    bool is_host_clock = false;  ///< the stamp is said to be of this host's monotonic clock
    std::string_view why_not_whole{};  ///< in words; empty: no error flag, and all bytes are there
    std::span<const std::byte> bytes;
    SteadyTime arrived;
  };
  /// Nothing if none is there; Disconnected if the camera is gone.
  Result<std::optional<Picture>> take();
  Result<> giveBack(const Picture& picture);

  [[nodiscard]] const Layout& layout() const { return layout_; }
  [[nodiscard]] const Device& device() const { return *device_; }

 private:
  struct Mapping {
    std::span<std::byte> bytes;
    int dmabuf = -1;
  };
  Result<Mapping> map(std::uint32_t index) const;
  void sync(const Mapping& mapping, std::uint64_t flags) const;
  Result<> queue(std::uint32_t index) const;

  const Device* device_;
  Layout layout_;
  std::uint32_t wanted_;
  Memory memory_;
  std::vector<Mapping> mappings_;
  bool is_allocated_ = false, is_on_ = false;
};

}  // namespace toftwin::drivers::v4l2
