// SPDX-License-Identifier: Apache-2.0
#include <toftwin/client.h>

#include <cstdlib>
#include <filesystem>

namespace toftwin {

std::string defaultSocketPath() {
  constexpr const char* system_folder = "/run/toftwin";
  std::string folder = system_folder;
  std::error_code ignored;
  if (const char* of_service = std::getenv("RUNTIME_DIRECTORY"); of_service && *of_service) {
    folder = of_service;
    folder = folder.substr(0, folder.find(':'));  // systemd lists several with colons between
  } else if (!std::filesystem::is_directory(system_folder, ignored)) {
    if (const char* of_user = std::getenv("XDG_RUNTIME_DIR"); of_user && *of_user) folder = of_user;
  }
  return folder + "/toftwin.sock";
}

}  // namespace toftwin
