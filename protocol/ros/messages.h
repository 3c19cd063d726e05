// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

/// The messages of ROS that carry frames, as values. Each says once what its members are, in the order of the wire: what
/// reads them (cdr.h, ros1.h), writes them and describes them in a file (definition.h) goes by that. Names and types are
/// those of common_interfaces and geometry2 of ROS 2; ROS 1 has the same but for the header's sequence number.
namespace toftwin::ros {

/// Bytes of a message: those that it was read from, or that whoever writes it keeps.
using ByteView = std::span<const std::byte>;

struct Time {
  std::int32_t sec = 0;
  std::uint32_t nanosec = 0;

  static constexpr std::string_view kName = "builtin_interfaces/Time";
  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& v) {
    v("sec", self.sec);
    v("nanosec", self.nanosec);
  }
};

struct Header {
  Time stamp;
  std::string frame_id;

  static constexpr std::string_view kName = "std_msgs/Header";
  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& v) {
    v.beginHeader();
    v("stamp", self.stamp);
    v("frame_id", self.frame_id);
  }
};

struct Image {
  Header header;
  std::uint32_t height = 0, width = 0;
  std::string encoding;  ///< as in sensor_msgs/image_encodings.hpp
  std::uint8_t is_bigendian = 0;
  std::uint32_t step = 0;  ///< bytes of a row
  ByteView data;

  static constexpr std::string_view kName = "sensor_msgs/Image";
  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& v) {
    v("header", self.header);
    v("height", self.height);
    v("width", self.width);
    v("encoding", self.encoding);
    v("is_bigendian", self.is_bigendian);
    v("step", self.step);
    v("data", self.data);
  }
};

struct CompressedImage {
  Header header;
  std::string format;
  ByteView data;

  static constexpr std::string_view kName = "sensor_msgs/CompressedImage";
  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& v) {
    v("header", self.header);
    v("format", self.format);
    v("data", self.data);
  }
};

struct RegionOfInterest {
  std::uint32_t x_offset = 0, y_offset = 0, height = 0, width = 0;
  bool do_rectify = false;

  static constexpr std::string_view kName = "sensor_msgs/RegionOfInterest";
  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& v) {
    v("x_offset", self.x_offset);
    v("y_offset", self.y_offset);
    v("height", self.height);
    v("width", self.width);
    v("do_rectify", self.do_rectify);
  }
};

struct CameraInfo {
  Header header;
  std::uint32_t height = 0, width = 0;
  std::string distortion_model;
  std::vector<double> d;
  std::array<double, 9> k{}, r{};
  std::array<double, 12> p{};
  std::uint32_t binning_x = 0, binning_y = 0;
  RegionOfInterest roi;

  static constexpr std::string_view kName = "sensor_msgs/CameraInfo";
  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& v) {
    v("header", self.header);
    v("height", self.height);
    v("width", self.width);
    v("distortion_model", self.distortion_model);
    v("d", self.d);
    v("k", self.k);
    v("r", self.r);
    v("p", self.p);
    v("binning_x", self.binning_x);
    v("binning_y", self.binning_y);
    v("roi", self.roi);
  }
};

struct PointField {
  std::string name;
  std::uint32_t offset = 0;
  std::uint8_t datatype = 0;  ///< 1: int8, uint8, int16, uint16, int32, uint32, 7: float32, 8: float64
  std::uint32_t count = 0;

  static constexpr std::string_view kName = "sensor_msgs/PointField";
  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& v) {
    v("name", self.name);
    v("offset", self.offset);
    v("datatype", self.datatype);
    v("count", self.count);
  }
};

struct PointCloud2 {
  Header header;
  std::uint32_t height = 0, width = 0;
  std::vector<PointField> fields;
  bool is_bigendian = false;
  std::uint32_t point_step = 0, row_step = 0;
  ByteView data;
  bool is_dense = false;

  static constexpr std::string_view kName = "sensor_msgs/PointCloud2";
  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& v) {
    v("header", self.header);
    v("height", self.height);
    v("width", self.width);
    v("fields", self.fields);
    v("is_bigendian", self.is_bigendian);
    v("point_step", self.point_step);
    v("row_step", self.row_step);
    v("data", self.data);
    v("is_dense", self.is_dense);
  }
};

struct Vector3 {
  double x = 0.0, y = 0.0, z = 0.0;

  static constexpr std::string_view kName = "geometry_msgs/Vector3";
  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& v) {
    v("x", self.x);
    v("y", self.y);
    v("z", self.z);
  }
};

struct Quaternion {
  double x = 0.0, y = 0.0, z = 0.0, w = 1.0;

  static constexpr std::string_view kName = "geometry_msgs/Quaternion";
  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& v) {
    v("x", self.x);
    v("y", self.y);
    v("z", self.z);
    v("w", self.w);
  }
};

struct Transform {
  Vector3 translation;
  Quaternion rotation;

  static constexpr std::string_view kName = "geometry_msgs/Transform";
  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& v) {
    v("translation", self.translation);
    v("rotation", self.rotation);
  }
};

struct TransformStamped {
  Header header;
  std::string child_frame_id;
  Transform transform;  ///< takes coordinates of the child to those of header.frame_id

  static constexpr std::string_view kName = "geometry_msgs/TransformStamped";
  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& v) {
    v("header", self.header);
    v("child_frame_id", self.child_frame_id);
    v("transform", self.transform);
  }
};

struct TFMessage {
  std::vector<TransformStamped> transforms;

  static constexpr std::string_view kName = "tf2_msgs/TFMessage";
  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& v) {
    v("transforms", self.transforms);
  }
};

/// One of the above.
template <class T>
concept Message = requires { T::kName; };

}  // namespace toftwin::ros
