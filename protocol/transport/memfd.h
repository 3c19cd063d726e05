// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <mutex>

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

class SharedBodies;

/// A body in a memfd that nobody can change any more (sealed against writing, shrinking and
/// growing): made once and given to every subscriber on this machine.
class SharedBody {
 public:
  static Result<std::shared_ptr<const SharedBody>> create(const wire::Body& body);
  SharedBody(const SharedBody&) = delete;
  SharedBody& operator=(const SharedBody&) = delete;
  ~SharedBody();
  [[nodiscard]] int fd() const { return fd_.get(); }
  [[nodiscard]] std::uint64_t size() const { return size_; }

 private:
  friend class SharedBodies;
  SharedBody(FileDescriptor fd, std::uint64_t size, std::weak_ptr<SharedBodies> maker)
      : fd_(std::move(fd)), size_(size), maker_(std::move(maker)) {}
  FileDescriptor fd_;
  std::uint64_t size_;
  std::weak_ptr<SharedBodies> maker_;
};

/// Makes bodies of streams. When a body goes, because all have it, memory is made ready for the next of its
/// size: to take fresh pages from the kernel takes two thirds of the time that a body of 2 MB needs (0.55 →
/// 0.20 ms), and a frame would wait for it. Shared by the subscriptions that want bodies, so that this memory
/// goes with the last of them. May be used on any thread.
class SharedBodies : public std::enable_shared_from_this<SharedBodies> {
 public:
  static constexpr std::size_t kMostSpares = 4;                  ///< sizes: streams with other planes
  static constexpr std::uint64_t kLargestSpare = 16ull << 20;  ///< bytes

  Result<std::shared_ptr<const SharedBody>> make(const wire::Body& body);
  /// Memory that is ready, in bytes.
  [[nodiscard]] std::uint64_t ready() const;

 private:
  friend class SharedBody;
  struct Spare {
    std::uint64_t size = 0;  ///< 0: none
    FileDescriptor fd;
  };
  FileDescriptor takeSpare(std::uint64_t size);
  void makeSpare(std::uint64_t size);

  mutable std::mutex mutex_;
  std::array<Spare, kMostSpares> spares_;  ///< the newest last
};

/// A received memfd as read-only memory that is unmapped when the last Buffer goes. It must be a
/// memfd of exactly `size` bytes with all three seals, or the error is Malformed.
Result<Buffer> mapSharedBody(const FileDescriptor& memfd, std::uint64_t size);

}  // namespace toftwin::transport
