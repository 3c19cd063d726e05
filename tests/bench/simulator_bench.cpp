// SPDX-License-Identifier: Apache-2.0
// Every goal of the simulator's speed and efficiency, measured in one run (docs/performance.md).
//   simulator_bench [PART …]        triangles, frames, rays, samplers, furnace, stages, errors, costs; default: all
//   simulator_bench furnace 60      at most so many seconds of processor time for each albedo in place of 1500
#include <fmt/format.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <charconv>
#include <string_view>

#include "daemon/memory.h"
#include "tests/bench/realtime.h"
#include "tests/bench/tracer.h"

namespace {

using namespace toftwin::bench;

Bars bars;
void add(const Bars& more) { bars.insert(bars.end(), more.begin(), more.end()); }

}  // namespace

int main(int argc, char** argv) {
  toftwin::daemon::keepFreedMemory();  // as toftwind does
  std::vector<std::string_view> parts{argv + 1, argv + argc};
  double furnace_s = 1500.0;
  std::erase_if(parts, [&](std::string_view part) {
    return std::from_chars(part.data(), part.data() + part.size(), furnace_s).ec == std::errc{};
  });
  for (const std::string_view part : parts) {
    constexpr std::string_view kParts[]{"triangles", "frames", "rays",   "samplers",
                                        "furnace",   "stages", "errors", "costs"};
    if (std::ranges::find(kParts, part) == std::end(kParts))
      giveUp(fmt::format("there is no part \"{}\"; there are: {}", part, fmt::join(kParts, ", ")));
  }
  const auto wants = [&](std::string_view name) {
    return parts.empty() || std::ranges::count(parts, name) > 0;
  };
  // What forks comes first: a child of a process whose threads have started has none of them.
  if (wants("triangles")) add(triangles());
  const Files files;
  if (wants("frames")) add(frames(files));
  if (wants("rays") || wants("samplers")) {
    const toftwin::sim::Scene room = orGiveUp(toftwin::sim::Scene::load(files.stillScene()));
    if (wants("rays")) add(compareWithEmbree(room));
    if (wants("samplers")) add(compareSamplers(room));
  }
  if (wants("furnace")) add(furnace(std::chrono::duration<double>{furnace_s}));
  const tbb::global_control two_threads{tbb::global_control::max_allowed_parallelism, 2};
  if (wants("stages")) stages(files);
  if (wants("errors")) add(errors(files));
  if (wants("costs")) add(costs(files));
  if (!bars.empty()) print(bars);
}
