// SPDX-License-Identifier: Apache-2.0
#include "drivers/v4l2/stream.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/dma-buf.h>
#include <linux/videodev2.h>

#include <algorithm>
#include <cerrno>
#include <utility>

namespace toftwin::drivers::v4l2 {
namespace {

constexpr std::uint32_t kCapture = V4L2_BUF_TYPE_VIDEO_CAPTURE;
constexpr std::uint32_t kFewestBuffers = 2;  // one is filled while the other is read
constexpr std::string_view kDamaged = "its data came damaged, says the kernel", kShort = "bytes of it did not come";

v4l2_buffer bufferAt(std::uint32_t index) {
  v4l2_buffer buffer{};
  buffer.type = kCapture;
  buffer.memory = V4L2_MEMORY_MMAP;
  buffer.index = index;
  return buffer;
}

/// Within ±126 years, so that no difference of two stamps overflows, whatever the driver says.
std::int64_t nanosecondsOf(const v4l2_buffer& buffer) {
  constexpr std::int64_t kPerSecond = 1'000'000'000, kPerMicrosecond = 1000;
  constexpr std::int64_t kMost_s = 4'000'000'000, kMost_us = 1'000'000;
  return std::clamp<std::int64_t>(buffer.timestamp.tv_sec, -kMost_s, kMost_s) * kPerSecond +
         std::clamp<std::int64_t>(buffer.timestamp.tv_usec, 0, kMost_us) * kPerMicrosecond;
}

int request(const Device& device, std::uint32_t& count) {
  v4l2_requestbuffers wish{};
  wish.count = count;
  wish.type = kCapture;
  wish.memory = V4L2_MEMORY_MMAP;
  const int error = device.control(VIDIOC_REQBUFS, &wish);
  count = wish.count;
  return error;
}

}  // namespace

Stream::Stream(Stream&& other) noexcept
    : device_(other.device_),
      layout_(other.layout_),
      wanted_(other.wanted_),
      memory_(other.memory_),
      mappings_(std::move(other.mappings_)),
      is_allocated_(std::exchange(other.is_allocated_, false)),
      is_on_(std::exchange(other.is_on_, false)) {
  other.mappings_.clear();
}

Result<> Stream::start() {
  stop();
  std::uint32_t count = wanted_;
  if (const int error = request(*device_, count); error != 0) {
    return failure(device_->node(), "gives no buffers", error);
  }
  is_allocated_ = true;
  if (count < kFewestBuffers) {
    return Error{
        Error::Code::Busy,
        fmt::format("v4l2: {}: the kernel has memory for {} buffers only", device_->node(), count)};
  }
  for (std::uint32_t i = 0; i < count; ++i) {
    auto mapping = map(i);
    if (!mapping) return mapping.error();
    mappings_.push_back(*mapping);
    if (auto queued = queue(i); !queued) return queued;
  }
  std::uint32_t type = kCapture;
  if (const int error = device_->control(VIDIOC_STREAMON, &type); error != 0) {
    return failure(device_->node(), "does not begin to stream", error);
  }
  is_on_ = true;
  return {};
}

void Stream::stop() {
  // All may fail when the camera is gone; what is ours is given back all the same.
  std::uint32_t type = kCapture;
  if (std::exchange(is_on_, false)) device_->control(VIDIOC_STREAMOFF, &type);
  for (const Mapping& mapping : mappings_) {
    if (!mapping.bytes.empty()) device_->system().unmap(mapping.bytes);
    if (mapping.dmabuf >= 0) device_->system().close(mapping.dmabuf);
  }
  mappings_.clear();
  std::uint32_t none = 0;
  if (std::exchange(is_allocated_, false)) request(*device_, none);
}

Result<Stream::Mapping> Stream::map(std::uint32_t index) const {
  v4l2_buffer buffer = bufferAt(index);
  if (const int error = device_->control(VIDIOC_QUERYBUF, &buffer); error != 0) {
    return failure(device_->node(), "does not describe its buffers", error);
  }
  System& system = device_->system();
  Mapping mapping;
  if (memory_ == Memory::Dmabuf) {
    v4l2_exportbuffer wish{};
    wish.type = kCapture;
    wish.index = index;
    wish.flags = O_RDWR | O_CLOEXEC;
    if (const int error = device_->control(VIDIOC_EXPBUF, &wish); error != 0) {
      Error said = failure(device_->node(), "exports no DMA-BUF; choose memory = \"mmap\"", error);
      said.code = Error::Code::Unsupported;
      return said;
    }
    mapping.dmabuf = wish.fd;
    mapping.bytes = system.map(mapping.dmabuf, buffer.length, 0);
  } else {
    mapping.bytes = system.map(device_->file(), buffer.length, buffer.m.offset);
  }
  if (mapping.bytes.empty()) {
    if (mapping.dmabuf >= 0) system.close(mapping.dmabuf);
    return Error{
        Error::Code::Internal,
        fmt::format("v4l2: {}: a buffer of {} bytes cannot be mapped; is there memory left?",
                    device_->node(), buffer.length)};
  }
  return mapping;
}

Result<> Stream::queue(std::uint32_t index) const {
  v4l2_buffer buffer = bufferAt(index);
  if (const int error = device_->control(VIDIOC_QBUF, &buffer); error != 0) {
    return failure(device_->node(), "does not take a buffer back", error);
  }
  return {};
}

void Stream::sync(const Mapping& mapping, std::uint64_t flags) const {
  if (mapping.dmabuf < 0) return;
  dma_buf_sync what{flags | DMA_BUF_SYNC_READ};
  device_->system().ioctl(mapping.dmabuf, DMA_BUF_IOCTL_SYNC, &what);
}

Result<std::optional<Stream::Picture>> Stream::take() {
  v4l2_buffer buffer = bufferAt(0);
  const int error = device_->control(VIDIOC_DQBUF, &buffer);
  if (error == -EAGAIN) return std::optional<Picture>{};
  // What uvcvideo says of a camera that was pulled out varies: ENODEV, EIO, EINVAL.
  if (error != 0) {
    return Error{Error::Code::Disconnected,
                 failure(device_->node(), "gives no picture", error).message};
  }
  if (buffer.index >= mappings_.size()) {
    return Error{Error::Code::Internal,
                 fmt::format("v4l2: {} gave a buffer that we do not have", device_->node())};
  }
  const Mapping& mapping = mappings_[buffer.index];
  sync(mapping, DMA_BUF_SYNC_START);
  const std::size_t used = std::min<std::size_t>(buffer.bytesused, mapping.bytes.size());
  const std::size_t least =
      leastSize(layout_.format, layout_.width, layout_.height, layout_.stride);
  return std::optional{Picture{
      .index = buffer.index,
      .sequence = buffer.sequence,
      .stamp_ns = nanosecondsOf(buffer),
      .is_host_clock =
          (buffer.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC,
      .why_not_whole = (buffer.flags & V4L2_BUF_FLAG_ERROR) != 0 ? kDamaged : used < least ? kShort : "",
      .bytes = mapping.bytes.first(used),
      .arrived = std::chrono::steady_clock::now()}};
}

Result<> Stream::giveBack(const Picture& picture) {
  sync(mappings_.at(picture.index), DMA_BUF_SYNC_END);
  return queue(picture.index);
}

}  // namespace toftwin::drivers::v4l2
