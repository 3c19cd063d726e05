// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>

namespace toftwin {

/// Three numbers; metres where it is a place. The component type is float in the tracer's inner
/// loop and double everywhere else.
template <class T>
struct Vec3 {
  T x{}, y{}, z{};

  constexpr bool operator==(const Vec3&) const = default;
  friend constexpr Vec3 operator+(Vec3 a, Vec3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
  friend constexpr Vec3 operator-(Vec3 a, Vec3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
  friend constexpr Vec3 operator-(Vec3 a) { return {-a.x, -a.y, -a.z}; }
  friend constexpr Vec3 operator*(Vec3 a, T s) { return {a.x * s, a.y * s, a.z * s}; }
  friend constexpr Vec3 operator*(T s, Vec3 a) { return a * s; }
  friend constexpr Vec3 operator/(Vec3 a, T s) { return {a.x / s, a.y / s, a.z / s}; }
};
using Vec3d = Vec3<double>;
using Vec3f = Vec3<float>;

/// The three numbers of a file or a message as one.
template <class T>
constexpr Vec3<T> vec3Of(const std::array<T, 3>& v) {
  return {v[0], v[1], v[2]};
}

template <class T>
constexpr T dot(Vec3<T> a, Vec3<T> b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class T>
constexpr Vec3<T> cross(Vec3<T> a, Vec3<T> b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
template <class T>
T norm(Vec3<T> a) {
  return std::sqrt(dot(a, a));
}
template <class T>
Vec3<T> normalised(Vec3<T> a) {
  return a / norm(a);
}

/// The frames of reference. Camera: x right, y down, z along the optical axis, origin in the pinhole.
struct World {};
struct Camera {};
struct Emitter {};
struct Board {};
struct Object {};

/// A place, in metres, in frame `In`.
template <class In>
struct Point {
  Vec3d m;
  constexpr bool operator==(const Point&) const = default;
};

/// A direction, in frame `In`; unit length unless said otherwise.
template <class In>
struct Direction {
  Vec3d v;
  constexpr bool operator==(const Direction&) const = default;
};

/// A rigid motion that takes coordinates in `From` to coordinates in `To`; named `to_from_from`,
/// as in `world_from_camera`. The rotation is a unit quaternion (w, x, y, z).
template <class To, class From>
struct Transform {
  std::array<double, 4> rotation_wxyz{1.0, 0.0, 0.0, 0.0};
  Vec3d translation_m{};

  constexpr bool operator==(const Transform&) const = default;

  [[nodiscard]] Vec3d rotate(Vec3d v) const {
    const Vec3d q{rotation_wxyz[1], rotation_wxyz[2], rotation_wxyz[3]};
    const Vec3d t = 2.0 * cross(q, v);
    return v + rotation_wxyz[0] * t + cross(q, t);
  }
  friend Point<To> operator*(const Transform& t, Point<From> p) {
    return {t.rotate(p.m) + t.translation_m};
  }
  friend Direction<To> operator*(const Transform& t, Direction<From> d) { return {t.rotate(d.v)}; }

  [[nodiscard]] Transform<From, To> inverse() const {
    Transform<From, To> result;
    result.rotation_wxyz = {rotation_wxyz[0], -rotation_wxyz[1], -rotation_wxyz[2], -rotation_wxyz[3]};
    result.translation_m = -result.rotate(translation_m);
    return result;
  }
};

template <class A, class B, class C>
Transform<A, C> operator*(const Transform<A, B>& a_from_b, const Transform<B, C>& b_from_c) {
  const auto& p = a_from_b.rotation_wxyz;
  const auto& q = b_from_c.rotation_wxyz;
  Transform<A, C> a_from_c;
  a_from_c.rotation_wxyz = {p[0] * q[0] - p[1] * q[1] - p[2] * q[2] - p[3] * q[3],
                            p[0] * q[1] + p[1] * q[0] + p[2] * q[3] - p[3] * q[2],
                            p[0] * q[2] - p[1] * q[3] + p[2] * q[0] + p[3] * q[1],
                            p[0] * q[3] + p[1] * q[2] - p[2] * q[1] + p[3] * q[0]};
  a_from_c.translation_m = a_from_b.rotate(b_from_c.translation_m) + a_from_b.translation_m;
  return a_from_c;
}

/// Rotation by `angle_rad` about the unit vector `axis`, without translation.
template <class To, class From>
Transform<To, From> rotation(Vec3d axis, double angle_rad) {
  const double s = std::sin(angle_rad / 2.0);
  return {{std::cos(angle_rad / 2.0), axis.x * s, axis.y * s, axis.z * s}, {}};
}

}  // namespace toftwin
