// SPDX-License-Identifier: Apache-2.0
#include "drivers/aravis/region.h"

#include <fmt/format.h>

#include "drivers/aravis/aravis.h"

namespace toftwin::drivers::aravis {
namespace {

/// Images that are binned are left to lensFor(), which scales. `Camera`: LensKeys or CameraInfo, which name
/// the same things alike.
template <class Camera>
Result<Camera> ofRegion(Camera lens, const Region& region) {
  const bool is_sent = lens.width == region.width && lens.height == region.height;
  if (lens.width == 0 || is_sent) return lens;
  const bool is_of_whole = region.whole_width.is(lens.width) && region.whole_height.is(lens.height);
  if (is_of_whole && !region.skips_pixels) {
    lens.cx -= region.x;
    lens.cy -= region.y;
    lens.width = region.width;
    lens.height = region.height;
    return lens;
  }
  const int whole_width = region.whole_width.pixels, whole_height = region.whole_height.pixels;
  const bool is_cut = region.x > 0 || region.y > 0 || (whole_width > 0 && whole_width != region.width) ||
                      (whole_height > 0 && whole_height != region.height);
  if (!is_cut && !region.skips_pixels) return lens;
  return Error{
      Error::Code::Incompatible,
      fmt::format("aravis: the lens is described for {} x {} pixels, but the camera sends {} x {} from ({}, "
                  "{}) on of "
                  "{} x {}{}: which of its pixels these are cannot be told; describe the lens for the whole "
                  "image or for this region",
                  lens.width, lens.height, region.width, region.height, region.x, region.y, whole_width,
                  whole_height, region.skips_pixels ? ", leaving pixels out (decimation)" : "")};
}

template <class Camera>
Result<Lens> sentLens(const Camera& lens, const Region& region) {
  const auto sent = ofRegion(lens, region);
  if (!sent) return sent.error();
  return lensFor(*sent, region.width, region.height, About::name);
}

}  // namespace

WholeSide wholeSide(int sensor, int most, int offset, int sent) {
  if (most == 0 || sensor == most || sensor == most + offset) return {sensor, sensor};
  return {offset + sent > most ? most + offset : most, most + offset};
}

Result<Lens> lensOfRegion(const LensKeys& lens, const Region& region) {
  return sentLens(inPixels(lens), region);
}
Result<Lens> lensOfRegion(const CameraInfo& calibrated, const Region& region) {
  return sentLens(calibrated, region);
}

}  // namespace toftwin::drivers::aravis
