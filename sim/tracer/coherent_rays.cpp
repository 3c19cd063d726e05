// SPDX-License-Identifier: Apache-2.0
#include <emmintrin.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "sim/tracer/coherent_tree.h"
#include "sim/tracer/few_triangles.h"

namespace toftwin::sim {
namespace {

using Vec3Row = std::array<Lanes<float>, 3>;
constexpr float kInfinity = std::numeric_limits<float>::infinity();
/// After so many leaves a bundle is given up: Embree is sooner done.
constexpr int kMostLeaves = 32;
/// Of what is still to be searched: fifteen a level, of as many levels as trees can have.
constexpr std::size_t kDeepest = 128;
/// Slopes of bundles are below this.
constexpr float kSteepest = 4.0f;

/// Rays through one point: the axis that they go along, and between which slopes to it.
struct Bundle {
  std::size_t u, v, k;  ///< axes; the rays go along k
  float sign;           ///< of their direction along it
  std::array<float, 3> apex;
  float u_least, u_most, v_least, v_most;  ///< of u and of v over sign · k
  float pad;                               ///< boxes count as wider, by more than what is rounded
};

/// What a leaf's quadrangles are, seen from an apex.
struct Prepared {
  /// Of bc, ca, ab, cd, da: (p − q) × (p + q), of corners relative to the apex. Its product with a ray's direction says
  /// on which side of the edge the ray passes. From the other side it is the same number with the other sign, however
  /// it is rounded.
  std::array<Vec3Row, 5> edge;
  std::array<Vec3Row, 2> normal;      ///< of (a, b, c) and (a, c, d), of any length
  std::array<Lanes<float>, 2> level;  ///< normal · (a − apex)
  Lanes<float> blur;                  ///< for directions of length 1: more than what products with edges may be off
};

/// The largest lane. By halves: a loop from one to the next would be done one by one.
TOFTWIN_INLINE float largestOf(const Lanes<float>& all) {
  Lanes<float> values = all;
#pragma GCC unroll 4
  for (std::size_t half = kLaneCount / 2; half > 0; half /= 2) {
    for (std::size_t i = 0; i < half; ++i) values[i] = values[i] > values[i + half] ? values[i] : values[i + half];
  }
  return values[0];
}

/// Least and largest of the lanes that count.
TOFTWIN_VECTOR
void rangeOf(const Lanes<float>& values, const int* valid, float& least, float& most) {
  Lanes<float> down, up;
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    down[i] = valid[i] != 0 ? -values[i] : -kInfinity;
    up[i] = valid[i] != 0 ? values[i] : -kInfinity;
  }
  least = -largestOf(down);
  most = largestOf(up);
}

TOFTWIN_VECTOR
void slopesOf(const Lanes<float>& across, const Lanes<float>& along, float sign, Lanes<float>& slopes) {
  for (std::size_t i = 0; i < kLaneCount; ++i) slopes[i] = across[i] / (sign * along[i]);
}

/// False if the rays go too far apart. `size`: no coordinate of what counts is larger.
bool bundle(const std::array<float, 3>& apex, const Vec3Row& directions, const int* valid, float size, Bundle& out) {
  std::array<float, 3> least, most;
  for (std::size_t axis = 0; axis < 3; ++axis) rangeOf(directions[axis], valid, least[axis], most[axis]);
  // How far all of them go along an axis.
  const auto along = [&](std::size_t axis) { return std::max(least[axis], -most[axis]); };
  const auto across = [&](std::size_t axis) { return std::max(most[axis], -least[axis]); };
  out.k = along(0) > along(1) ? (along(0) > along(2) ? 0 : 2) : (along(1) > along(2) ? 1 : 2);
  out.u = (out.k + 1) % 3;
  out.v = (out.k + 2) % 3;
  if (!(kSteepest * along(out.k) > std::max(across(out.u), across(out.v)))) return false;
  out.sign = least[out.k] > 0.0f ? 1.0f : -1.0f;
  out.apex = apex;
  Lanes<float> slopes;
  slopesOf(directions[out.u], directions[out.k], out.sign, slopes);
  rangeOf(slopes, valid, out.u_least, out.u_most);
  slopesOf(directions[out.v], directions[out.k], out.sign, slopes);
  rangeOf(slopes, valid, out.v_least, out.v_most);
  out.pad = 1e-5f * (size + std::abs(apex[0]) + std::abs(apex[1]) + std::abs(apex[2]));
  return true;
}

/// Sixteen answers, −1 or 0, as bits.
unsigned bitsOf(const Lanes<int>& answers) {
  unsigned bits = 0;
  for (unsigned i = 0; i < kLaneCount; i += 4) {
    const __m128i four = _mm_load_si128(reinterpret_cast<const __m128i*>(answers.v + i));
    bits |= static_cast<unsigned>(_mm_movemask_ps(_mm_castsi128_ps(four))) << i;
  }
  return bits;
}

/// Which of the children the bundle may meet, and how near along its axis.
TOFTWIN_VECTOR
void meetBoxes(const CoherentTree::Node& node, const Bundle& bundle, float far, Lanes<int>& may_meet,
               Lanes<float>& near) {
  const Bundle b = bundle;
  const Lanes<float>&ul = node.lower[b.u], &uh = node.upper[b.u], &vl = node.lower[b.v], &vh = node.upper[b.v];
  const Lanes<float>&kl = node.lower[b.k], &kh = node.upper[b.k];
  const float pad = b.pad, au = b.apex[b.u], av = b.apex[b.v], ak = b.apex[b.k];
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    const float one = b.sign * (kl[i] - ak), other = b.sign * (kh[i] - ak);
    const float low = (one < other ? one : other) - pad, high = (one < other ? other : one) + pad;
    // Where a plane of slope s leaves the box, it is lowest or highest at one of its ends.
    const auto least = [&](float s) { return s > 0.0f ? s * low : s * high; };
    const auto most = [&](float s) { return s > 0.0f ? s * high : s * low; };
    const int is_met = (uh[i] - au + pad >= least(b.u_least)) & (ul[i] - au - pad <= most(b.u_most)) &
                       (vh[i] - av + pad >= least(b.v_least)) & (vl[i] - av - pad <= most(b.v_most)) & (high >= 0.0f) &
                       (low <= far);
    may_meet[i] = -is_met;
    near[i] = low;
  }
}

