// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <future>
#include <initializer_list>
#include <span>
#include <string>
#include <vector>

#include <toftwin/result.h>

namespace toftwin::record {

/// A file that only grows. What was appended stays: an append that fails halfway (disk full) is
/// taken back, so the file always ends with a whole append.
class OutputFile {
 public:
  /// Error InvalidArgument if the file is there and may not be overwritten.
  static Result<OutputFile> create(const std::filesystem::path& path, bool overwrite);
  OutputFile(OutputFile&& other) noexcept;
  OutputFile& operator=(OutputFile&& other) noexcept;
  ~OutputFile();

  /// All of the bytes or none. Error StorageFull where the disk, the quota or a limit is at its
  /// end.
  Result<> append(std::span<const std::byte> bytes);
  /// Has what was appended brought to the disk, with the file's name in its folder, by a thread of its own: whoever
  /// writes goes on, however slow the disk. Where that is under way already, what came since is the next call's. The error
  /// is that of the one before.
  Result<> sync();
  /// Waits until the bytes are on the disk, and closes.
  Result<> close();
  [[nodiscard]] std::uint64_t size() const { return size_; }
  /// What this user could still write onto the file's disk.
  [[nodiscard]] Result<std::uint64_t> freeBytes() const;
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  OutputFile(int fd, std::filesystem::path path) : fd_(fd), path_(std::move(path)) {}
  int fd_ = -1;
  std::uint64_t size_ = 0;
  std::filesystem::path path_;
  bool is_in_folder_ = false;  ///< for certain, after a power cut, too, once `syncing_` is done
  std::future<int> syncing_;   ///< the error number of what went wrong, or 0
};

/// A file for reading at any place; its size is that at opening.
class InputFile {
 public:
  static Result<InputFile> open(const std::filesystem::path& path);
  InputFile(InputFile&& other) noexcept;
  InputFile& operator=(InputFile&& other) noexcept;
  ~InputFile();

  /// Fills `into` from that place on; all of it or an error.
  Result<> readAt(std::uint64_t offset, std::span<std::byte> into) const;
  /// Whether `length` bytes at `offset` lie in the file; cannot overflow.
  [[nodiscard]] bool holds(std::uint64_t offset, std::uint64_t length) const {
    return offset <= size_ && length <= size_ - offset;
  }
  [[nodiscard]] std::uint64_t size() const { return size_; }
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  InputFile(int fd, std::uint64_t size, std::filesystem::path path)
      : fd_(fd), size_(size), path_(std::move(path)) {}
  int fd_ = -1;
  std::uint64_t size_ = 0;
  std::filesystem::path path_;
};

}  // namespace toftwin::record
