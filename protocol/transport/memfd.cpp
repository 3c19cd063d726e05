// SPDX-License-Identifier: Apache-2.0
#include "protocol/transport/memfd.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <numeric>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

namespace toftwin::transport {
namespace {

constexpr int kSeals = F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_WRITE;

Error systemError(const char* what) {
  return {Error::Code::Internal, std::string{"shared memory: "} + what +
                                     " failed: " + std::generic_category().message(errno)};
}

/// Writes all pieces. write(2) fills fresh pages without faulting each of them in, as a mapping
/// would.
Result<> writePieces(int fd, const std::vector<Buffer>& pieces) {
  std::vector<iovec> left;
  for (const Buffer& piece : pieces) {
    if (piece.size() > 0)
      left.push_back({const_cast<std::byte*>(piece.bytes().data()), piece.size()});
  }
  auto first = left.begin();
  while (first != left.end()) {
    const auto count = static_cast<int>(std::min<std::ptrdiff_t>(left.end() - first, IOV_MAX));
    const ssize_t wrote = ::writev(fd, &*first, count);
    if (wrote < 0) {
      if (errno == EINTR) continue;
      return systemError("writing");
    }
    auto done = static_cast<std::size_t>(wrote);
    while (first != left.end() && done >= first->iov_len) done -= (first++)->iov_len;
    if (first != left.end()) {
      first->iov_base = static_cast<std::byte*>(first->iov_base) + done;
      first->iov_len -= done;
    }
  }
  return {};
}

FileDescriptor newMemfd() { return FileDescriptor{::memfd_create("toftwin-body", MFD_CLOEXEC | MFD_ALLOW_SEALING)}; }

Result<> fillAndSeal(const FileDescriptor& fd, const wire::Body& body) {
  if (!fd) return systemError("memfd_create");
  if (auto wrote = writePieces(fd.get(), body.pieces); !wrote) return wrote;
  if (::fcntl(fd.get(), F_ADD_SEALS, kSeals | F_SEAL_SEAL) != 0) return systemError("sealing");
  return {};
}

}  // namespace

FileDescriptor& FileDescriptor::operator=(FileDescriptor&& other) noexcept {
  if (this != &other) {
    if (fd_ >= 0) ::close(fd_);
    fd_ = other.release();
  }
  return *this;
}

FileDescriptor::~FileDescriptor() {
  if (fd_ >= 0) ::close(fd_);
}

int FileDescriptor::release() { return std::exchange(fd_, -1); }

Result<std::shared_ptr<const SharedBody>> SharedBody::create(const wire::Body& body) {
  FileDescriptor fd = newMemfd();
  if (auto filled = fillAndSeal(fd, body); !filled) return filled.error();
  return std::shared_ptr<const SharedBody>{new SharedBody{std::move(fd), body.bytes}};
}

/// Without a thread, for want of one, memory is taken when it is needed.
SharedBodies::SharedBodies() {
  try {
    thread_ = std::jthread{[this](const std::stop_token& stop) { work(stop); }};
  } catch (const std::system_error&) {
  }
}

Result<std::shared_ptr<const SharedBody>> SharedBodies::make(const wire::Body& body) {
  FileDescriptor fd = takeSpare(body.bytes);
  if (!fd) fd = newMemfd();
  if (auto filled = fillAndSeal(fd, body); !filled) return filled.error();
  BodyPtr made{new SharedBody{std::move(fd), body.bytes}};
  keep(made);
  return made;
}

/// A while: see letGo().
void SharedBodies::keep(const BodyPtr& body) {
  if (body->size() > kMostBytes / kMostKept) return;
  BodyPtr oldest;  // goes when the lock is gone
  bool is_awaited = false;
  {
    const std::scoped_lock lock{mutex_};
    kept_.push_back(body);
    ++made_;
    if (kept_.size() > kMostKept) oldest = std::move(kept_.front()), kept_.pop_front();
    is_awaited = !wanted_.empty();
  }
  if (!is_awaited) changed_.notify_one();
}

/// The bodies that were kept when it was called last.
void SharedBodies::letGo(std::unique_lock<std::mutex>& lock) {
  const std::size_t made = std::min(std::exchange(made_, 0), kept_.size());
  std::deque<BodyPtr> gone;
  for (std::size_t i = kept_.size() - made; i > 0; --i) gone.push_back(std::move(kept_.front())), kept_.pop_front();
  lock.unlock();
  gone.clear();
  lock.lock();
}

std::uint64_t SharedBodies::ready() const {
  const std::scoped_lock lock{mutex_};
  return bytesOfSpares();
}

FileDescriptor SharedBodies::takeSpare(std::uint64_t size) {
  FileDescriptor fd;
  {
    const std::scoped_lock lock{mutex_};
    if (const auto spare = std::ranges::find(spares_, size, &Spare::size); spare != spares_.end()) {
      fd = std::move(spare->fd);
      spares_.erase(spare);
    }
    if (size < kSmallest || size > kMostBytes / kOfASize || sparesOf(size) >= kOfASize) return fd;
    wanted_.insert(size);
  }
  changed_.notify_one();
  return fd;
}

/// The thread. What cannot be had now is taken when it is needed.
void SharedBodies::work(const std::stop_token& stop) {
  std::unique_lock lock{mutex_};
  const auto never = [] { return false; };
  while (changed_.wait(lock, stop, [&] { return !wanted_.empty() || made_ > 0; })) {
    const bool is_urgent = !wanted_.empty() && sparesOf(*wanted_.begin()) == 0;
    if (!is_urgent) changed_.wait_for(lock, stop, kLater, never);
    letGo(lock);
    if (!wanted_.empty()) makeSpares(*wanted_.begin(), lock, stop);
  }
}

void SharedBodies::makeSpares(std::uint64_t size, std::unique_lock<std::mutex>& lock, const std::stop_token& stop) {
  while (!stop.stop_requested() && sparesOf(size) < kOfASize) {
    lock.unlock();  // who sends does not wait for this
    FileDescriptor fd = newMemfd();
    const bool is_made = fd && ::fallocate(fd.get(), 0, 0, static_cast<off_t>(size)) == 0;
    lock.lock();
    if (!is_made) break;
    spares_.push_back({size, std::move(fd)});
    while (spares_.size() > kMostReady || bytesOfSpares() > kMostBytes) spares_.pop_front();
  }
  wanted_.erase(size);
}

std::size_t SharedBodies::sparesOf(std::uint64_t size) const {
  return static_cast<std::size_t>(std::ranges::count(spares_, size, &Spare::size));
}

std::uint64_t SharedBodies::bytesOfSpares() const {
  return std::accumulate(spares_.begin(), spares_.end(), std::uint64_t{0},
                         [](std::uint64_t sum, const Spare& spare) { return sum + spare.size; });
}

Result<Buffer> mapSharedBody(const FileDescriptor& memfd, std::uint64_t size) {
  const int seals = ::fcntl(memfd.get(), F_GET_SEALS);
  if (seals < 0 || (seals & kSeals) != kSeals) {  // else the peer could pull the memory away
    return Error{Error::Code::Malformed, "the body's file descriptor is not a sealed memfd"};
  }
  struct stat status {};
  if (::fstat(memfd.get(), &status) != 0) return systemError("fstat");
  if (status.st_size < 0 || static_cast<std::uint64_t>(status.st_size) != size) {
    return Error{Error::Code::Malformed, "the body's memfd has " + std::to_string(status.st_size) +
                                             " bytes, not the announced " + std::to_string(size)};
  }
  if (size == 0) return Buffer{};
  // Not MAP_POPULATE: mapping all pages now costs as much as faulting them in when they are read
  // (the kernel maps sixteen at a time), but here the reading thread would pay, for all its
  // subscriptions.
  void* const memory = ::mmap(nullptr, size, PROT_READ, MAP_SHARED, memfd.get(), 0);
  if (memory == MAP_FAILED) return systemError("mmap");
  std::shared_ptr<const void> owner{
      memory, [size](const void* mapped) { ::munmap(const_cast<void*>(mapped), size); }};
  return Buffer{std::move(owner), {static_cast<const std::byte*>(memory), size}};
}

}  // namespace toftwin::transport