/// Which quadrangles of a leaf the bundle may meet.
TOFTWIN_VECTOR
void meetCorners(const CoherentTree::Leaf& leaf, const Bundle& bundle, float far, Lanes<int>& may_meet) {
  const Bundle b = bundle;
  const float pad = b.pad, au = b.apex[b.u], av = b.apex[b.v], ak = b.apex[b.k];
  Lanes<float> above_u, below_u, above_v, below_v, low, high;
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    above_u[i] = below_v[i] = above_v[i] = below_u[i] = high[i] = -kInfinity;
    low[i] = kInfinity;
  }
  for (std::size_t corner = 0; corner < 4; ++corner) {
    const Lanes<float>&cu = leaf.corner[corner][b.u], &cv = leaf.corner[corner][b.v], &ck = leaf.corner[corner][b.k];
    for (std::size_t i = 0; i < kLaneCount; ++i) {
      const float u = cu[i] - au, v = cv[i] - av, k = b.sign * (ck[i] - ak);
      const auto larger = [](float a, float c) { return a > c ? a : c; };
      above_u[i] = larger(u - b.u_least * k, above_u[i]);
      below_u[i] = larger(b.u_most * k - u, below_u[i]);
      above_v[i] = larger(v - b.v_least * k, above_v[i]);
      below_v[i] = larger(b.v_most * k - v, below_v[i]);
      low[i] = k < low[i] ? k : low[i];
      high[i] = larger(k, high[i]);
    }
  }
  const float wide = 2.0f * kSteepest * pad;
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    const int is_met = (above_u[i] >= -wide) & (below_u[i] >= -wide) & (above_v[i] >= -wide) & (below_v[i] >= -wide) &
                       (high[i] >= -pad) & (low[i] <= far + pad);
    may_meet[i] = -is_met;
  }
}

