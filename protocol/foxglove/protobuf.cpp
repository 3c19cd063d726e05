// SPDX-License-Identifier: Apache-2.0
#include "protocol/foxglove/protobuf.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <limits>
#include <optional>

namespace toftwin::foxglove {
namespace {

using ros::ByteView;

Error malformed() { return {Error::Code::Malformed, "a message of Foxglove that is no whole Protocol Buffer"}; }

/// One member: its number, and its value as a number or as bytes.
struct Field {
  std::uint32_t number = 0;
  std::uint64_t value = 0;
  ByteView bytes;
};

class Fields {
 public:
  explicit Fields(ByteView bytes) : rest_(bytes) {}
  [[nodiscard]] bool isGood() const { return is_good_; }
  std::optional<Field> next() {
    if (rest_.empty() || !is_good_) return std::nullopt;
    const std::uint64_t key = varint();
    Field field;
    field.number = static_cast<std::uint32_t>(std::min<std::uint64_t>(key >> 3, std::numeric_limits<std::uint32_t>::max()));
    switch (key & 7) {
      case 0: field.value = varint(); break;
      case 1: field.bytes = take(8); break;
      case 2: field.bytes = take(varint()); break;
      case 5: field.bytes = take(4); break;
      default: is_good_ = false;  // groups, which nobody writes any more
    }
    if ((key & 7) == 1 || (key & 7) == 5) std::memcpy(&field.value, field.bytes.data(), field.bytes.size());
    return is_good_ ? std::optional{field} : std::nullopt;
  }

 private:
  std::uint64_t varint() {
    std::uint64_t value = 0;
    for (unsigned shift = 0; shift < 64 && !rest_.empty(); shift += 7) {
      const auto byte = static_cast<std::uint64_t>(rest_[0]);
      rest_ = rest_.subspan(1);
      value |= (byte & 0x7f) << shift;
      if (byte < 0x80) return value;
    }
    is_good_ = false;
    return 0;
  }
  ByteView take(std::uint64_t size) {
    if (size > rest_.size()) is_good_ = false;
    if (!is_good_) return {};
    const ByteView taken = rest_.first(size);
    rest_ = rest_.subspan(size);
    return taken;
  }

  ByteView rest_;
  bool is_good_ = true;
};

/// Calls `take` for each member.
template <class Take>
Result<> each(ByteView bytes, const Take& take) {
  Fields fields{bytes};
  while (const auto field = fields.next()) take(*field);
  return fields.isGood() ? Result<>{} : Result<>{malformed()};
}

std::string textOf(const Field& field) { return {reinterpret_cast<const char*>(field.bytes.data()), field.bytes.size()}; }
double doubleOf(std::uint64_t bits) { return std::bit_cast<double>(bits); }

/// What is damaged in a member's own members leaves them as they were.
ros::Time timeOf(ByteView bytes) {
  ros::Time time;
  (void)each(bytes, [&](const Field& field) {
    constexpr std::int64_t kMost = std::numeric_limits<std::int32_t>::max();
    if (field.number == 1) time.sec = static_cast<std::int32_t>(std::clamp(static_cast<std::int64_t>(field.value), -kMost, kMost));
    if (field.number == 2) time.nanosec = static_cast<std::uint32_t>(std::min<std::uint64_t>(field.value, 999'999'999));
  });
  return time;
}

/// Packed, or one after the other.
void append(std::vector<double>& to, const Field& field) {
  constexpr std::size_t kSize = sizeof(double);
  for (std::size_t at = 0; at + kSize <= field.bytes.size(); at += kSize) {
    std::uint64_t bits = 0;
    std::memcpy(&bits, field.bytes.data() + at, kSize);
    to.push_back(doubleOf(bits));
  }
}

ros::TransformStamped transformOf(ByteView bytes) {
  ros::TransformStamped one;
  (void)each(bytes, [&](const Field& field) {
    if (field.number == 1) one.header.stamp = timeOf(field.bytes);
    if (field.number == 2) one.header.frame_id = textOf(field);
    if (field.number == 3) one.child_frame_id = textOf(field);
    if (field.number != 4 && field.number != 5) return;
    auto& [t, q] = one.transform;
    // A member that is 0 is not written: w, too, is 0 then, and not 1 as in FlatBuffers.
    if (field.number == 5) q = {0.0, 0.0, 0.0, 0.0};
    double* const of_t[]{&t.x, &t.y, &t.z};
    double* const of_q[]{&q.x, &q.y, &q.z, &q.w};
    (void)each(field.bytes, [&](const Field& number) {
      if (field.number == 4 && number.number >= 1 && number.number <= 3) *of_t[number.number - 1] = doubleOf(number.value);
      if (field.number == 5 && number.number >= 1 && number.number <= 4) *of_q[number.number - 1] = doubleOf(number.value);
    });
  });
  return one;
}

}  // namespace

Result<> decodeProtobuf(ByteView bytes, ros::Image& image) {
  return each(bytes, [&](const Field& field) {
    const auto number = static_cast<std::uint32_t>(field.value);
    if (field.number == 1) image.header.stamp = timeOf(field.bytes);
    if (field.number == 7) image.header.frame_id = textOf(field);
    if (field.number == 2) image.width = number;
    if (field.number == 3) image.height = number;
    if (field.number == 4) image.encoding = textOf(field);
    if (field.number == 5) image.step = number;
    if (field.number == 6) image.data = field.bytes;
  });
}

Result<> decodeProtobuf(ByteView bytes, ros::CompressedImage& image) {
  return each(bytes, [&](const Field& field) {
    if (field.number == 1) image.header.stamp = timeOf(field.bytes);
    if (field.number == 4) image.header.frame_id = textOf(field);
    if (field.number == 2) image.data = field.bytes;
    if (field.number == 3) image.format = textOf(field);
  });
}

Result<> decodeProtobuf(ByteView bytes, ros::CameraInfo& info) {
  std::vector<double> k, r, p;
  auto read = each(bytes, [&](const Field& field) {
    const auto number = static_cast<std::uint32_t>(field.value);
    if (field.number == 1) info.header.stamp = timeOf(field.bytes);
    if (field.number == 9) info.header.frame_id = textOf(field);
    if (field.number == 2) info.width = number;
    if (field.number == 3) info.height = number;
    if (field.number == 4) info.distortion_model = textOf(field);
    if (field.number == 5) append(info.d, field);
    if (field.number == 6) append(k, field);
    if (field.number == 7) append(r, field);
    if (field.number == 8) append(p, field);
  });
  if (read && k.size() != info.k.size()) return malformed();
  if (!read) return read;
  std::ranges::copy(k, info.k.begin());
  if (r.size() == info.r.size()) std::ranges::copy(r, info.r.begin());
  if (p.size() == info.p.size()) std::ranges::copy(p, info.p.begin());
  return {};
}

Result<> decodeProtobuf(ByteView bytes, ros::TFMessage& transforms) {
  return each(bytes, [&](const Field& field) {
    if (field.number == 1) transforms.transforms.push_back(transformOf(field.bytes));
  });
}

}  // namespace toftwin::foxglove
