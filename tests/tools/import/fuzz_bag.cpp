// SPDX-License-Identifier: Apache-2.0
// Any bytes as a bag and as messages: no crash, no hang, no memory that they do not have.
#include <sys/mman.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <string>

#include "protocol/foxglove/messages.h"
#include "protocol/foxglove/protobuf.h"
#include "protocol/ros/cdr.h"
#include "protocol/ros/ros1.h"
#include "tools/cli/import/import_source.h"

namespace {

template <class Message>
void readAs(std::span<const std::byte> bytes) {
  (void)toftwin::ros::fromCdr<Message>(bytes);
  (void)toftwin::ros::fromRos1<Message>(bytes);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::span bytes{reinterpret_cast<const std::byte*>(data), size};
  readAs<toftwin::ros::Image>(bytes);
  readAs<toftwin::ros::CameraInfo>(bytes);
  readAs<toftwin::ros::PointCloud2>(bytes);
  readAs<toftwin::ros::TFMessage>(bytes);
  toftwin::ros::CameraInfo info;
  (void)toftwin::foxglove::decodeProtobuf(bytes, info);
  toftwin::ros::PointCloud2 cloud;
  toftwin::ros::TFMessage transforms;
  (void)toftwin::foxglove::decode(bytes, cloud);
  (void)toftwin::foxglove::decode(bytes, transforms);
  (void)toftwin::foxglove::decodeProtobuf(bytes, transforms);
  const int file = ::memfd_create("fuzz.bag", MFD_CLOEXEC);
  if (file < 0 || ::write(file, data, size) != static_cast<ssize_t>(size)) std::abort();
  {
    auto source = toftwin::cli::openBagFrames("/proc/self/fd/" + std::to_string(file), {});
    for (int frames = 0; source && frames < 64 && (*source)->next(); ++frames) {
    }
  }
  ::close(file);
  return 0;
}
