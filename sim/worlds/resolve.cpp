// SPDX-License-Identifier: Apache-2.0
#include <cstdlib>

#include "sim/worlds/world.h"

namespace toftwin::sim::worlds {

std::filesystem::path fileOf(const std::string& uri, std::string_view scheme, const std::filesystem::path& folder,
                             const std::vector<std::filesystem::path>& search) {
  std::error_code fault;
  constexpr std::string_view kFile = "file://";
  if (uri.starts_with(scheme)) {
    const std::filesystem::path wanted{uri.substr(scheme.size())};
    for (const std::filesystem::path& one : search) {
      if (std::filesystem::exists(one / wanted, fault)) return one / wanted;
    }
    return {};
  }
  const std::filesystem::path path{uri.starts_with(kFile) ? uri.substr(kFile.size()) : uri};
  const std::filesystem::path absolute = path.is_absolute() ? path : folder / path;
  return std::filesystem::exists(absolute, fault) ? absolute : std::filesystem::path{};
}

std::vector<std::filesystem::path> searchFolders(const std::vector<std::filesystem::path>& first,
                                                 std::initializer_list<const char*> variables, const std::filesystem::path& file) {
  std::vector<std::filesystem::path> all = first;
  for (const char* variable : variables) {
    const char* value = std::getenv(variable);  // NOLINT(concurrency-mt-unsafe): nobody sets it
    std::string_view rest = value == nullptr ? "" : value;
    while (!rest.empty()) {
      const std::size_t end = rest.find(':');
      if (const std::string_view one = rest.substr(0, end); !one.empty()) {
        all.emplace_back(one);
        all.push_back(std::filesystem::path{one} / "share");
      }
      rest = end == rest.npos ? "" : rest.substr(end + 1);
    }
  }
  std::filesystem::path above = std::filesystem::absolute(file).parent_path();
  for (int level = 0; level < 4 && above.has_relative_path(); ++level, above = above.parent_path()) {
    all.push_back(above);
    all.push_back(above / "models");
  }
  return all;
}

}  // namespace toftwin::sim::worlds
