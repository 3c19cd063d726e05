// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdlib>
#include <filesystem>

namespace toftwin::daemon::test {

/// A file of intervals measured on a real camera; empty where it is not there.
inline std::filesystem::path measuredIntervals(const char* name) {
  const char* named = std::getenv("TOFTWIN_DATA");
  for (const std::filesystem::path data :
       {named != nullptr ? named : "", TOFTWIN_SOURCE_DIR "/../shared/data",
        TOFTWIN_SOURCE_DIR "/../../shared/data"}) {
    auto file = data / "ifm-frame-timing" / name;
    if (std::filesystem::exists(file)) return std::filesystem::canonical(file);
  }
  return {};
}

}  // namespace toftwin::daemon::test
