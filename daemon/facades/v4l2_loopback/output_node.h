// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <toftwin/result.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace toftwin::daemon::v4l2_loopback {

/// The system calls that are made. They are virtual so that tests can be the kernel. An error is the negative
/// errno.
class System {
 public:
  virtual ~System() = default;
  virtual int open(const std::string& node) = 0;
  virtual void close(int file) = 0;
  virtual int ioctl(int file, unsigned long request, void* argument) = 0;
  virtual std::int64_t write(int file, std::span<const std::byte> bytes) = 0;
};
/// The kernel that we run on.
System& kernel();

/// What the node shows. Codes are V4L2's, of four letters.
struct Format {
  std::uint32_t code = 0, width = 0, height = 0;
  [[nodiscard]] std::size_t bytes() const { return std::size_t{2} * width * height; }
  bool operator==(const Format&) const = default;
};

/// A node of v4l2loopback that is written to. Errors say what is to be done.
class OutputNode {
 public:
  static Result<OutputNode> open(System& system, const std::string& path);
  OutputNode(OutputNode&& other) noexcept;
  OutputNode& operator=(OutputNode&&) = delete;
  ~OutputNode();

  /// The first of those codes that the node takes in that size; `rate_hz` is told to readers where it is
  /// above 0.
  Result<> setFormat(std::span<const std::uint32_t> codes, std::uint32_t width, std::uint32_t height,
                     double rate_hz);
  [[nodiscard]] const std::optional<Format>& format() const { return format_; }
  /// One image of the format's size.
  Result<> write(std::span<const std::byte> image);

 private:
  OutputNode(System& system, std::string path, int file)
      : system_(system), path_(std::move(path)), file_(file) {}
  /// What the node made of the wish.
  Result<Format> tryFormat(std::uint32_t code, std::uint32_t width, std::uint32_t height);
  Error failure(const std::string& what, std::int64_t negative_errno) const;

  System& system_;
  std::string path_;
  int file_ = -1;
  std::optional<Format> format_;
};

}  // namespace toftwin::daemon::v4l2_loopback
