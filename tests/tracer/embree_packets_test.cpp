// SPDX-License-Identifier: Apache-2.0
#include "sim/tracer/embree.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace toftwin::sim {
namespace {

/// A triangle across the axis, 2 m away, and sixteen rays along it of which only the first is valid. The
/// others are what paths that ended leave behind.
class EmbreePackets : public testing::TestWithParam<bool> {
 protected:
  EmbreePackets() {
    RTCGeometry triangle = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
    constexpr std::array kCorners{-1.0f, -1.0f, 2.0f, 3.0f, -1.0f, 2.0f, -1.0f, 3.0f, 2.0f};
    constexpr std::array kIndices{0u, 1u, 2u};
    std::ranges::copy(kCorners, static_cast<float*>(rtcSetNewGeometryBuffer(triangle, RTC_BUFFER_TYPE_VERTEX,
                                                                            0, RTC_FORMAT_FLOAT3, 12, 3)));
    std::ranges::copy(kIndices, static_cast<unsigned*>(rtcSetNewGeometryBuffer(
                                    triangle, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, 1)));
    rtcCommitGeometry(triangle);
    rtcAttachGeometry(scene_, triangle);
    rtcReleaseGeometry(triangle);
    rtcCommitScene(scene_);
    valid_[0] = -1;
    for (std::size_t i = 0; i < embree::kLanes; ++i) {
      RTCRay16& ray = rays_.ray;
      ray.org_x[i] = ray.org_y[i] = ray.org_z[i] = ray.time[i] = 0.0f;
      ray.dir_x[i] = ray.dir_y[i] = 0.0f;
      ray.dir_z[i] = i == 0 ? 1.0f : std::nanf("");
      ray.tnear[i] = 0.0f, ray.tfar[i] = 9.0f, ray.mask[i] = ~0u, ray.flags[i] = 0;
      rays_.hit.geomID[i] = rays_.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
    }
  }
  ~EmbreePackets() override { rtcReleaseScene(scene_), rtcReleaseDevice(device_); }
  void expectOthersAsTheyWere() const {
    for (std::size_t i = 1; i < embree::kLanes; ++i) {
      EXPECT_EQ(rays_.ray.tnear[i], 0.0f) << i;
      EXPECT_EQ(rays_.ray.tfar[i], 9.0f) << i;
      EXPECT_EQ(rays_.hit.geomID[i], RTC_INVALID_GEOMETRY_ID) << i;
    }
  }

  // Of processors without packets of sixteen, whatever this one has.
  RTCDevice device_ = rtcNewDevice("isa=avx2");
  RTCScene scene_ = rtcNewScene(device_);
  alignas(64) int valid_[embree::kLanes]{};
  RTCRayHit16 rays_{};
};

TEST_P(EmbreePackets, OnlyValidRaysMeetAnything) {
  embree::intersect(valid_, scene_, rays_, GetParam());
  EXPECT_FLOAT_EQ(rays_.ray.tfar[0], 2.0f);
  EXPECT_NE(rays_.hit.geomID[0], RTC_INVALID_GEOMETRY_ID);
  expectOthersAsTheyWere();
}

TEST_P(EmbreePackets, OnlyValidRaysAreOccluded) {
  embree::QueryContext context;
  embree::start(context);
  embree::occluded(valid_, scene_, rays_.ray, GetParam(), context);
  EXPECT_LT(rays_.ray.tfar[0], 0.0f);
  expectOthersAsTheyWere();
}

INSTANTIATE_TEST_SUITE_P(CoherentOrNot, EmbreePackets, testing::Bool());

}  // namespace
}  // namespace toftwin::sim
