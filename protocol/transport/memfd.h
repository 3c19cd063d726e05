// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>

#include <toftwin/result.h>

#include "protocol/wire/codec.h"

/// A frame's body in shared memory, for clients on the same machine (docs/protocol.md, "Shared
/// memory").
namespace toftwin::transport {

/// The feature that both Hellos must name before a body may come this way.
inline constexpr const char* kMemfdFeature = "memfd";

/// A file descriptor that closes itself.
class FileDescriptor {
 public:
  FileDescriptor() = default;
  explicit FileDescriptor(int fd) : fd_(fd) {}
  FileDescriptor(FileDescriptor&& other) noexcept : fd_(other.release()) {}
  FileDescriptor& operator=(FileDescriptor&& other) noexcept;
  ~FileDescriptor();
  [[nodiscard]] int get() const { return fd_; }
  [[nodiscard]] explicit operator bool() const { return fd_ >= 0; }
  int release();

 private:
  int fd_ = -1;
};

/// A body in a memfd that nobody can change any more (sealed against writing, shrinking and
/// growing): made once and given to every subscriber on this machine.
class SharedBody {
 public:
  static Result<std::shared_ptr<const SharedBody>> create(const wire::Body& body);
  [[nodiscard]] int fd() const { return fd_.get(); }
  [[nodiscard]] std::uint64_t size() const { return size_; }

 private:
  SharedBody(FileDescriptor fd, std::uint64_t size) : fd_(std::move(fd)), size_(size) {}
  FileDescriptor fd_;
  std::uint64_t size_;
};

/// A received memfd as read-only memory that is unmapped when the last Buffer goes. It must be a
/// memfd of exactly `size` bytes with all three seals, or the error is Malformed.
Result<Buffer> mapSharedBody(const FileDescriptor& memfd, std::uint64_t size);

}  // namespace toftwin::transport
