// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

#include <toftwin/result.h>

#include "protocol/record/file.h"

namespace toftwin::cli {

/// Bytes one after the other.
class ByteStream {
 public:
  virtual ~ByteStream() = default;
  /// Fills `into`; all of it or an error.
  virtual Result<> read(std::span<std::byte> into) = 0;
  /// What is left at the beginning, as far as it is said.
  [[nodiscard]] virtual std::uint64_t size() const = 0;
};

/// A file from a place on.
class FileStream final : public ByteStream {
 public:
  FileStream(record::InputFile file, std::uint64_t begin) : file_(std::move(file)), at_(begin), size_(file_.size() - std::min(begin, file_.size())) {}
  Result<> read(std::span<std::byte> into) override {
    if (!file_.holds(at_, into.size())) return Error{Error::Code::Malformed, file_.path().string() + ": it ends before its numbers do"};
    auto done = file_.readAt(at_, into);
    at_ += into.size();
    return done;
  }
  [[nodiscard]] std::uint64_t size() const override { return size_; }

 private:
  record::InputFile file_;
  std::uint64_t at_, size_;
};

}  // namespace toftwin::cli
