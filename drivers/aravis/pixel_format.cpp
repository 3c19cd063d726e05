// SPDX-License-Identifier: Apache-2.0
#include "drivers/aravis/pixel_format.h"

#include <algorithm>
#include <array>

namespace toftwin::drivers::aravis {
namespace {

using Element = PixelFormat::Element;

// Numbers: GenICam PFNC; 0x01 one component per pixel, 0x02 several, then bits per pixel, then an
// id.
constexpr std::array kFormats{
    PixelFormat{0x010800B1, "Coord3D_C8", Role::Range, Element::U8},
    PixelFormat{0x011000B8, "Coord3D_C16", Role::Range, Element::U16},
    PixelFormat{0x012000BF, "Coord3D_C32f", Role::Range, Element::F32},
    PixelFormat{0x021800B2, "Coord3D_ABC8", Role::Range, Element::U8, 3},
    PixelFormat{0x021800B3, "Coord3D_ABC8_Planar", Role::Range, Element::U8, 3, true},
    PixelFormat{0x023000B9, "Coord3D_ABC16", Role::Range, Element::U16, 3},
    PixelFormat{0x023000BA, "Coord3D_ABC16_Planar", Role::Range, Element::U16, 3, true},
    PixelFormat{0x026000C0, "Coord3D_ABC32f", Role::Range, Element::F32, 3},
    PixelFormat{0x026000C1, "Coord3D_ABC32f_Planar", Role::Range, Element::F32, 3, true},
    PixelFormat{0x01080001, "Mono8", Role::Intensity, Element::U8},
    PixelFormat{0x01100003, "Mono10", Role::Intensity, Element::U16},
    PixelFormat{0x01100005, "Mono12", Role::Intensity, Element::U16},
    PixelFormat{0x01100025, "Mono14", Role::Intensity, Element::U16},
    PixelFormat{0x01100007, "Mono16", Role::Intensity, Element::U16},
    PixelFormat{0x010800C6, "Confidence8", Role::Confidence, Element::U8},
    PixelFormat{0x011000C7, "Confidence16", Role::Confidence, Element::U16},
};

}  // namespace

std::span<const PixelFormat> allPixelFormats() { return kFormats; }

const PixelFormat* pixelFormatOf(std::uint32_t code) {
  const auto found = std::ranges::find(kFormats, code, &PixelFormat::code);
  return found == kFormats.end() ? nullptr : &*found;
}

const PixelFormat* pixelFormatNamed(std::string_view name) {
  const auto found = std::ranges::find(kFormats, name, &PixelFormat::name);
  return found == kFormats.end() ? nullptr : &*found;
}

std::string pixelFormatNames(Role role) {
  std::string names;
  for (const PixelFormat& one : kFormats) {
    if (one.role == role) names += (names.empty() ? "" : ", ") + std::string{one.name};
  }
  return names;
}

}  // namespace toftwin::drivers::aravis
