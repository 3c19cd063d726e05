// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <set>
#include <stop_token>
#include <thread>

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
  SharedBody(const SharedBody&) = delete;
  SharedBody& operator=(const SharedBody&) = delete;
  [[nodiscard]] int fd() const { return fd_.get(); }
  [[nodiscard]] std::uint64_t size() const { return size_; }

 private:
  friend class SharedBodies;
  SharedBody(FileDescriptor fd, std::uint64_t size) : fd_(std::move(fd)), size_(size) {}
  FileDescriptor fd_;
  std::uint64_t size_;
};

/// Makes bodies of streams, in memory that is ready: to take fresh pages from the kernel takes two thirds of
/// the time that a body of 2 MB needs (0.55 → 0.20 ms), and a frame would wait for it. A thread of its own
/// makes the next ready, when those who have just been sent a body are done with their processors. Bodies are
/// kept until it comes after the next one, as whoever lets a body go last gives its pages back (0.3 ms), and
/// subscribers that come when others have it need no second one. Shared by the subscriptions that want bodies, so that
/// memory and thread go with the last of them. May be used on any thread.
class SharedBodies {
 public:
  static constexpr std::uint64_t kSmallest = 64 << 10;  ///< bytes; for smaller ones no memory is made ready
  static constexpr std::size_t kOfASize = 2;            ///< one while the other is being made
  static constexpr std::size_t kMostReady = 8;
  static constexpr std::uint64_t kMostBytes = 64ull << 20;  ///< that are ready
  static constexpr std::chrono::milliseconds kLater{3};     ///< than a body, unless none of its size is left
  static constexpr std::size_t kMostKept = 4;  ///< bodies, if none is larger than a share of kMostBytes

  SharedBodies();
  Result<std::shared_ptr<const SharedBody>> make(const wire::Body& body);
  /// Memory that is ready, in bytes.
  [[nodiscard]] std::uint64_t ready() const;

 private:
  struct Spare {
    std::uint64_t size = 0;
    FileDescriptor fd;
  };
  using BodyPtr = std::shared_ptr<const SharedBody>;
  FileDescriptor takeSpare(std::uint64_t size);
  void keep(const BodyPtr& body);
  void work(const std::stop_token& stop);
  void letGo(std::unique_lock<std::mutex>& lock);
  void makeSpares(std::uint64_t size, std::unique_lock<std::mutex>& lock, const std::stop_token& stop);
  [[nodiscard]] std::size_t sparesOf(std::uint64_t size) const;
  [[nodiscard]] std::uint64_t bytesOfSpares() const;

  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  std::set<std::uint64_t> wanted_;  ///< sizes
  std::deque<Spare> spares_;        ///< the newest last
  std::deque<BodyPtr> kept_;        ///< the newest last
  std::size_t made_ = 0;            ///< bodies since letGo()
  std::jthread thread_;             ///< last: it ends first
};

/// A received memfd as read-only memory that is unmapped when the last Buffer goes. It must be a
/// memfd of exactly `size` bytes with all three seals, or the error is Malformed.
Result<Buffer> mapSharedBody(const FileDescriptor& memfd, std::uint64_t size);

}  // namespace toftwin::transport
