// SPDX-License-Identifier: Apache-2.0
#include "drivers/v4l2/device.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <linux/videodev2.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <system_error>

namespace toftwin::drivers::v4l2 {
namespace {

constexpr std::uint32_t kMostEntries = 256;  // of any list that the kernel is asked for

std::string textOf(const std::uint8_t* bytes, std::size_t most) {
  const auto* text = reinterpret_cast<const char*>(bytes);
  return {text, strnlen(text, most)};
}

std::vector<std::uint32_t> formatsOf(const Device& device) {
  std::vector<std::uint32_t> formats;
  for (std::uint32_t i = 0; i < kMostEntries; ++i) {
    v4l2_fmtdesc one{};
    one.index = i;
    one.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    if (device.control(VIDIOC_ENUM_FMT, &one) != 0) break;
    formats.push_back(one.pixelformat);
  }
  return formats;
}

std::string offers(const Device& device) {
  std::vector<std::string> names;
  for (const std::uint32_t fourcc : formatsOf(device)) names.push_back(nameOf(fourcc));
  return fmt::format("{}", fmt::join(names, ", "));
}

double perSecond(const v4l2_fract& interval) {
  return interval.numerator == 0 ? 0.0
                                 : static_cast<double>(interval.denominator) / interval.numerator;
}

}  // namespace

Error failure(const std::string& node, std::string_view what, int negative_errno) {
  using Code = Error::Code;
  const int reason = -negative_errno;
  const std::string said =
      fmt::format("v4l2: {}: {}: {}", node, what, std::generic_category().message(reason));
  switch (reason) {
    case EACCES:
    case EPERM:
      return {Code::PermissionDenied,
              said +
                  "; add the user to the group \"video\" (usermod -aG video NAME), or see "
                  "toftwin doctor"};
    case ENOENT:
      return {Code::NotFound, said + "; it is not plugged in, or has another number"};
    case EBUSY:
      return {Code::Busy, said + "; another program streams from it: end that program"};
    case ENOSPC:
      return {Code::Busy, said +
                              "; the USB bus has no bandwidth left for it: plug it into a port of "
                              "another controller, or choose a smaller image"};
    case EPROTO:
    case EIO:
    case ENODEV:
    case ENXIO:
    case EPIPE:
    case ESHUTDOWN:
      return {Code::Disconnected, said};
    case EINVAL:
      return {Code::Incompatible, said};
    default:
      return {Code::Internal, said};
  }
}

Result<Device> Device::open(System& system, const std::string& node) {
  const int file = system.open(node);
  if (file < 0) return failure(node, "cannot be opened", file);
  return Device{system, node, file};
}

bool Node::offersDepth() const {
  return std::ranges::any_of(formats, [](std::uint32_t fourcc) {
    const PixelFormat* format = pixelFormatOf(fourcc);
    return format != nullptr && format->is_depth;
  });
}

std::vector<Node> captureNodes(System& system, std::vector<Error>* denied) {
  std::vector<Node> nodes;
  for (const std::string& path : system.nodes()) {
    const auto device = Device::open(system, path);
    if (!device) {
      if (denied != nullptr) denied->push_back(device.error());
      continue;
    }
    v4l2_capability can{};
    if (device->control(VIDIOC_QUERYCAP, &can) != 0) continue;
    const std::uint32_t caps =
        (can.capabilities & V4L2_CAP_DEVICE_CAPS) != 0 ? can.device_caps : can.capabilities;
    if ((caps & V4L2_CAP_VIDEO_CAPTURE) == 0 || (caps & V4L2_CAP_STREAMING) == 0) continue;
    Node node;
    node.path = path;
    node.driver = textOf(can.driver, sizeof can.driver);
    node.card = textOf(can.card, sizeof can.card);
    node.bus_info = textOf(can.bus_info, sizeof can.bus_info);
    const std::string vendor = system.usbAttribute(path, "idVendor");
    const std::string product = system.usbAttribute(path, "idProduct");
    if (!vendor.empty() && !product.empty()) node.usb_ids = vendor + ":" + product;
    node.serial = system.usbAttribute(path, "serial");
    node.formats = formatsOf(*device);
    nodes.push_back(std::move(node));
  }
  return nodes;
}

std::vector<Size> sizesOf(const Device& device, std::uint32_t fourcc) {
  std::vector<Size> sizes;
  const auto add = [&](std::uint32_t width, std::uint32_t height) {
    sizes.push_back({static_cast<int>(width), static_cast<int>(height)});
  };
  for (std::uint32_t i = 0; i < kMostEntries; ++i) {
    v4l2_frmsizeenum one{};
    one.index = i;
    one.pixel_format = fourcc;
    if (device.control(VIDIOC_ENUM_FRAMESIZES, &one) != 0) break;
    if (one.type == V4L2_FRMSIZE_TYPE_DISCRETE) {
      add(one.discrete.width, one.discrete.height);
    } else {
      add(one.stepwise.min_width, one.stepwise.min_height);
      add(one.stepwise.max_width, one.stepwise.max_height);
      break;
    }
  }
  return sizes;
}

std::string frameRatesOf(const Device& device, std::uint32_t fourcc, Size size) {
  std::string rates;
  for (std::uint32_t i = 0; i < kMostEntries; ++i) {
    v4l2_frmivalenum one{};
    one.index = i;
    one.pixel_format = fourcc;
    one.width = static_cast<std::uint32_t>(size.width);
    one.height = static_cast<std::uint32_t>(size.height);
    if (device.control(VIDIOC_ENUM_FRAMEINTERVALS, &one) != 0) break;
    if (one.type != V4L2_FRMIVAL_TYPE_DISCRETE) {
      return fmt::format("{:g} to {:g}", perSecond(one.stepwise.max), perSecond(one.stepwise.min));
    }
    rates += fmt::format("{}{:g}", rates.empty() ? "" : ", ", perSecond(one.discrete));
  }
  return rates.empty() ? "none that it tells" : rates;
}

Result<Layout> setLayout(const Device& device, const PixelFormat& format, Size wanted) {
  v4l2_format set{};
  set.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (const int error = device.control(VIDIOC_G_FMT, &set); error != 0) {
    return failure(device.node(), "does not say its format", error);
  }
  auto& pix = set.fmt.pix;
  const auto sizes = sizesOf(device, format.fourcc);
  if (wanted == Size{} && pix.pixelformat != format.fourcc && !sizes.empty())
    wanted = sizes.front();
  if (wanted != Size{}) {
    pix.width = static_cast<std::uint32_t>(wanted.width);
    pix.height = static_cast<std::uint32_t>(wanted.height);
  }
  pix.pixelformat = format.fourcc;
  pix.field = V4L2_FIELD_NONE;
  pix.bytesperline = pix.sizeimage = 0;
  if (const int error = device.control(VIDIOC_S_FMT, &set); error != 0) {
    return failure(device.node(), fmt::format("cannot be set to {}", format.name), error);
  }
  // The kernel may set something else and call it success.
  if (pix.pixelformat != format.fourcc) {
    return Error{Error::Code::Incompatible,
                 fmt::format("v4l2: {} has no format {}; it has: {}", device.node(), format.name,
                             offers(device))};
  }
  const Size got{static_cast<int>(pix.width), static_cast<int>(pix.height)};
  if (got.width < 1 || got.height < 1 || got.width > 16384 || got.height > 16384 ||
      (wanted != Size{} && got != wanted)) {
    std::vector<std::string> known;
    for (const Size& size : sizes) known.push_back(fmt::format("{} x {}", size.width, size.height));
    return Error{Error::Code::Incompatible,
                 fmt::format("v4l2: {} has no {} images of {} x {}; it has: {}", device.node(),
                             format.name, wanted.width, wanted.height, fmt::join(known, ", "))};
  }
  const std::size_t tight = tightStride(format, got.width);
  // What drivers say of two images in one is of no use.
  const std::size_t stride =
      format.has_infrared_first ? tight : std::max<std::size_t>(pix.bytesperline, tight);
  return Layout{format, got.width, got.height, stride};
}

Result<Duration> setFrameRate(const Device& device, const Layout& layout, Frequency wanted) {
  constexpr double kTolerance = 0.02;  // intervals are fractions of whole numbers
  constexpr double kDenominator = 1000.0;
  v4l2_streamparm set{};
  set.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  v4l2_fract& interval = set.parm.capture.timeperframe;
  const bool has_rate = device.control(VIDIOC_G_PARM, &set) == 0 &&
                        (set.parm.capture.capability & V4L2_CAP_TIMEPERFRAME) != 0;
  const double rate_hz = wanted.in(hertz);
  if (rate_hz > 0.0) {
    if (has_rate) {
      interval.numerator = static_cast<std::uint32_t>(kDenominator);
      interval.denominator = static_cast<std::uint32_t>(std::lround(rate_hz * kDenominator));
      if (const int error = device.control(VIDIOC_S_PARM, &set); error != 0) {
        return failure(device.node(), "cannot be set to that frame rate", error);
      }
    }
    if (!has_rate || std::abs(perSecond(interval) / rate_hz - 1.0) > kTolerance) {
      return Error{
          Error::Code::Incompatible,
          fmt::format("v4l2: {} has no {:g} frames per second at {} x {}; it has: {}",
                      device.node(), rate_hz, layout.width, layout.height,
                      frameRatesOf(device, layout.format.fourcc, {layout.width, layout.height}))};
    }
  }
  const double now_hz = has_rate ? perSecond(interval) : 0.0;
  return now_hz > 0.0 ? (1.0 / now_hz) * second : 0_s;
}

}  // namespace toftwin::drivers::v4l2
