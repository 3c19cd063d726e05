// SPDX-License-Identifier: Apache-2.0
// OpenEXR: one channel of a plane as 32-bit floats, a scan line after the other, not compressed [OpenEXR File Layout]. Metres
// are in the channel Z, as renderers have depth; other numbers in Y.
#include <fmt/format.h>

#include <array>

#include <toftwin/names.h>

#include "tools/cli/export/export.h"

namespace toftwin::cli {
namespace {

class Exr {
 public:
  template <class Number>
  void number(Number value) {
    raw(std::as_bytes(std::span{&value, 1}));
  }
  void raw(std::span<const std::byte> bytes) { bytes_.insert(bytes_.end(), bytes.begin(), bytes.end()); }
  void text(std::string_view text) {
    raw(std::as_bytes(std::span{text}));
    bytes_.push_back(std::byte{0});
  }
  template <class... Numbers>
  void attribute(std::string_view name, std::string_view type, Numbers... values) {
    text(name);
    text(type);
    number(static_cast<std::int32_t>((sizeof values + ...)));
    (number(values), ...);
  }
  std::vector<std::byte> bytes_;
};

void writeHeader(Exr& exr, const Plane& plane, char channel) {
  const std::int32_t right = plane.width - 1, bottom = plane.height - 1;
  exr.number(std::int32_t{20000630});  // magic
  exr.number(std::int32_t{2});         // version, one picture of scan lines
  exr.text("channels");
  exr.text("chlist");
  exr.number(std::int32_t{19});
  exr.text(std::string_view{&channel, 1});
  exr.number(std::int32_t{2});  // floats
  exr.number(std::int32_t{0});  // and reserved
  exr.number(std::int32_t{1});  // every column
  exr.number(std::int32_t{1});  // and row
  exr.number('\0');             // no more channels
  exr.attribute("compression", "compression", '\0');
  exr.attribute("dataWindow", "box2i", 0, 0, right, bottom);
  exr.attribute("displayWindow", "box2i", 0, 0, right, bottom);
  exr.attribute("lineOrder", "lineOrder", '\0');
  exr.attribute("pixelAspectRatio", "float", 1.0f);
  exr.attribute("screenWindowCenter", "v2f", 0.0f, 0.0f);
  exr.attribute("screenWindowWidth", "float", 1.0f);
  exr.number('\0');
}

}  // namespace

Result<Exported> toExr(const Frame& frame, const ExportOptions& options) {
  const auto plane = choosePlane(frame, options.planes);
  if (!plane) return plane.error();
  const auto picture = pictureOf(**plane, options.channel);
  if (!picture) return picture.error();
  const bool is_metres = unitOf((*plane)->kind) == "m";
  Exr exr;
  writeHeader(exr, **plane, is_metres ? 'Z' : 'Y');
  const auto width = static_cast<std::size_t>((*plane)->width), height = static_cast<std::size_t>((*plane)->height);
  const std::size_t row_bytes = 4 * width, first = exr.bytes_.size() + 8 * height;
  for (std::size_t y = 0; y < height; ++y) exr.number(static_cast<std::uint64_t>(first + y * (8 + row_bytes)));
  for (std::size_t y = 0; y < height; ++y) {
    exr.number(static_cast<std::int32_t>(y));
    exr.number(static_cast<std::int32_t>(row_bytes));
    exr.raw(std::as_bytes(std::span{picture->values}.subspan(y * width, width)));
  }
  return Exported{std::move(exr.bytes_), fmt::format("{}{}, channel {}", nameOf((*plane)->kind), is_metres ? ", m" : "", is_metres ? "Z" : "Y")};
}

}  // namespace toftwin::cli