TOFTWIN_VECTOR
void prepare(const CoherentTree::Leaf& leaf, const Bundle& bundle, Prepared& prepared) {
  const float ax = bundle.apex[0], ay = bundle.apex[1], az = bundle.apex[2];
  const auto& [a, b, c, d] = leaf.corner;
  const auto edge = [&](const Vec3Row& p, const Vec3Row& q, Vec3Row& out) {
    for (std::size_t i = 0; i < kLaneCount; ++i) {
      const float ex = p[0][i] - q[0][i], ey = p[1][i] - q[1][i], ez = p[2][i] - q[2][i];
      const float sx = (p[0][i] - ax) + (q[0][i] - ax), sy = (p[1][i] - ay) + (q[1][i] - ay),
                  sz = (p[2][i] - az) + (q[2][i] - az);
      out[0][i] = ey * sz - ez * sy;
      out[1][i] = ez * sx - ex * sz;
      out[2][i] = ex * sy - ey * sx;
    }
  };
  edge(b, c, prepared.edge[0]);
  edge(c, a, prepared.edge[1]);
  edge(a, b, prepared.edge[2]);
  edge(c, d, prepared.edge[3]);
  edge(d, a, prepared.edge[4]);
  const auto plane = [&](const Vec3Row& p, const Vec3Row& q, Vec3Row& n, Lanes<float>& level) {
    for (std::size_t i = 0; i < kLaneCount; ++i) {
      const float ex = p[0][i] - a[0][i], ey = p[1][i] - a[1][i], ez = p[2][i] - a[2][i];
      const float fx = q[0][i] - a[0][i], fy = q[1][i] - a[1][i], fz = q[2][i] - a[2][i];
      n[0][i] = ey * fz - ez * fy;
      n[1][i] = ez * fx - ex * fz;
      n[2][i] = ex * fy - ey * fx;
      level[i] = n[0][i] * (a[0][i] - ax) + n[1][i] * (a[1][i] - ay) + n[2][i] * (a[2][i] - az);
    }
  };
  plane(b, c, prepared.normal[0], prepared.level[0]);
  plane(c, d, prepared.normal[1], prepared.level[1]);
  Lanes<float> extent{}, away{};
  const auto size = [](float v) { return v < 0.0f ? -v : v; };
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const Lanes<float>&pa = a[axis], &pb = b[axis], &pc = c[axis], &pd = d[axis];
    const float apex = bundle.apex[axis];
    for (std::size_t i = 0; i < kLaneCount; ++i) {
      extent[i] += size(pb[i] - pa[i]) + size(pc[i] - pa[i]) + size(pd[i] - pa[i]);
      away[i] += size(pa[i] - apex);
    }
  }
  for (std::size_t i = 0; i < kLaneCount; ++i)
    prepared.blur[i] = extent[i] * (1e-5f * (extent[i] + away[i]) + bundle.pad);
}

/// On which sides of a quadrangle's edges rays pass: the products with bc, ca, ab, cd, da.
struct Sides {
  Lanes<float> bc, ca, ab, cd, da;
};

TOFTWIN_INLINE float product(const Vec3Row& of, std::size_t j, const Vec3Row& direction, std::size_t i) {
  return of[0][j] * direction[0][i] + of[1][j] * direction[1][i] + of[2][j] * direction[2][i];
}

TOFTWIN_INLINE void findSides(const Prepared& prepared, std::size_t j, const Vec3Row& direction, Sides& sides) {
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    sides.bc[i] = product(prepared.edge[0], j, direction, i);
    sides.ca[i] = product(prepared.edge[1], j, direction, i);
    sides.ab[i] = product(prepared.edge[2], j, direction, i);
    sides.cd[i] = product(prepared.edge[3], j, direction, i);
    sides.da[i] = product(prepared.edge[4], j, direction, i);
  }
}

/// Whether three products are of one sign, as nearly as `off` tells.
TOFTWIN_INLINE bool areAlike(float a, float b, float c, float off) {
  const float ab = a < b ? a : b, ba = a < b ? b : a, least = ab < c ? ab : c, most = ba < c ? c : ba;
  return (least >= -off) | (most <= off);
}

struct Closest {
  Lanes<float> far, of_b, of_c, of_all;  ///< shares of the triangle's corners
  Lanes<unsigned> triangle;
  Lanes<int> is_met;
};

