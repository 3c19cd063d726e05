// SPDX-License-Identifier: Apache-2.0
#include <toftwin/frame.h>

namespace toftwin {
namespace {

template <class T>
Plane adopt(PlaneKind kind, ElementType type, Image<T> image) {
  const int width = image.width(), height = image.height();
  return {kind, type, width, height, 1, Buffer::adopt(image.release())};
}

}  // namespace

Plane toPlane(PlaneKind kind, Image<float> image) {
  return adopt(kind, ElementType::F32, std::move(image));
}
Plane toPlane(PlaneKind kind, Image<std::uint8_t> image) {
  return adopt(kind, ElementType::U8, std::move(image));
}
Plane toPlane(PlaneKind kind, Image<std::uint16_t> image) {
  return adopt(kind, ElementType::U16, std::move(image));
}

}  // namespace toftwin
