// SPDX-License-Identifier: Apache-2.0
// One of the mesh readers, TOFTWIN_READER, on whatever libFuzzer makes of the corpus.
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "sim/meshes/formats.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace toftwin::sim::meshes;
  const auto mesh = TOFTWIN_READER({reinterpret_cast<const char*>(data), size}, "fuzzed", {});
  if (!mesh) return 0;
  for (const auto& triangle : mesh->mesh.triangles) {
    for (const std::uint32_t vertex : triangle) {
      if (vertex >= mesh->mesh.vertices.size()) std::abort();
    }
  }
  return 0;
}