/// One half of a quadrangle: a ray meets it if it passes its edges, against a, b and c, on one side.
TOFTWIN_INLINE void meetHalf(const Vec3Row& normal, float level, std::size_t j, unsigned triangle,
                             const Lanes<float>& of_a, const Lanes<float>& of_b, const Lanes<float>& of_c,
                             float sign_of_c, const Vec3Row& direction, const float* near, Closest& closest) {
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    const float a = of_a[i], b = of_b[i], c = sign_of_c * of_c[i];
    const float distance = level / product(normal, j, direction, i);
    const bool is_met =
        areAlike(a, b, c, 0.0f) & (distance > near[i]) & (distance <= closest.far[i]) & (distance < kInfinity);
    closest.far[i] = is_met ? distance : closest.far[i];
    closest.of_b[i] = is_met ? b : closest.of_b[i];
    closest.of_c[i] = is_met ? c : closest.of_c[i];
    closest.of_all[i] = is_met ? a + b + c : closest.of_all[i];
    closest.triangle[i] = is_met ? triangle : closest.triangle[i];
    closest.is_met[i] = is_met ? -1 : closest.is_met[i];
  }
}

TOFTWIN_VECTOR
void meet(const Prepared& prepared, std::size_t j, unsigned triangle, const Vec3Row& direction, const float* near,
          Closest& closest) {
  Sides sides;
  findSides(prepared, j, direction, sides);
  int first = 0, second = 0;
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    first |= areAlike(sides.bc[i], sides.ca[i], sides.ab[i], 0.0f) ? 1 : 0;
    second |= areAlike(sides.cd[i], sides.da[i], -sides.ca[i], 0.0f) ? 1 : 0;
  }
  if (first != 0)
    meetHalf(prepared.normal[0], prepared.level[0][j], j, triangle, sides.bc, sides.ca, sides.ab, 1.0f, direction, near,
             closest);
  if (second != 0)
    meetHalf(prepared.normal[1], prepared.level[1][j], j, triangle + 1, sides.cd, sides.da, sides.ca, -1.0f, direction,
             near, closest);
}

TOFTWIN_VECTOR
void put(const Closest& closest, std::uint32_t object, RTCRayHit16& rays) {
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    const bool is_met = closest.is_met[i] != 0;
    const float per_all = 1.0f / closest.of_all[i];
    rays.ray.tfar[i] = is_met ? closest.far[i] : rays.ray.tfar[i];
    rays.hit.u[i] = is_met ? closest.of_b[i] * per_all : rays.hit.u[i];
    rays.hit.v[i] = is_met ? closest.of_c[i] * per_all : rays.hit.v[i];
    rays.hit.geomID[i] = is_met ? object : rays.hit.geomID[i];
    rays.hit.primID[i] = is_met ? closest.triangle[i] : rays.hit.primID[i];
  }
}

/// How far along the axis the rays go; those that go −∞ do not count.
TOFTWIN_VECTOR
float farthest(const Lanes<float>& far, const Lanes<float>& along, float sign) {
  Lanes<float> way;
  // Rays that do not count may have any direction.
  for (std::size_t i = 0; i < kLaneCount; ++i) way[i] = far[i] > -kInfinity ? far[i] * (sign * along[i]) : -kInfinity;
  return largestOf(way);
}

/// Shadow rays that end in an apex.
struct Shadows {
  Vec3Row start, direction;  ///< from the apex
  Lanes<float> length;       ///< at least that of the direction
  Lanes<int> is_lit;         ///< −1 of those of which nothing is known to be in the way
};

