// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include <toftwin/result.h>

#include "drivers/rig/rig_file.h"

namespace toftwin::rig {

/// Whether this build can reach a rig at all.
bool hasModbus();

/// The controller's signals over Modbus TCP. A line that broke is made anew at the next call.
/// Errors name the signal: Disconnected (the line), Timeout (no answer in time), PermissionDenied
/// or InvalidArgument (an exception of the controller). One thread.
class Bus {
 public:
  static Result<std::unique_ptr<Bus>> open(const RigFile& rig);
  ~Bus();
  Bus(const Bus&) = delete;
  Bus& operator=(const Bus&) = delete;

  Result<double> read(const Signal& signal, std::string_view name);
  Result<bool> isSet(const Signal& signal, std::string_view name);
  Result<> write(const Signal& signal, double value, std::string_view name);
  Result<> set(const Signal& signal, bool value, std::string_view name);

 private:
  struct Line;
  explicit Bus(std::unique_ptr<Line> line);
  std::unique_ptr<Line> line_;
};

}  // namespace toftwin::rig
