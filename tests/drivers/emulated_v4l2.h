// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <linux/videodev2.h>

#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "drivers/v4l2/system.h"

namespace toftwin::drivers::v4l2::test {

/// A kernel with video nodes that are not there. Pictures come in real time; everything that a
/// cable or a driver can do to them is done when asked. Members may be called from any thread.
class EmulatedV4l2 final : public System {
 public:
  struct Control {
    std::uint32_t id;
    const char* name;
    std::int32_t min, max, step, value;
    std::uint32_t flags = 0;
    std::uint32_t type = V4L2_CTRL_TYPE_INTEGER;
  };
  struct NodeOptions {
    std::string path = "/dev/video0";
    std::string card = "Emulated";
    std::string bus_info = "usb-emulated-1";
    std::uint32_t caps = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
    std::map<std::string, std::string> usb{};
    std::vector<std::uint32_t> formats{V4L2_PIX_FMT_Z16};
    std::uint32_t width = 16, height = 8;
    std::uint32_t row_padding = 0;  ///< bytes
    std::chrono::microseconds interval{5000};
    std::vector<Control> controls{};
    std::uint32_t stamp_flag = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
    std::int64_t stamp_offset_us = 0;  ///< of the node's clock against the monotonic one
  };

  explicit EmulatedV4l2(std::vector<NodeOptions> nodes);
  ~EmulatedV4l2() override;

  /// The code at a pixel of picture number `sequence`; 16 bits, of which a format takes what it
  /// holds.
  static std::uint16_t codeAt(std::uint32_t sequence, std::uint32_t x, std::uint32_t y);

  // What happens to the pictures of a node.
  void lose(std::size_t node, std::uint32_t count);
  void damage(std::size_t node, int count);
  void shorten(std::size_t node, int count);
  void hang(std::size_t node, bool hangs = true);
  void setClock(std::size_t node, std::int64_t stamp_offset_us);
  void beginAt(std::size_t node, std::uint32_t sequence);
  void unplug();
  void plugIn();
  /// Every such request fails from now on; 0: no more.
  void failWith(unsigned long request, int error);
  /// Open files, exported buffers and mappings, all together.
  std::size_t heldByUser();
  /// How many pictures were given to the user.
  std::uint32_t given(std::size_t node);

  std::vector<std::string> nodes() override;
  std::string usbAttribute(const std::string& node, std::string_view name) override;
  int open(const std::string& node) override;
  void close(int file) override;
  int ioctl(int file, unsigned long request, void* argument) override;
  int poll(std::span<pollfd> files, int timeout_ms) override;
  std::span<std::byte> map(int file, std::size_t length, std::int64_t offset) override;
  void unmap(std::span<std::byte> bytes) override;

 private:
  struct Node;
  struct File {
    Node* node;
    int exported_buffer = -1;
  };
  int requestOf(Node& node, unsigned long request, void* argument);
  int enumerate(Node& node, unsigned long request, void* argument);
  int streaming(Node& node, unsigned long request, void* argument);
  int controls(Node& node, unsigned long request, void* argument);
  static bool isReady(Node& node);

  std::mutex mutex_;
  std::vector<std::unique_ptr<Node>> nodes_;
  std::map<int, File> files_;
  std::map<unsigned long, int> failing_;
  std::size_t mappings_ = 0;
  int next_file_ = 100'000;  // no file of the process has such a number
  bool is_plugged_in_ = true;
};

}  // namespace toftwin::drivers::v4l2::test
