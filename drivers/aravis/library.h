// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <arv.h>

#include <memory>
#include <string_view>
#include <utility>

#include <toftwin/result.h>

/// libaravis' objects and errors with owners.
namespace toftwin::drivers::aravis {

struct Unref {
  void operator()(gpointer object) const { g_object_unref(object); }
};
template <class T>
using Object = std::unique_ptr<T, Unref>;

struct Free {
  void operator()(gpointer memory) const { g_free(memory); }
};
template <class T>
using Memory = std::unique_ptr<T, Free>;

/// The last parameter of many of the library's functions: what went wrong, if anything did.
class Failure {
 public:
  Failure() = default;
  Failure(const Failure&) = delete;
  Failure& operator=(const Failure&) = delete;
  ~Failure() { g_clear_error(&error_); }

  [[nodiscard]] GError** slot() {
    g_clear_error(&error_);
    return &error_;
  }
  explicit operator bool() const { return error_ != nullptr; }
  /// Disconnected where the camera did not answer, else InvalidArgument.
  [[nodiscard]] Error toError(std::string_view what) const;

 private:
  GError* error_ = nullptr;
};

}  // namespace toftwin::drivers::aravis
