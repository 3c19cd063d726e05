// SPDX-License-Identifier: Apache-2.0
#include "emulated_v4l2.h"

#include <linux/dma-buf.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <deque>
#include <optional>

namespace toftwin::drivers::v4l2::test {
namespace {

using Clock = std::chrono::steady_clock;

template <class Bytes>
void write(Bytes& field, const std::string& text) {
  std::memcpy(field, text.data(), std::min(text.size(), sizeof field - 1));
}

std::uint32_t bytesPerPixel(std::uint32_t fourcc) { return fourcc == V4L2_PIX_FMT_GREY ? 1 : 2; }

}  // namespace

struct EmulatedV4l2::Node {
  NodeOptions options;
  std::uint32_t fourcc = 0;
  std::vector<std::vector<std::byte>> buffers;
  std::deque<std::uint32_t> queue;
  bool is_on = false, hangs = false;
  Clock::time_point due{};
  std::uint32_t sequence = 0, first = 0, given = 0;
  int damaged = 0, shortened = 0;

  [[nodiscard]] std::uint32_t stride() const {
    return options.width * bytesPerPixel(fourcc) + options.row_padding;
  }
  [[nodiscard]] std::uint32_t images() const { return fourcc == V4L2_PIX_FMT_INZI ? 2 : 1; }
  [[nodiscard]] std::uint32_t size() const { return stride() * options.height * images(); }

