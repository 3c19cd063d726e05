// SPDX-License-Identifier: Apache-2.0
// The arithmetic of the tracer, as plain loops over sixteen lanes that compilers turn into vector code:
// no branches, no calls that are not inlined, and lanes not in use compute harmless numbers.
#include "sim/tracer/shade.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "sim/tracer/phasor.h"
#include "sim/tracer/random.h"

namespace toftwin::sim {
namespace {

TOFTWIN_INLINE void addLanes(const float* __restrict from, float* __restrict to) {
  for (std::size_t i = 0; i < kLaneCount; ++i) to[i] += from[i];
}

TOFTWIN_INLINE void drawPairs(const Packet& packet, std::uint32_t dimension, bool is_even, Lanes<float>& u,
                              Lanes<float>& v) {
  if (is_even) {
    for (std::size_t i = 0; i < kLaneCount; ++i) {
      const RandomPair random = randomPair(packet.key(i), packet.index[i], dimension);
      u[i] = random.u;
      v[i] = random.v;
    }
  } else {
    for (std::size_t i = 0; i < kLaneCount; ++i) {
      const RandomPair random = independentPair(packet.key(i), packet.index[i], dimension);
      u[i] = random.u;
      v[i] = random.v;
    }
  }
}

}  // namespace

TOFTWIN_VECTOR
void drawPlaces(const Packet& packet, const PlacedEmitter& emitter, std::uint32_t dimension, Vec3Lanes& places) {
  const Vec3d at = emitter.position, across = emitter.across, along = emitter.along;
  if (!emitter.is_disc) {
    for (std::size_t i = 0; i < kLaneCount; ++i) {
      places.x[i] = at.x;
      places.y[i] = at.y;
      places.z[i] = at.z;
    }
    return;
  }
  Lanes<float> draw_u, draw_v;
  drawPairs(packet, dimension, packet.is_even, draw_u, draw_v);
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    // Uniform by area. Seen from one direction each place of the disc has the same share of I(γ), so
    // the estimate needs no further weight.
    const CosSin around = cosSinOfTurns(static_cast<double>(draw_v[i]));
    const float r = __builtin_sqrtf(draw_u[i]);
    const auto a = static_cast<double>(r * around.cos), b = static_cast<double>(r * around.sin);
    places.x[i] = at.x + across.x * a + along.x * b;
    places.y[i] = at.y + across.y * a + along.y * b;
    places.z[i] = at.z + across.z * a + along.z * b;
  }
}

TOFTWIN_VECTOR
void lightHits(const Packet& packet, const Hits& hits, const PlacedEmitter& emitter, const Vec3Lanes& places,
               DirectLight& light) {
  const Vec3d axis = emitter.axis;
  // The lobes that need no power function are slope · cos γ + level; the last loop does the others.
  const double slope = !emitter.is_isotropic && emitter.exponent == 1.0 ? 1.0 : 0.0, level = 1.0 - slope;
  const double limit = emitter.is_isotropic ? -2.0 : larger(emitter.cos_limit, 1e-300);
  const double peak = emitter.peak / std::numbers::pi, delay = emitter.delay_m;
  Lanes<double> cosines, lobe_cosines, weights;
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    const double lx = places.x[i] - hits.position.x[i], ly = places.y[i] - hits.position.y[i],
                 lz = places.z[i] - hits.position.z[i];
    const double squared = lx * lx + ly * ly + lz * lz, per_distance = perRoot(squared), distance = squared * per_distance;
    const double ux = lx * per_distance, uy = ly * per_distance, uz = lz * per_distance;
    const double nx = hits.normal.x[i], ny = hits.normal.y[i], nz = hits.normal.z[i];
    const double cosine = ux * nx + uy * ny + uz * nz;
    const double lobe_cosine = -(ux * axis.x + uy * axis.y + uz * axis.z);
    const double vx = -packet.direction.x[i], vy = -packet.direction.y[i], vz = -packet.direction.z[i];
    const double viewer_cosine = vx * nx + vy * ny + vz * nz;
    const float shape = shapeOf(hits.shape_a[i], hits.shape_b[i], ux * vx + uy * vy + uz * vz, cosine, viewer_cosine);
    weights[i] = static_cast<double>(packet.throughput[i] * hits.albedo[i] * shape) * cosine * peak *
                 (slope * lobe_cosine + level) * per_distance * per_distance;
    cosines[i] = cosine;
    lobe_cosines[i] = lobe_cosine;
    light.length[i] = packet.length[i] + hits.distance[i] + distance + delay;
  }
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    // Zero where there is no light; NaN fails the comparisons, too.
    const bool is_lit = (packet.valid[i] != 0) & (cosines[i] > 0.0) & (lobe_cosines[i] >= limit) & (weights[i] > 0.0);
    light.valid[i] = is_lit ? -1 : 0;
    light.weight[i] = is_lit ? static_cast<float>(weights[i]) : 0.0f;
    light.length[i] = is_lit ? light.length[i] : 0.0;
  }
  if (!emitter.pattern.empty()) {
    for (std::size_t i = 0; i < kLaneCount; ++i) {
      if (light.valid[i] != 0) light.weight[i] *= static_cast<float>(emitter.patternAt(lobe_cosines[i]));
    }
    return;
  }
  if (emitter.is_isotropic || emitter.exponent == 1.0 || emitter.exponent == 0.0) return;
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    if (light.valid[i] != 0) light.weight[i] *= static_cast<float>(std::pow(lobe_cosines[i], emitter.exponent));
  }
}

