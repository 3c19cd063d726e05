// SPDX-License-Identifier: Apache-2.0
#include "sim/tracer/bsdf/microfacet.h"

namespace toftwin::sim::bsdf {
namespace {

/// E(cos θ) = ∫ f cos of a facet lobe: the mean of F G₂/G₁ over visible normals, on a grid of strata. Those
/// in u are finer towards 1, u = 1 − (1 − t)⁴, where the distribution's long tail of steep facets is.
template <class Fresnel>
Reflectance reflectanceOf(const Facets& facets, const Fresnel& fresnel) {
  constexpr int kStrata = 64;
  return Reflectance::tabulate([&](double cosine) {
    const double c = std::max(cosine, 1e-4);
    const Vec3d from{std::sqrt(1.0 - c * c), 0.0, c};
    double sum = 0.0;
    for (int i = 0; i < kStrata; ++i) {
      const double rest = 1.0 - (i + 0.5) / kStrata, weight = 4.0 * rest * rest * rest / (kStrata * kStrata);
      for (int j = 0; j < kStrata; ++j) {
        const Vec3d m = facets.visibleNormal(from, 1.0 - rest * rest * rest * rest, (j + 0.5) / kStrata);
        const double along = dot(from, m), to_z = 2.0 * along * m.z - c;
        if (to_z > 0.0) sum += weight * fresnel(along) * facets.seen(c, to_z) / facets.seen(c);
      }
    }
    return sum;
  });
}

/// The lobe that gives back what another with reflectance E does not: ∫ of it is 1 − E(θ).
double remainder(const Reflectance& e, Vec3d from, Vec3d to) {
  return (1.0 - e.at(from.z)) * (1.0 - e.at(to.z)) / (std::numbers::pi * std::max(1e-9, 1.0 - e.mean()));
}

Vec3d halfway(Vec3d a, Vec3d b) { return normalised(a + b); }

/// A facet's reflection or a diffuse direction, by chance; the density is that of both together.
template <class Model>
Scattered sampleEither(const Model& model, double facet_share, double albedo, Vec3d from, Draw draw) {
  if (from.z <= 0.0) return {};
  Vec3d to;
  if (draw.choice < facet_share) {
    const Vec3d m = model.facets.visibleNormal(from, draw.u, draw.v);
    to = 2.0 * dot(from, m) * m - from;
  } else {
    to = cosineDirection(draw.u, draw.v);
  }
  if (to.z <= 0.0) return {};  // it would meet another facet: the remainder's lobe stands for it
  const double density = model.density(albedo, from, to);
  return {to, model.value(albedo, from, to) * to.z / density, density, 0.0};
}

}  // namespace

double Facets::value(Vec3d from, Vec3d to) const {
  if (from.z <= 0.0 || to.z <= 0.0) return 0.0;
  return distribution(halfway(from, to).z) * seen(from.z, to.z) / (4.0 * from.z * to.z);
}

double Facets::density(Vec3d from, Vec3d to) const {
  if (from.z <= 0.0 || to.z <= 0.0) return 0.0;
  return distribution(halfway(from, to).z) * seen(from.z) / (4.0 * from.z);
}

/// Heitz 2018, listing 1: stretched to the half sphere, a point of the disc seen, and back.
Vec3d Facets::visibleNormal(Vec3d from, double u, double v) const {
  const Vec3d stretched = normalised(Vec3d{alpha * from.x, alpha * from.y, from.z});
  const double length2 = stretched.x * stretched.x + stretched.y * stretched.y;
  const Vec3d x =
      length2 > 0.0 ? Vec3d{-stretched.y, stretched.x, 0.0} / std::sqrt(length2) : Vec3d{1.0, 0.0, 0.0};
  const Vec3d y = cross(stretched, x);
  const double r = std::sqrt(u), phi = 2.0 * std::numbers::pi * v;
  const double p = r * std::cos(phi), s = 0.5 * (1.0 + stretched.z);
  const double q = (1.0 - s) * std::sqrt(std::max(0.0, 1.0 - p * p)) + s * r * std::sin(phi);
  const Vec3d n = p * x + q * y + std::sqrt(std::max(0.0, 1.0 - p * p - q * q)) * stretched;
  return normalised(Vec3d{alpha * n.x, alpha * n.y, std::max(1e-12, n.z)});
}

RoughMetal RoughMetal::ofRoughness(double roughness) {
  const Facets facets{roughness * roughness};
  return {facets, reflectanceOf(facets, [](double) { return 1.0; })};
}

double RoughMetal::value(double albedo, Vec3d from, Vec3d to) const {
  if (from.z <= 0.0 || to.z <= 0.0) return 0.0;
  const double mean_fresnel = (1.0 + 20.0 * albedo) / 21.0, e = single.mean();
  const double repeated = mean_fresnel * mean_fresnel * e / (1.0 - mean_fresnel * (1.0 - e));
  return metalFresnel(dot(from, halfway(from, to)), albedo) * facets.value(from, to) +
         repeated * remainder(single, from, to);
}

double RoughMetal::density(double, Vec3d from, Vec3d to) const {
  const double share = facetShare(from);
  return share * facets.density(from, to) + (1.0 - share) * cosineDensity(to);
}

Scattered RoughMetal::sample(double albedo, Vec3d from, Draw draw) const {
  return sampleEither(*this, facetShare(from), albedo, from, draw);
}

RoughDielectric RoughDielectric::of(double roughness, double index) {
  const Facets facets{roughness * roughness};
  return {facets, index,
          reflectanceOf(facets, [=](double cosine) { return dielectricFresnel(cosine, index); })};
}

double RoughDielectric::value(double albedo, Vec3d from, Vec3d to) const {
  if (from.z <= 0.0 || to.z <= 0.0) return 0.0;
  return dielectricFresnel(dot(from, halfway(from, to)), index) * facets.value(from, to) +
         albedo * remainder(boundary, from, to);
}

double RoughDielectric::facetShare(double albedo, Vec3d from) const {
  const double gloss = boundary.at(from.z);
  return std::clamp(gloss / (gloss + albedo * (1.0 - gloss) + 1e-12), 0.1, 0.9);
}

double RoughDielectric::density(double albedo, Vec3d from, Vec3d to) const {
  const double share = facetShare(albedo, from);
  return share * facets.density(from, to) + (1.0 - share) * cosineDensity(to);
}

Scattered RoughDielectric::sample(double albedo, Vec3d from, Draw draw) const {
  return sampleEither(*this, facetShare(albedo, from), albedo, from, draw);
}

}  // namespace toftwin::sim::bsdf
