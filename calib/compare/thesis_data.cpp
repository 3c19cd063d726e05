// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/thesis_data.h"

#include <cstdlib>
#include <system_error>

namespace toftwin::compare {

std::optional<std::filesystem::path> findThesisData(const std::filesystem::path& given) {
  namespace fs = std::filesystem;
  std::error_code ignored;
  const auto inside = [&](const fs::path& folder) -> std::optional<fs::path> {
    for (const fs::path& candidate : {folder / "tof-thesis-2018", folder}) {
      if (fs::is_directory(candidate / "corner", ignored)) return candidate;
    }
    return std::nullopt;
  };
  if (!given.empty()) return inside(given);
  if (const char* named = std::getenv("TOFTWIN_DATA"); named != nullptr && *named != '\0') {
    return inside(named);
  }
  for (fs::path folder :
       {fs::current_path(ignored), fs::read_symlink("/proc/self/exe", ignored).parent_path()}) {
    for (; folder.has_relative_path(); folder = folder.parent_path()) {
      if (!fs::exists(folder / ".git", ignored)) continue;
      if (auto found = inside(folder.parent_path() / "shared" / "data")) return found;
    }
  }
  return std::nullopt;
}

}  // namespace toftwin::compare
