// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string_view>

namespace toftwin {

/// Whether a facade, through which programs that know nothing of toftwin see a source, is there.
enum class FacadeState : std::uint8_t {
  Unknown = 0,  ///< a state that this program does not know
  Running = 1,
  Booting = 2,   ///< nobody answers yet, as configured
  NotThere = 3,  ///< its port is in use, say, or the daemon was built without it
};

inline std::string_view nameOf(FacadeState state) {
  switch (state) {
    case FacadeState::Running:
      return "running";
    case FacadeState::Booting:
      return "booting";
    case FacadeState::NotThere:
      return "not there";
    case FacadeState::Unknown:
      break;
  }
  return "unknown";
}

}  // namespace toftwin