TOFTWIN_VECTOR
void setShadowRays(const Hits& hits, const Vec3Lanes& places, RTCRay16& rays) {
#pragma GCC ivdep
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    const float sx = hits.start.x[i], sy = hits.start.y[i], sz = hits.start.z[i];
    const double wx = places.x[i] - static_cast<double>(sx), wy = places.y[i] - static_cast<double>(sy),
                 wz = places.z[i] - static_cast<double>(sz);
    const double squared = wx * wx + wy * wy + wz * wz, per_way = perRoot(squared), way = squared * per_way;
    rays.org_x[i] = sx;
    rays.org_y[i] = sy;
    rays.org_z[i] = sz;
    rays.dir_x[i] = static_cast<float>(wx * per_way);
    rays.dir_y[i] = static_cast<float>(wy * per_way);
    rays.dir_z[i] = static_cast<float>(wz * per_way);
    // Rounding of origin and direction moves the ray's end by less than four units in the last place.
    rays.tfar[i] = static_cast<float>(way * (1.0 - 0x1p-22));
  }
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    rays.tnear[i] = 0.0f;
    rays.time[i] = 0.0f;
    rays.mask[i] = 0xffffffffu;
    rays.id[i] = 0;
    rays.flags[i] = 0;
  }
}

TOFTWIN_VECTOR
void bounce(const Hits& hits, std::uint32_t dimension, bool is_even, Packet& packet) {
  Lanes<float> draw_u, draw_v;
  drawPairs(packet, dimension, is_even & packet.is_even, draw_u, draw_v);
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    const CosSin around = cosSinOfTurns(static_cast<double>(draw_v[i]));
    const float r = __builtin_sqrtf(draw_u[i]);
    const auto x = static_cast<double>(r * around.cos), y = static_cast<double>(r * around.sin);
    // Unit length whatever the sine's error; never quite within the surface.
    const double z = std::sqrt(larger(1e-12, 1.0 - x * x - y * y));
    // Two unit vectors that complete the normal to a basis (Duff et al. 2017)
    const double nx = hits.normal.x[i], ny = hits.normal.y[i], nz = hits.normal.z[i];
    const double sign = std::copysign(1.0, nz), a = -1.0 / (sign + nz), b = nx * ny * a;
    const double dx = x * (1.0 + sign * nx * nx * a) + y * b + z * nx;
    const double dy = x * sign * b + y * (sign + ny * ny * a) + z * ny;
    const double dz = -x * sign * nx - y * ny + z * nz;
    const double vx = -packet.direction.x[i], vy = -packet.direction.y[i], vz = -packet.direction.z[i];
    const double viewer_cosine = vx * nx + vy * ny + vz * nz;
    const float shape = shapeOf(hits.shape_a[i], hits.shape_b[i], dx * vx + dy * vy + dz * vz, z, viewer_cosine);
    packet.throughput[i] *= hits.albedo[i] * shape;
    packet.length[i] += hits.distance[i];
    packet.direction.x[i] = dx;
    packet.direction.y[i] = dy;
    packet.direction.z[i] = dz;
  }
  packet.origin = hits.position;
  packet.start = hits.start;
}