  void draw(std::vector<std::byte>& buffer) const {
    std::ranges::fill(buffer, std::byte{0xEE});
    for (std::uint32_t y = 0; y < options.height * images(); ++y) {
      for (std::uint32_t x = 0; x < options.width; ++x) {
        const std::uint16_t code = codeAt(sequence, x, y);  // depth goes on where infrared ends
        std::byte* pixel = buffer.data() + y * stride() + x * bytesPerPixel(fourcc);
        const bool is_big = fourcc == V4L2_PIX_FMT_Y16_BE;
        pixel[0] = static_cast<std::byte>(is_big ? code >> 8 : code & 0xFF);
        if (bytesPerPixel(fourcc) == 2)
          pixel[1] = static_cast<std::byte>(is_big ? code & 0xFF : code >> 8);
      }
    }
  }
};

EmulatedV4l2::EmulatedV4l2(std::vector<NodeOptions> nodes) {
  for (NodeOptions& options : nodes) {
    auto node = std::make_unique<Node>();
    node->fourcc = options.formats.front();
    node->options = std::move(options);
    nodes_.push_back(std::move(node));
  }
}
EmulatedV4l2::~EmulatedV4l2() = default;

std::uint16_t EmulatedV4l2::codeAt(std::uint32_t sequence, std::uint32_t x, std::uint32_t y) {
  // Some pixels of every picture have no value.
  return static_cast<std::uint16_t>((x + y) % 7 == 0 ? 0 : 1000 + (x + 3 * y + sequence) % 500);
}

// ---- faults ------------------------------------------------------------------------------------

void EmulatedV4l2::lose(std::size_t node, std::uint32_t count) {
  const std::scoped_lock lock{mutex_};
  nodes_.at(node)->sequence += count;
}
void EmulatedV4l2::damage(std::size_t node, int count) {
  const std::scoped_lock lock{mutex_};
  nodes_.at(node)->damaged = count;
}
void EmulatedV4l2::shorten(std::size_t node, int count) {
  const std::scoped_lock lock{mutex_};
  nodes_.at(node)->shortened = count;
}
void EmulatedV4l2::hang(std::size_t node, bool hangs) {
  const std::scoped_lock lock{mutex_};
  nodes_.at(node)->hangs = hangs;
}
void EmulatedV4l2::setClock(std::size_t node, std::int64_t stamp_offset_us) {
  const std::scoped_lock lock{mutex_};
  nodes_.at(node)->options.stamp_offset_us = stamp_offset_us;
}
void EmulatedV4l2::beginAt(std::size_t node, std::uint32_t sequence) {
  const std::scoped_lock lock{mutex_};
  nodes_.at(node)->first = sequence;
}
void EmulatedV4l2::unplug() {
  const std::scoped_lock lock{mutex_};
  is_plugged_in_ = false;
  for (auto& node : nodes_) node->is_on = false;
}
void EmulatedV4l2::plugIn() {
  const std::scoped_lock lock{mutex_};
  is_plugged_in_ = true;
  for (auto& node : nodes_) node->buffers.clear();  // it is another device
}
void EmulatedV4l2::failWith(unsigned long request, int error) {
  const std::scoped_lock lock{mutex_};
  failing_[request] = error;
}
std::size_t EmulatedV4l2::heldByUser() {
  const std::scoped_lock lock{mutex_};
  return files_.size() + mappings_;
}
std::uint32_t EmulatedV4l2::given(std::size_t node) {
  const std::scoped_lock lock{mutex_};
  return nodes_.at(node)->given;
}

// ---- system calls ------------------------------------------------------------------------------

std::vector<std::string> EmulatedV4l2::nodes() {
  const std::scoped_lock lock{mutex_};
  std::vector<std::string> paths;
  for (const auto& node : nodes_) {
    if (is_plugged_in_) paths.push_back(node->options.path);
  }
  return paths;
}

std::string EmulatedV4l2::usbAttribute(const std::string& path, std::string_view name) {
  const std::scoped_lock lock{mutex_};
  for (const auto& node : nodes_) {
    if (node->options.path == path) return node->options.usb[std::string{name}];
  }
  return {};
}

int EmulatedV4l2::open(const std::string& path) {
  const std::scoped_lock lock{mutex_};
  if (const int error = failing_[0]; error != 0) return -error;
  for (const auto& node : nodes_) {
    if (node->options.path != path || !is_plugged_in_) continue;
    files_[next_file_] = {node.get()};
    return next_file_++;
  }
  return -ENOENT;
}

void EmulatedV4l2::close(int file) {
  const std::scoped_lock lock{mutex_};
  files_.erase(file);
}

std::span<std::byte> EmulatedV4l2::map(int file, std::size_t length, std::int64_t offset) {
  const std::scoped_lock lock{mutex_};
  const auto opened = files_.find(file);
  if (opened == files_.end()) return {};
  const auto& [node, exported] = opened->second;
  const auto index =
      exported >= 0 ? static_cast<std::size_t>(exported) : static_cast<std::size_t>(offset) / 4096;
  if (index >= node->buffers.size() || length != node->buffers[index].size()) return {};
  auto& buffer = node->buffers[index];
  ++mappings_;
  return buffer;
}

void EmulatedV4l2::unmap(std::span<std::byte>) {
  const std::scoped_lock lock{mutex_};
  --mappings_;
}

bool EmulatedV4l2::isReady(Node& node) {
  return node.is_on && !node.hangs && !node.queue.empty() && Clock::now() >= node.due;
}

int EmulatedV4l2::poll(std::span<pollfd> files, int timeout_ms) {
  const auto until = Clock::now() + std::chrono::milliseconds{timeout_ms};
  while (true) {
    int ready = 0;
    std::vector<pollfd> real;
    {
      const std::scoped_lock lock{mutex_};
      for (pollfd& one : files) {
        one.revents = 0;
        const auto file = files_.find(one.fd);
        if (file == files_.end()) {
          real.push_back(one);
          continue;
        }
        Node& node = *file->second.node;
        if (!is_plugged_in_ || !node.is_on) one.revents = POLLERR | POLLHUP;
        if (isReady(node)) one.revents = POLLIN;
        ready += one.revents != 0 ? 1 : 0;
      }
    }
    const bool is_last = ready > 0 || Clock::now() >= until;
    ready += ::poll(real.data(), real.size(), is_last ? 0 : 1);
    for (const pollfd& one : real) {
      for (pollfd& file : files) {
        if (file.fd == one.fd && one.fd >= 0) file.revents = one.revents;
      }
    }
    if (ready > 0 || is_last) return ready;
  }
}

int EmulatedV4l2::ioctl(int file, unsigned long request, void* argument) {
  const std::scoped_lock lock{mutex_};
  const auto found = files_.find(file);
  if (found == files_.end()) return -EBADF;
  if (const auto failing = failing_.find(request);
      failing != failing_.end() && failing->second != 0) {
    return -failing->second;
  }
  if (request == DMA_BUF_IOCTL_SYNC) return found->second.exported_buffer >= 0 ? 0 : -ENOTTY;
  if (!is_plugged_in_) return -ENODEV;
  return requestOf(*found->second.node, request, argument);
}

int EmulatedV4l2::requestOf(Node& node, unsigned long request, void* argument) {
  switch (request) {
    case VIDIOC_QUERYCAP:
    case VIDIOC_ENUM_FMT:
    case VIDIOC_ENUM_FRAMESIZES:
    case VIDIOC_ENUM_FRAMEINTERVALS:
    case VIDIOC_G_FMT:
    case VIDIOC_S_FMT:
    case VIDIOC_G_PARM:
    case VIDIOC_S_PARM:
      return enumerate(node, request, argument);
    case VIDIOC_QUERYCTRL:
    case VIDIOC_QUERYMENU:
    case VIDIOC_G_CTRL:
    case VIDIOC_S_CTRL:
      return controls(node, request, argument);
    default:
      return streaming(node, request, argument);
  }
}

int EmulatedV4l2::enumerate(Node& node, unsigned long request, void* argument) {
  const NodeOptions& options = node.options;
  if (request == VIDIOC_QUERYCAP) {
    auto& caps = *static_cast<v4l2_capability*>(argument);
    write(caps.driver, "emulated");
    write(caps.card, options.card);
    write(caps.bus_info, options.bus_info);
    caps.capabilities = options.caps | V4L2_CAP_DEVICE_CAPS;
    caps.device_caps = options.caps;
    return 0;
  }
  if (request == VIDIOC_ENUM_FMT) {
    auto& one = *static_cast<v4l2_fmtdesc*>(argument);
    if (one.index >= options.formats.size()) return -EINVAL;
    one.pixelformat = options.formats[one.index];
    return 0;
  }
  if (request == VIDIOC_ENUM_FRAMESIZES) {
    auto& one = *static_cast<v4l2_frmsizeenum*>(argument);
    if (one.index > 0) return -EINVAL;
    one.type = V4L2_FRMSIZE_TYPE_DISCRETE;
    one.discrete = {options.width, options.height};
    return 0;
  }
  const v4l2_fract interval{static_cast<std::uint32_t>(options.interval.count()), 1'000'000};
  if (request == VIDIOC_ENUM_FRAMEINTERVALS) {
    auto& one = *static_cast<v4l2_frmivalenum*>(argument);
    if (one.index > 0) return -EINVAL;
    one.type = V4L2_FRMIVAL_TYPE_DISCRETE;
    one.discrete = interval;
    return 0;
  }
  if (request == VIDIOC_G_PARM || request == VIDIOC_S_PARM) {
    auto& capture = static_cast<v4l2_streamparm*>(argument)->parm.capture;
    capture.capability = V4L2_CAP_TIMEPERFRAME;
    capture.timeperframe = interval;
    return 0;
  }
  auto& pix = static_cast<v4l2_format*>(argument)->fmt.pix;
  if (request == VIDIOC_S_FMT) {
    if (!node.buffers.empty()) return -EBUSY;
    const bool is_known =
        std::ranges::find(options.formats, pix.pixelformat) != options.formats.end();
    node.fourcc = is_known ? pix.pixelformat : options.formats.front();
  }
  pix.width = options.width;
  pix.height = options.height;
  pix.pixelformat = node.fourcc;
  pix.bytesperline = node.stride();
  pix.sizeimage = node.size();
  return 0;
}

int EmulatedV4l2::controls(Node& node, unsigned long request, void* argument) {
  auto& all = node.options.controls;
  const auto find = [&](std::uint32_t id) { return std::ranges::find(all, id, &Control::id); };
  if (request == VIDIOC_QUERYCTRL) {
    auto& one = *static_cast<v4l2_queryctrl*>(argument);
    const std::uint32_t id = one.id & ~V4L2_CTRL_FLAG_NEXT_CTRL;
    const auto found =
        id == one.id
            ? find(id)
            : std::ranges::find_if(all, [&](const Control& control) { return control.id > id; });
    if (found == all.end()) return -EINVAL;
    one = {};
    one.id = found->id;
    one.type = found->type;
    write(one.name, found->name);
    one.minimum = found->min;
    one.maximum = found->max;
    one.step = found->step;
    one.flags = found->flags;
    return 0;
  }
  if (request == VIDIOC_QUERYMENU) {
    const auto& one = *static_cast<v4l2_querymenu*>(argument);
    return one.index % 2 == 1 ? 0 : -EINVAL;  // choices 1, 3, 5, …
  }
  auto& value = *static_cast<v4l2_control*>(argument);
  const auto found = find(value.id);
  if (found == all.end()) return -EINVAL;
  if (request == VIDIOC_G_CTRL) {
    value.value = found->value;
    return 0;
  }
  if ((found->flags & V4L2_CTRL_FLAG_INACTIVE) != 0) return -EACCES;
  found->value = value.value;
  return 0;
}

int EmulatedV4l2::streaming(Node& node, unsigned long request, void* argument) {
  if (request == VIDIOC_STREAMON) {
    node.is_on = true;
    node.sequence = node.first;
    node.due = Clock::now() + node.options.interval;
    return 0;
  }
  if (request == VIDIOC_STREAMOFF) {
    node.is_on = false;
    node.queue.clear();
    return 0;
  }
  if (request == VIDIOC_REQBUFS) {
    auto& wish = *static_cast<v4l2_requestbuffers*>(argument);
    if (node.is_on || (wish.count > 0 && !node.buffers.empty())) return -EBUSY;
    node.buffers.assign(wish.count, std::vector<std::byte>(node.size()));
    node.queue.clear();
    return 0;
  }
  if (request == VIDIOC_EXPBUF) {
    auto& wish = *static_cast<v4l2_exportbuffer*>(argument);
    files_[next_file_] = {&node, static_cast<int>(wish.index)};
    wish.fd = next_file_++;
    return 0;
  }
  auto& buffer = *static_cast<v4l2_buffer*>(argument);
  if (request == VIDIOC_QUERYBUF || request == VIDIOC_QBUF) {
    if (buffer.index >= node.buffers.size()) return -EINVAL;
    buffer.length = node.size();
    buffer.m.offset = buffer.index * 4096;
    if (request == VIDIOC_QBUF) node.queue.push_back(buffer.index);
    return 0;
  }
  if (request != VIDIOC_DQBUF) return -ENOTTY;
  if (!node.is_on) return -EINVAL;
  if (!isReady(node)) return -EAGAIN;
  buffer.index = node.queue.front();
  node.queue.pop_front();
  node.draw(node.buffers[buffer.index]);
  const auto now =
      std::chrono::duration_cast<std::chrono::microseconds>(Clock::now().time_since_epoch());
  const std::int64_t stamp_us = now.count() + node.options.stamp_offset_us;
  buffer.timestamp.tv_sec = stamp_us / 1'000'000;
  buffer.timestamp.tv_usec = stamp_us % 1'000'000;
  buffer.flags = node.options.stamp_flag | (node.damaged-- > 0 ? V4L2_BUF_FLAG_ERROR : 0U);
  buffer.bytesused = node.size() - node.options.row_padding - (node.shortened-- > 0 ? 1U : 0U);
  buffer.sequence = node.sequence++;
  node.due = Clock::now() + node.options.interval;
  ++node.given;
  return 0;
}

}  // namespace toftwin::drivers::v4l2::test
