// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/o3d303/wire/xmlrpc.h"

namespace toftwin::test {

/// The camera's XML-RPC objects without a network: parameters, one application, sessions, edit
/// mode.
class O3d303Device {
 public:
  using Parameters = std::map<std::string, std::string>;

  O3d303Device();

  o3d303::XmlRpcAnswer answer(std::string_view path, const o3d303::XmlRpcCall& call);
  /// Switched off and on: sessions end, what was not saved is forgotten.
  void restart();
  /// Everything as it left the factory, as after a repair.
  void reset();

  [[nodiscard]] bool isEditing() const { return is_editing_; }
  [[nodiscard]] bool isFreeRunning() const { return active_.application.at("TriggerMode") == "1"; }
  /// A number of the active application's imager.
  [[nodiscard]] double imager(const std::string& name) const {
    return std::stod(active_.imager.at(name));
  }
  [[nodiscard]] int saves() const { return saves_; }
  [[nodiscard]] int sessions() const { return sessions_; }

  Parameters device;

 private:
  struct Application {
    Parameters application, imager;
  };
  o3d303::XmlRpcAnswer main(const o3d303::XmlRpcCall& call);
  o3d303::XmlRpcAnswer inSession(std::string_view object, const o3d303::XmlRpcCall& call);
  o3d303::XmlRpcAnswer session(const o3d303::XmlRpcCall& call);
  o3d303::XmlRpcAnswer edit(const o3d303::XmlRpcCall& call);
  o3d303::XmlRpcAnswer application(const o3d303::XmlRpcCall& call);
  static o3d303::XmlRpcAnswer parameters(Parameters& all, const o3d303::XmlRpcCall& call);

  Application active_, edited_;
  std::optional<std::string> session_;
  bool is_editing_ = false, has_application_ = false;
  int saves_ = 0, sessions_ = 0;
};

}  // namespace toftwin::test