TOFTWIN_VECTOR
void playRoulette(std::uint32_t dimension, float threshold, Packet& packet) {
  int any = 0;
  for (std::size_t i = 0; i < kLaneCount; ++i) any |= packet.valid[i] & (packet.throughput[i] < threshold ? 1 : 0);
  if (any == 0) return;
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    const float throughput = packet.throughput[i];
    const float draw = independentPair(packet.key(i), packet.index[i], dimension).u * threshold;
    const bool is_weak = throughput < threshold;
    packet.valid[i] = is_weak & !(draw < throughput) ? 0 : packet.valid[i];
    packet.throughput[i] = is_weak ? threshold : throughput;
  }
}

TOFTWIN_VECTOR
void setRays(const Packet& packet, RTCRayHit16& rays) {
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    rays.ray.org_x[i] = packet.start.x[i];
    rays.ray.org_y[i] = packet.start.y[i];
    rays.ray.org_z[i] = packet.start.z[i];
    rays.ray.tnear[i] = 0.0f;
    rays.ray.dir_x[i] = static_cast<float>(packet.direction.x[i]);
    rays.ray.dir_y[i] = static_cast<float>(packet.direction.y[i]);
    rays.ray.dir_z[i] = static_cast<float>(packet.direction.z[i]);
    rays.ray.time[i] = 0.0f;
    rays.ray.tfar[i] = std::numeric_limits<float>::infinity();
    rays.ray.mask[i] = 0xffffffffu;
    rays.ray.id[i] = 0;
    rays.ray.flags[i] = 0;
    rays.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
    rays.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
    rays.hit.primID[i] = 0;
    rays.hit.u[i] = rays.hit.v[i] = 0.0f;
  }
}

TOFTWIN_VECTOR
void addPhasors(const std::vector<double>& turns_per_metre, const std::vector<int>& orders,
                const std::vector<int>& last_orders, const Lanes<float>& weight, const Lanes<double>& length, LaneSums& sums) {
  addLanes(weight.v, sums.steady.v);
  for (std::size_t f = 0; f < turns_per_metre.size(); ++f) {
    const double turns = turns_per_metre[f];
    Lanes<float> cosine, sine, re, im;
#pragma GCC unroll 1
    for (std::size_t i = 0; i < kLaneCount; ++i) {
      const CosSin z = cosSinOfTurns(length[i] * turns);
      cosine[i] = z.cos;
      sine[i] = -z.sin;
      re[i] = weight[i] * z.cos;
      im[i] = weight[i] * -z.sin;
    }
    std::size_t term = f * orders.size();
    for (int n = 1;; ++n) {
      if (orders[term - f * orders.size()] == n) {
        addLanes(re.v, sums.re[term].v);
        addLanes(im.v, sums.im[term].v);
        if (++term == (f + 1) * orders.size() || n == last_orders[f]) break;
      }
      turnBy(cosine, sine, re, im);
    }
  }
}

TOFTWIN_VECTOR
void addGates(const PathFunctions& gates, const Lanes<float>& weight, const Lanes<double>& length, Lanes<float>& first,
              Lanes<float>& second) {
  const double per_step = 1.0 / gates.step.in(metre);
  const auto last = static_cast<double>(gates.first.size() - 1);
  const float *g1 = gates.first.data(), *g2 = gates.second.data();
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    const double at = length[i] * per_step;
    const bool is_within = at < last;
    const double inside = is_within ? at : 0.0;
    const auto below = static_cast<std::size_t>(inside);
    const auto share = static_cast<float>(inside - static_cast<double>(below));
    const float w = is_within ? weight[i] : 0.0f;
    first[i] += w * (g1[below] + share * (g1[below + 1] - g1[below]));
    second[i] += w * (g2[below] + share * (g2[below + 1] - g2[below]));
  }
}

}  // namespace toftwin::sim
