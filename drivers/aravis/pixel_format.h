// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace toftwin::drivers::aravis {

/// What an image of a camera is for.
enum class Role { Range, Intensity, Confidence };

/// How pixels lie in memory, by the GenICam Pixel Format Naming Convention: little endian, the rows
/// one after the other.
struct PixelFormat {
  enum class Element { U8, U16, F32 };
  std::uint32_t code = 0;
  std::string_view name;
  Role role = Role::Intensity;
  Element element = Element::U8;
  int channels = 1;        ///< three: coordinates A, B and C; one of a range image: C
  bool is_planar = false;  ///< the channels one after the other, each an image of its own
};

std::span<const PixelFormat> allPixelFormats();
const PixelFormat* pixelFormatOf(std::uint32_t code);
const PixelFormat* pixelFormatNamed(std::string_view name);
/// The names of those that can be read, for errors.
std::string pixelFormatNames(Role role);

constexpr std::size_t sizeOf(PixelFormat::Element element) {
  return element == PixelFormat::Element::U8 ? 1 : element == PixelFormat::Element::U16 ? 2 : 4;
}

}  // namespace toftwin::drivers::aravis
