// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include <toftwin/result.h>
#include <toftwin/units.h>

#include "drivers/lens.h"

/// What V4L2 does not say of a camera: what its codes mean and where its pixels look.
namespace toftwin::drivers::v4l2 {

enum class Measures { Depth, Range };

/// How to find one of the images among a camera's nodes, and how to read it.
struct ImageKeys {
  int node = -1;
  std::string format;

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("node", node, {-1, 15},
             "which of the camera's capture nodes, counted from 0; -1: the first with that format");
    v.text("format", format,
           "Z16, INZI, Y16, Y16_BE, Y12, Y12P, Y10, Y10P, Y10B or Y8; empty: for depth the first "
           "that is depth by definition, for infrared none");
  }
};

struct DepthKeys : ImageKeys {
  DepthKeys() = default;  // as an aggregate, GCC 12 warns of its base wrongly

  int width = 0;
  int height = 0;
  Measures measures = Measures::Depth;
  Length unit = 1_mm;
  Length offset = 0_mm;
  std::vector<double> invalid{0.0};
  std::vector<double> saturated;
  Length farthest = 0_m;

  template <class Visitor>
  void visit(Visitor& v) {
    ImageKeys::visit(v);
    v.number("width", width, {0, 16384}, "pixels per row; 0: as the camera offers");
    v.number("height", height, {0, 16384}, "rows; 0: as the camera offers");
    v.choice("measures", measures, {{"depth", Measures::Depth}, {"range", Measures::Range}},
             "along the optical axis, or along each pixel's ray");
    v.quantity("unit", unit, millimetre, {1e-6, 1e3}, "length of one code");
    v.quantity("offset", offset, millimetre, {-1e5, 1e5}, "length of code 0");
    v.numbers("invalid", invalid, {0, 65535}, "codes that say: no value");
    v.numbers("saturated", saturated, {0, 65535}, "codes that say: too bright");
    v.quantity("farthest", farthest, metre, {0, 1e5}, "beyond it a value is out of range; 0: none");
  }
};

struct Description {
  std::string name;
  std::vector<std::string> match;
  DepthKeys depth;
  ImageKeys infrared;
  LensKeys lens;

  template <class Visitor>
  void visit(Visitor& v) {
    v.text("name", name, "of the camera's model; empty: as the kernel names it");
    v.texts("match", match,
            "which cameras it is for: \"usb:1d27:0601\" (ids), \"card:NAME\" (as the kernel names "
            "it)");
    v.group("depth", depth, "the image of distances");
    v.group("infrared", infrared, "the image of brightness, as large as that of distances");
    v.group("lens", lens, "of the depth image");
  }
};

/// A file's description, or why it cannot be used, with every mistake at its place.
Result<Description> loadDescription(const std::filesystem::path& file);
Result<Description> parseDescription(std::string_view toml, const std::string& name);

/// Those that come with the driver (drivers/v4l2/cameras).
struct Preset {
  std::string_view name, text;
};
std::vector<Preset> presets();

/// Whether it says that it is for such a camera. `usb_ids`: "1d27:0601", or empty.
bool matches(const Description& description, const std::string& usb_ids, const std::string& card);

}  // namespace toftwin::drivers::v4l2
