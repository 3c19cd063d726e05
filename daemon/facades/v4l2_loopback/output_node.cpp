// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/v4l2_loopback/output_node.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <linux/videodev2.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <cstring>
#include <system_error>
#include <utility>

namespace toftwin::daemon::v4l2_loopback {
namespace {

template <class Call>
auto resultOf(Call call) {
  while (true) {
    const auto result = call();
    if (result >= 0) return result;
    if (errno != EINTR) return static_cast<decltype(result)>(-errno);
  }
}

class Kernel final : public System {
 public:
  int open(const std::string& node) override {
    return resultOf([&] { return ::open(node.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC); });
  }
  void close(int file) override { ::close(file); }
  int ioctl(int file, unsigned long request, void* argument) override {
    return resultOf([&] { return ::ioctl(file, request, argument); });
  }
  std::int64_t write(int file, std::span<const std::byte> bytes) override {
    return resultOf([&] { return ::write(file, bytes.data(), bytes.size()); });
  }
};

std::string lettersOf(std::uint32_t code) {
  std::string letters;
  for (unsigned shift = 0; shift < 32; shift += 8) {
    const auto c = static_cast<char>(code >> shift & 0x7FU);
    letters.push_back(c >= ' ' && c <= '~' ? c : '?');
  }
  return letters;
}

std::string adviceFor(int reason) {
  switch (reason) {
    case ENOENT:
    case ENXIO:
    case ENODEV:
      return "; load the module: modprobe v4l2loopback video_nr=NUMBER (Debian: apt-get install "
             "v4l2loopback-dkms)";
    case EACCES:
    case EPERM:
      return "; add the user to the group \"video\": usermod -aG video NAME";
    case EBUSY:
      return "; another program writes to it, or reads with another format: end that program";
    default:
      return "";
  }
}

}  // namespace

System& kernel() {
  static Kernel the_kernel;  // without state
  return the_kernel;
}

Error OutputNode::failure(const std::string& what, std::int64_t negative_errno) const {
  using Code = Error::Code;
  const int reason = static_cast<int>(-negative_errno);
  const Code code = reason == EACCES || reason == EPERM                       ? Code::PermissionDenied
                    : reason == ENOENT || reason == ENXIO || reason == ENODEV ? Code::NotFound
                    : reason == EBUSY                                         ? Code::Busy
                    : reason == EINVAL                                        ? Code::InvalidArgument
                                                                              : Code::Internal;
  return {code, fmt::format("{}: {}: {}{}", path_, what, std::generic_category().message(reason),
                            adviceFor(reason))};
}

OutputNode::OutputNode(OutputNode&& other) noexcept
    : system_(other.system_),
      path_(std::move(other.path_)),
      file_(std::exchange(other.file_, -1)),
      format_(other.format_) {}

OutputNode::~OutputNode() {
  if (file_ >= 0) system_.close(file_);
}

Result<OutputNode> OutputNode::open(System& system, const std::string& path) {
  OutputNode node{system, path, system.open(path)};
  if (node.file_ < 0) return node.failure("cannot be opened", node.file_);
  v4l2_capability can{};
  if (const int failed = system.ioctl(node.file_, VIDIOC_QUERYCAP, &can); failed < 0) {
    return Error{
        Error::Code::InvalidArgument,
        fmt::format("{}: is no video node; device must name one of v4l2loopback, such as /dev/video10",
                    path)};
  }
  const std::uint32_t caps =
      (can.capabilities & V4L2_CAP_DEVICE_CAPS) != 0 ? can.device_caps : can.capabilities;
  if ((caps & V4L2_CAP_VIDEO_OUTPUT) == 0) {
    const auto* driver = reinterpret_cast<const char*>(can.driver);
    return Error{
        Error::Code::InvalidArgument,
        fmt::format("{}: cannot be written to: it is of \"{}\", not of v4l2loopback, or another program "
                    "writes to it already",
                    path, std::string_view{driver, ::strnlen(driver, sizeof can.driver)})};
  }
  return node;
}

Result<Format> OutputNode::tryFormat(std::uint32_t code, std::uint32_t width, std::uint32_t height) {
  v4l2_format wish{};
  wish.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
  wish.fmt.pix.pixelformat = code;
  wish.fmt.pix.width = width;
  wish.fmt.pix.height = height;
  wish.fmt.pix.bytesperline = 2 * width;
  wish.fmt.pix.sizeimage = 2 * width * height;
  wish.fmt.pix.field = V4L2_FIELD_NONE;
  if (const int failed = system_.ioctl(file_, VIDIOC_S_FMT, &wish); failed < 0)
    return failure(fmt::format("does not take {} of {} x {}", lettersOf(code), width, height), failed);
  return Format{wish.fmt.pix.pixelformat, wish.fmt.pix.width, wish.fmt.pix.height};
}

/// The module says nothing when it does not know a format: it takes another one. Some of its versions, and
/// other drivers, refuse it; any other error is none of the format's.
Result<> OutputNode::setFormat(std::span<const std::uint32_t> codes, std::uint32_t width,
                               std::uint32_t height, double rate_hz) {
  format_.reset();
  std::vector<std::string> refused;
  for (const std::uint32_t code : codes) {
    const auto made = tryFormat(code, width, height);
    if (!made && made.error().code != Error::Code::InvalidArgument) return made.error();
    if (!made) {
      refused.push_back(fmt::format("{} is refused", lettersOf(code)));
      continue;
    }
    if (*made == Format{code, width, height}) {
      format_ = *made;
      break;
    }
    refused.push_back(fmt::format("{} became {} of {} x {}", lettersOf(code), lettersOf(made->code),
                                  made->width, made->height));
  }
  if (!format_) {
    return Error{
        Error::Code::Unsupported,
        fmt::format("{}: does not take images of {} x {}: {}; set format = \"auto\" or \"Y16\", or let the "
                    "module make larger images (its parameters max_width, max_height)",
                    path_, width, height, fmt::join(refused, ", "))};
  }
  if (rate_hz > 0.0) {
    constexpr double kMicro = 1e6;
    v4l2_streamparm parameters{};
    parameters.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
    parameters.parm.output.timeperframe = {static_cast<std::uint32_t>(kMicro),
                                           static_cast<std::uint32_t>(std::min(kMicro * rate_hz, 4e9))};
    system_.ioctl(file_, VIDIOC_S_PARM, &parameters);  // for information; a node without it works, too
  }
  return {};
}

Result<> OutputNode::write(std::span<const std::byte> image) {
  if (!format_ || image.size() != format_->bytes())
    return Error{Error::Code::Internal, fmt::format("{}: an image of another size than was set", path_)};
  const std::int64_t written = system_.write(file_, image);
  if (written < 0) return failure("cannot be written to", written);
  if (static_cast<std::size_t>(written) == image.size()) return {};
  return Error{Error::Code::Internal,
               fmt::format("{}: took {} of {} bytes of an image", path_, written, image.size())};
}

}  // namespace toftwin::daemon::v4l2_loopback
