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

/// Rounds to single precision, away from the surface whose normal component is given: moved by one unit
/// in the last place first, twice what rounding can take back.
inline __attribute__((always_inline)) float roundedAway(double value, double normal) {
  return static_cast<float>(value + std::copysign(std::abs(value) * 0x1p-23, normal));
}

}  // namespace

TOFTWIN_VECTOR
void placeHits(const Packet& packet, Hits& hits) {
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    const double dx = packet.direction.x[i], dy = packet.direction.y[i], dz = packet.direction.z[i];
    double nx = hits.normal.x[i], ny = hits.normal.y[i], nz = hits.normal.z[i];
    const double t = hits.distance[i];
    double px = packet.origin.x[i] + t * dx, py = packet.origin.y[i] + t * dy, pz = packet.origin.z[i] + t * dz;
    const double above = nx * px + ny * py + nz * pz - hits.level[i];
    px += hits.onto.x[i] - above * nx;
    py += hits.onto.y[i] - above * ny;
    pz += hits.onto.z[i] - above * nz;
    hits.position.x[i] = px;
    hits.position.y[i] = py;
    hits.position.z[i] = pz;
    const double side = nx * dx + ny * dy + nz * dz > 0.0 ? -1.0 : 1.0;
    nx *= side;
    ny *= side;
    nz *= side;
    hits.normal.x[i] = nx;
    hits.normal.y[i] = ny;
    hits.normal.z[i] = nz;
    hits.start.x[i] = roundedAway(px + hits.inside.x[i] + hits.offset[i] * nx, nx);
    hits.start.y[i] = roundedAway(py + hits.inside.y[i] + hits.offset[i] * ny, ny);
    hits.start.z[i] = roundedAway(pz + hits.inside.z[i] + hits.offset[i] * nz, nz);
  }
}

TOFTWIN_VECTOR
void lightHits(const Packet& packet, const Hits& hits, const PlacedEmitter& emitter, const Vec3Lanes& places,
               DirectLight& light, RTCRay16& rays) {
  const Vec3d axis = emitter.axis;
  const double limit = emitter.is_isotropic ? -2.0 : std::max(emitter.cos_limit, 1e-300);
  const double slope = !emitter.is_isotropic && emitter.exponent == 1.0 ? 1.0 : 0.0;
  Lanes<double> lobe_cosine;
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    const double lx = places.x[i] - hits.position.x[i], ly = places.y[i] - hits.position.y[i],
                 lz = places.z[i] - hits.position.z[i];
    const double distance2 = lx * lx + ly * ly + lz * lz, distance = std::sqrt(distance2), per_distance = 1.0 / distance;
    const double ux = lx * per_distance, uy = ly * per_distance, uz = lz * per_distance;
    const double nx = hits.normal.x[i], ny = hits.normal.y[i], nz = hits.normal.z[i];
    const double cosine = ux * nx + uy * ny + uz * nz;
    const double gamma_cosine = -(ux * axis.x + uy * axis.y + uz * axis.z);
    lobe_cosine[i] = gamma_cosine;
    // The lobes that need no power function; the caller's loop below does the others.
    const double lobe = slope * gamma_cosine + (1.0 - slope);
    const double vx = -packet.direction.x[i], vy = -packet.direction.y[i], vz = -packet.direction.z[i];
    const double viewer_cosine = vx * nx + vy * ny + vz * nz;
    // sin α sin β cos Δφ, and sin α tan β = sin α sin β / cos β with cos β the larger cosine (material.h)
    const double sines = std::max(0.0, ux * vx + uy * vy + uz * vz - cosine * viewer_cosine);
    const double shape = static_cast<double>(hits.shape_a[i]) +
                         static_cast<double>(hits.shape_b[i]) * sines / std::max(std::max(cosine, viewer_cosine), 1e-9);
    const double weight = static_cast<double>(packet.throughput[i] * hits.albedo[i]) * shape * cosine *
                          (emitter.peak / std::numbers::pi) * lobe * per_distance * per_distance;
    // Any NaN fails the comparison, too.
    const bool is_lit = (packet.valid[i] != 0) & (cosine > 0.0) & (gamma_cosine >= limit) & (weight > 0.0);
    light.valid[i] = is_lit ? -1 : 0;
    light.weight[i] = static_cast<float>(is_lit ? weight : 0.0);
    light.length[i] = is_lit ? packet.length[i] + hits.distance[i] + distance : 0.0;
    const double sx = static_cast<double>(hits.start.x[i]), sy = static_cast<double>(hits.start.y[i]),
                 sz = static_cast<double>(hits.start.z[i]);
    const double wx = places.x[i] - sx, wy = places.y[i] - sy, wz = places.z[i] - sz;
    const double way = std::sqrt(wx * wx + wy * wy + wz * wz), per_way = 1.0 / way;
    rays.org_x[i] = hits.start.x[i];
    rays.org_y[i] = hits.start.y[i];
    rays.org_z[i] = hits.start.z[i];
    rays.tnear[i] = 0.0f;
    rays.dir_x[i] = static_cast<float>(wx * per_way);
    rays.dir_y[i] = static_cast<float>(wy * per_way);
    rays.dir_z[i] = static_cast<float>(wz * per_way);
    rays.time[i] = 0.0f;
    // Rounding of origin and direction moves the ray's end by less than four units in the last place.
    rays.tfar[i] = static_cast<float>(way * (1.0 - 0x1p-22));
    rays.mask[i] = 0xffffffffu;
    rays.id[i] = 0;
    rays.flags[i] = 0;
  }
  if (!emitter.is_isotropic && emitter.exponent != 1.0 && emitter.exponent != 0.0) {
    for (std::size_t i = 0; i < kLaneCount; ++i) {
      if (light.valid[i] != 0) light.weight[i] *= static_cast<float>(std::pow(lobe_cosine[i], emitter.exponent));
    }
  }
}