/// Which of them have their ends on two sides of a half's plane, and pass its edges on one side as nearly as can be
/// told.
TOFTWIN_VECTOR
bool mayHide(const CoherentTree::Leaf& leaf, const Prepared& prepared, std::size_t j, const Shadows& shadows,
             Lanes<int>& may_hide) {
  Sides sides;
  findSides(prepared, j, shadows.direction, sides);
  const auto& [ax, ay, az] = leaf.corner[0];
  // The apex is as far above the plane as −level says.
  const auto signOf = [](float level) { return level > 0.0f ? 1.0f : level < 0.0f ? -1.0f : 0.0f; };
  const float first = signOf(prepared.level[0][j]), second = signOf(prepared.level[1][j]), blur = prepared.blur[j];
  const Vec3Row &n = prepared.normal[0], &m = prepared.normal[1];
  Lanes<int> may;
  int any = 0;
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    const float x = shadows.start[0][i] - ax[j], y = shadows.start[1][i] - ay[j], z = shadows.start[2][i] - az[j];
    const float above = first * (n[0][j] * x + n[1][j] * y + n[2][j] * z);
    const float above_second = second * (m[0][j] * x + m[1][j] * y + m[2][j] * z);
    const float off = blur * shadows.length[i];
    const bool is_first = (above > 0.0f) & areAlike(sides.bc[i], sides.ca[i], sides.ab[i], off);
    const bool is_second = (above_second > 0.0f) & areAlike(sides.cd[i], sides.da[i], -sides.ca[i], off);
    may[i] = is_first | is_second ? shadows.is_lit[i] : 0;
    any |= may[i];
  }
  may_hide = may;
  return any != 0;
}

/// Asks the quadrangle's halves, as occludedFew() takes them, about the rays themselves. False if no ray is left.
bool takeHidden(const CoherentTree::Leaf& leaf, std::size_t j, const Lanes<int>& may_hide, Shadows& shadows,
                RTCRay16& rays) {
  const auto corner = [&](std::size_t which) {
    const Vec3Row& c = leaf.corner[which];
    return Vec3d{static_cast<double>(c[0][j]), static_cast<double>(c[1][j]), static_cast<double>(c[2][j])};
  };
  const FewTriangle halves[] = {fewTriangle(corner(0), corner(1), corner(2), 0, 0),
                                fewTriangle(corner(0), corner(2), corner(3), 0, 0)};
  occludedFew(halves, may_hide.v, rays);
  int any = 0;
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    shadows.is_lit[i] = rays.tfar[i] < 0.0f ? 0 : shadows.is_lit[i];
    any |= shadows.is_lit[i];
  }
  return any != 0;
}

/// Calls work(prepared, j) for the quadrangles of a leaf that the bundle may meet, until it says that that is enough.
template <class Work>
void forMet(const CoherentTree::Leaf& leaf, const Bundle& bundle, float far, const Work& work) {
  Lanes<int> may_meet;
  meetCorners(leaf, bundle, far, may_meet);
  unsigned bits = bitsOf(may_meet);
  if (bits == 0) return;
  Prepared prepared;
  prepare(leaf, bundle, prepared);
  for (; bits != 0; bits &= bits - 1) {
    if (!work(prepared, static_cast<std::size_t>(std::countr_zero(bits)))) return;
  }
}

/// All rays' start, if it is one.
TOFTWIN_VECTOR
bool startsAtOne(const int* valid, const RTCRay16& rays, Vec3Row& direction, std::array<float, 3>& apex) {
  Vec3Row start;
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    start[0][i] = rays.org_x[i], start[1][i] = rays.org_y[i], start[2][i] = rays.org_z[i];
    direction[0][i] = rays.dir_x[i], direction[1][i] = rays.dir_y[i], direction[2][i] = rays.dir_z[i];
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    float most;
    rangeOf(start[axis], valid, apex[axis], most);
    if (apex[axis] != most) return false;
  }
  return true;
}

/// The same of the place where they end, as nearly as can be told; `way`: the longest of them.
TOFTWIN_VECTOR
bool endsAtOne(const int* valid, const RTCRay16& rays, float reach, Shadows& shadows, std::array<float, 3>& apex,
               float& way) {
  Vec3Row end;
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    shadows.start[0][i] = rays.org_x[i], shadows.start[1][i] = rays.org_y[i], shadows.start[2][i] = rays.org_z[i];
    end[0][i] = rays.org_x[i] + rays.tfar[i] * rays.dir_x[i];
    end[1][i] = rays.org_y[i] + rays.tfar[i] * rays.dir_y[i];
    end[2][i] = rays.org_z[i] + rays.tfar[i] * rays.dir_z[i];
    shadows.is_lit[i] = valid[i];
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    float least, most;
    rangeOf(end[axis], valid, least, most);
    apex[axis] = (least + most) / 2.0f;
    if (!(most - least <= 2e-6f * (reach + std::abs(apex[axis])))) return false;
  }
  const float x = apex[0], y = apex[1], z = apex[2];
  const auto size = [](float v) { return v < 0.0f ? -v : v; };
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    const float dx = shadows.start[0][i] - x, dy = shadows.start[1][i] - y, dz = shadows.start[2][i] - z;
    shadows.direction[0][i] = dx, shadows.direction[1][i] = dy, shadows.direction[2][i] = dz;
    shadows.length[i] = size(dx) + size(dy) + size(dz);
  }
  float least;
  rangeOf(shadows.length, valid, least, way);
  return true;
}

}  // namespace

