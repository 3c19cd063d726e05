// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cassert>
#include <string>
#include <utility>
#include <variant>

namespace toftwin {

/// Why something that a correct program may meet did not work. `message` says what, where and what
/// to do about it, and can be shown to a user as it is.
struct Error {
  /// On the wire as a byte; values never change.
  enum class Code : unsigned char {
    Internal = 0,
    InvalidArgument = 1,  ///< a value or a key that the caller can mend
    NotFound = 2,
    Unsupported = 3,  ///< this source or this peer cannot do that
    Malformed = 4,    ///< bytes from outside that break the format
    TooLarge = 5,
    Timeout = 6,
    Disconnected = 7,
    Busy = 8,
    PermissionDenied = 9,
    StorageFull = 10,
    EndOfStream = 11,  ///< a recording or a bounded simulation has no more frames
    Stopped = 12,      ///< asked to stop while waiting
    Overrun = 13,      ///< a LOSSLESS subscriber fell too far behind
    Incompatible = 14  ///< protocol or file version
  };
  Code code = Code::Internal;
  std::string message;
};

/// A value or the Error that kept it from being. Never both, never neither.
template <class T = void>
class [[nodiscard]] Result {
 public:
  Result(T value) : state_(std::move(value)) {}      // NOLINT(google-explicit-constructor)
  Result(Error error) : state_(std::move(error)) {}  // NOLINT(google-explicit-constructor)

  [[nodiscard]] bool ok() const { return state_.index() == 0; }
  explicit operator bool() const { return ok(); }

  T& value() & { return assert(ok()), std::get<0>(state_); }
  const T& value() const& { return assert(ok()), std::get<0>(state_); }
  T&& value() && { return assert(ok()), std::get<0>(std::move(state_)); }
  T& operator*() & { return value(); }
  const T& operator*() const& { return value(); }
  T&& operator*() && { return std::move(*this).value(); }
  T* operator->() { return &value(); }
  const T* operator->() const { return &value(); }

  [[nodiscard]] const Error& error() const { return assert(!ok()), std::get<1>(state_); }

 private:
  std::variant<T, Error> state_;
};

template <>
class [[nodiscard]] Result<void> {
 public:
  Result() = default;
  Result(Error error) : error_(std::move(error)), ok_(false) {}  // NOLINT(google-explicit-constructor)

  [[nodiscard]] bool ok() const { return ok_; }
  explicit operator bool() const { return ok_; }
  [[nodiscard]] const Error& error() const { return assert(!ok_), error_; }

 private:
  Error error_;
  bool ok_ = true;
};

}  // namespace toftwin
