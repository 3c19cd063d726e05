// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/tracer/glass.h"
#include "sim/tracer/scene_impl.h"

namespace toftwin::sim {

// Rays against a whole scene: against what stands still, then against each moving object in its own frame,
// if they can meet its box. Embree's own instances cost more than the rays: a search of them cannot be asked
// to be coherent (of Embree 3.13 it may not end), and all that stands still would have to be one, too.

/// Closest hit of each ray whose `valid` is −1. Coherent: the rays start or end close together.
void castRays(const Scene::Impl& scene, const int* valid, RTCRayHit16& rays, bool coherent);
/// Sets `tfar` to −∞ for each valid ray that meets anything.
void castShadowRays(const Scene::Impl& scene, const int* valid, RTCRay16& rays, bool coherent);
/// The same in scenes with glass.
void castShadowRays(const Scene::Impl& scene, const int* valid, RTCRay16& rays, bool coherent, ThroughGlass& through);

}  // namespace toftwin::sim
