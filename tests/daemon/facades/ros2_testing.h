// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <vector>

#include "facade_testing.h"
#include "protocol/transport/memfd.h"
#include "ros2_reader.h"

/// A daemon with a facade ros2, and a program of ROS 2 beside it.
namespace toftwin::daemon::test {

using namespace toftwin::test;

inline constexpr const char* kImage = "sensor_msgs::msg::dds_::Image_";
inline constexpr const char* kInfo = "sensor_msgs::msg::dds_::CameraInfo_";
inline constexpr const char* kPoints = "sensor_msgs::msg::dds_::PointCloud2_";
inline constexpr const char* kTransforms = "tf2_msgs::msg::dds_::TFMessage_";
inline constexpr const char* kPose = "geometry_msgs::msg::dds_::PoseStamped_";

/// The frame's time stamp, and who says it.
inline std::int64_t readHeader(CdrReader& cdr, const std::string& frame = "cam_optical_frame") {
  const auto seconds = cdr.number<std::int32_t>();
  const auto nanoseconds = cdr.number<std::uint32_t>();
  EXPECT_LT(nanoseconds, 1'000'000'000U);
  EXPECT_EQ(cdr.text(), frame);
  return std::int64_t{seconds} * 1'000'000'000 + nanoseconds;
}
inline std::int64_t rosTimeOf(const Frame& frame) {
  return frame.moment.exposures.at(0).start.ns + frame.moment.clock.host_minus_device_ns;
}

struct ReadTransform {
  std::int64_t stamp_ns;
  std::string child;
  std::vector<double> numbers;  ///< translation, rotation x y z w
};
inline ReadTransform readTransform(Cdr message) {
  CdrReader cdr{std::move(message)};
  EXPECT_EQ(cdr.number<std::uint32_t>(), 1U);
  ReadTransform transform{};
  transform.stamp_ns = readHeader(cdr, "world");
  transform.child = cdr.text();
  transform.numbers = cdr.numbers<double>(7);
  EXPECT_LT(cdr.left(), 4U);
  return transform;
}
inline std::vector<double> numbersOf(const Transform<World, Camera>& pose) {
  const auto& [w, x, y, z] = pose.rotation_wxyz;
  const Vec3d& t = pose.translation_m;
  return {t.x, t.y, t.z, x, y, z, w};
}

/// A DDS domain that no other test of this machine has: tests run side by side, and those of one domain hear
/// each other. It is kept by an abstract Unix socket, which goes with the process.
class OwnDomain {
 public:
  OwnDomain() {
    for (int i = 0; i < kDomains; ++i) {
      number_ = 1 + (::getpid() + i) % kDomains;
      sockaddr_un address{.sun_family = AF_UNIX, .sun_path = {}};
      const std::string name = fmt::format("toftwin-test-dds-domain-{}", number_);
      std::memcpy(address.sun_path + 1, name.data(), name.size());
      const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + name.size());
      if (::bind(kept_.get(), reinterpret_cast<const sockaddr*>(&address), size) == 0) return;
    }
    ADD_FAILURE() << "all DDS domains from 1 to " << kDomains << " are taken by tests";
  }
  [[nodiscard]] int number() const { return number_; }

 private:
  static constexpr int kDomains = 90;
  transport::FileDescriptor kept_{::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0)};
  int number_ = 0;
};

class RunningRos2 : public RunningFacade {
 protected:
  std::string facadeTable(const std::string& keys) const {
    return fmt::format("[[facade]]\nkind = 'ros2'\nsource = 'cam'\ndomain = {}\n{}\n", domain_, keys);
  }
  void startRos2(const std::string& source_keys, const std::string& facade_keys = {}) {
    start(fmt::format("[[source]]\nname = 'cam'\n{}\n{}", source_keys, facadeTable(facade_keys)));
    program_.emplace(domain_);
  }
  /// Whether so many read what is written.
  static bool isRead(dds::DataWriter* writer, int readers = 1) {
    dds::PublicationMatchedStatus status;
    writer->get_publication_matched_status(status);
    return status.current_count >= readers;
  }
  static bool isWritten(dds::DataReader* reader, int writers = 1) {
    dds::SubscriptionMatchedStatus status;
    reader->get_subscription_matched_status(status);
    return status.current_count >= writers;
  }

  const OwnDomain own_domain_;
  const int domain_ = own_domain_.number();
  std::optional<RosProgram> program_;
};

}  // namespace toftwin::daemon::test