TOFTWIN_VECTOR
void bounce(const Hits& hits, std::uint64_t dimension, Packet& packet) {
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    const RandomPair random = randomPair(packet.key[i], dimension);
    const CosSin around = cosSinOfTurns(random.v);
    const double r = std::sqrt(random.u);
    const double x = r * static_cast<double>(around.cos), y = r * static_cast<double>(around.sin);
    // Unit length whatever the sine's error; never quite within the surface.
    const double z = std::sqrt(std::max(1e-12, 1.0 - x * x - y * y));
    // Two unit vectors that complete the normal to a basis (Duff et al. 2017)
    const double nx = hits.normal.x[i], ny = hits.normal.y[i], nz = hits.normal.z[i];
    const double sign = std::copysign(1.0, nz), a = -1.0 / (sign + nz), b = nx * ny * a;
    const double dx = x * (1.0 + sign * nx * nx * a) + y * b + z * nx;
    const double dy = x * sign * b + y * (sign + ny * ny * a) + z * ny;
    const double dz = -x * sign * nx - y * ny + z * nz;
    const double vx = -packet.direction.x[i], vy = -packet.direction.y[i], vz = -packet.direction.z[i];
    const double viewer_cosine = vx * nx + vy * ny + vz * nz;
    const double sines = std::max(0.0, dx * vx + dy * vy + dz * vz - z * viewer_cosine);
    const float shape = hits.shape_a[i] +
                        hits.shape_b[i] * static_cast<float>(sines / std::max(std::max(z, viewer_cosine), 1e-9));
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
  }
}

TOFTWIN_VECTOR
void addPhasors(const std::vector<double>& turns_per_metre, int harmonics, const Lanes<float>& weight,
                const Lanes<double>& length, LaneSums& sums) {
  for (std::size_t i = 0; i < kLaneCount; ++i) sums.steady[i] += weight[i];
  for (std::size_t f = 0; f < turns_per_metre.size(); ++f) {
    const double turns = turns_per_metre[f];
    Lanes<float> cosine, sine, re, im;
    for (std::size_t i = 0; i < kLaneCount; ++i) {
      const CosSin z = cosSinOfTurns(length[i] * turns);
      cosine[i] = z.cos;
      sine[i] = -z.sin;
      re[i] = weight[i] * z.cos;
      im[i] = weight[i] * -z.sin;
    }
    for (int n = 0; n < harmonics; ++n) {
      const std::size_t term = f * static_cast<std::size_t>(harmonics) + static_cast<std::size_t>(n);
      Lanes<float>&sum_re = sums.re[term], &sum_im = sums.im[term];
      for (std::size_t i = 0; i < kLaneCount; ++i) {
        sum_re[i] += re[i];
        sum_im[i] += im[i];
        const float next = re[i] * cosine[i] - im[i] * sine[i];
        im[i] = re[i] * sine[i] + im[i] * cosine[i];
        re[i] = next;
      }
    }
  }
}

}  // namespace toftwin::sim