/// Goes to the leaves that the bundle may meet nearer than `far`, nearest first; false if those are too many.
template <class SomeBundle, class InLeaf>
bool CoherentTree::search(const SomeBundle& bundle, const float& far, const InLeaf& in_leaf) const {
  struct Place {
    std::uint32_t child;
    float near;
  };
  std::array<Place, kDeepest> places;
  std::size_t count = 0;
  places[count++] = {0, -kInfinity};
  int leaves = 0;
  while (count > 0) {
    const auto [child, nearest] = places[--count];
    if (nearest > far) continue;
    if ((child & kLeaf) != 0) {
      if (++leaves > kMostLeaves) return false;
      in_leaf(leaves_[child ^ kLeaf]);
      continue;
    }
    const Node& node = nodes_[child];
    Lanes<int> may_meet;
    Lanes<float> near;
    meetBoxes(node, bundle, far, may_meet, near);
    const std::size_t first = count;
    for (unsigned bits = bitsOf(may_meet); bits != 0; bits &= bits - 1) {
      const auto i = static_cast<std::size_t>(std::countr_zero(bits));
      std::size_t at = count++;
      for (; at > first && places[at - 1].near < near[i]; --at) places[at] = places[at - 1];
      places[at] = {node.child[i], near[i]};
    }
  }
  return true;
}

bool CoherentTree::intersect(const int* valid, std::uint32_t object, RTCRayHit16& rays) const {
  Vec3Row direction;
  std::array<float, 3> apex;
  Bundle of;
  if (!startsAtOne(valid, rays.ray, direction, apex) || !bundle(apex, direction, valid, reach_, of)) return false;
  Closest closest{};
  for (std::size_t i = 0; i < kLaneCount; ++i) closest.far[i] = valid[i] != 0 ? rays.ray.tfar[i] : -kInfinity;
  float far = farthest(closest.far, direction[of.k], of.sign);
  const bool is_done = search(of, far, [&](const Leaf& leaf) {
    forMet(leaf, of, far, [&](const Prepared& prepared, std::size_t j) {
      meet(prepared, j, leaf.triangle[j], direction, rays.ray.tnear, closest);
      return true;
    });
    far = farthest(closest.far, direction[of.k], of.sign);
  });
  if (!is_done) return false;
  put(closest, object, rays);
  return true;
}

bool CoherentTree::occluded(const int* valid, RTCRay16& rays) const {
  Shadows shadows;
  std::array<float, 3> apex;
  Bundle of;
  float way = 0.0f;
  if (!endsAtOne(valid, rays, reach_, shadows, apex, way) || !bundle(apex, shadows.direction, valid, reach_ + way, of))
    return false;
  Lanes<float> ends;
  for (std::size_t i = 0; i < kLaneCount; ++i) ends[i] = valid[i] != 0 ? 1.0f : -kInfinity;
  float far = farthest(ends, shadows.direction[of.k], of.sign);
  Lanes<float> before;
  std::copy_n(rays.tfar, kLaneCount, before.v);
  const bool is_done = search(of, far, [&](const Leaf& leaf) {
    forMet(leaf, of, far, [&](const Prepared& prepared, std::size_t j) {
      Lanes<int> may_hide;
      if (!mayHide(leaf, prepared, j, shadows, may_hide) || takeHidden(leaf, j, may_hide, shadows, rays)) return true;
      far = -kInfinity;
      return false;
    });
  });
  if (!is_done) std::copy_n(before.v, kLaneCount, rays.tfar);
  return is_done;
}

}  // namespace toftwin::sim
