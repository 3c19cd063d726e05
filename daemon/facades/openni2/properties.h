// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <openni2/OniCTypes.h>

#include <cstring>
#include <string_view>

namespace toftwin::openni2 {

/// What a program hands over is a size and bytes.
template <class T>
OniStatus give(const T& value, void* data, int* size) {
  if (data == nullptr || size == nullptr || *size < static_cast<int>(sizeof value)) return ONI_STATUS_BAD_PARAMETER;
  std::memcpy(data, &value, sizeof value);
  *size = static_cast<int>(sizeof value);
  return ONI_STATUS_OK;
}
/// With a zero at the end.
inline OniStatus giveText(std::string_view text, void* data, int* size) {
  if (data == nullptr || size == nullptr || *size < 1 || static_cast<std::size_t>(*size) <= text.size())
    return ONI_STATUS_BAD_PARAMETER;
  std::memcpy(data, text.data(), text.size());
  static_cast<char*>(data)[text.size()] = '\0';
  *size = static_cast<int>(text.size()) + 1;
  return ONI_STATUS_OK;
}
template <class T>
bool take(T& value, const void* data, int size) {
  if (data == nullptr || size != static_cast<int>(sizeof value)) return false;
  std::memcpy(&value, data, sizeof value);
  return true;
}

}  // namespace toftwin::openni2
