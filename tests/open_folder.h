// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <initializer_list>
#include <string>

namespace toftwin::test {

/// Whether every other user may go through the folder and all above it.
inline bool othersMayEnter(const std::filesystem::path& folder) {
  using std::filesystem::perms;
  std::error_code none{};
  for (auto at = std::filesystem::absolute(folder); at != at.root_path(); at = at.parent_path())
    if ((std::filesystem::status(at, none).permissions() & perms::others_exec) == perms::none) return false;
  return true;
}

/// A new folder where another user may enter once its own permissions allow it: a private TMPDIR is passed over where
/// the system has a place for everybody. Tests that become another user still ask othersMayEnter() and skip if not.
inline std::filesystem::path makeOpenFolder(const std::string& name) {
  const std::string usual = testing::TempDir();
  std::string base = usual;
  for (const std::string& place : {usual, std::string{"/tmp/"}, std::string{"/var/tmp/"}, std::string{"/dev/shm/"}}) {
    const std::string folder = place.substr(0, place.size() - 1);
    if (::access(folder.c_str(), W_OK | X_OK) != 0 || !othersMayEnter(folder)) continue;
    base = place;
    break;
  }
  std::string pattern = base + name + "XXXXXX";
  return ::mkdtemp(pattern.data()) == nullptr ? std::filesystem::path{} : std::filesystem::path{pattern};
}

}  // namespace toftwin::test
