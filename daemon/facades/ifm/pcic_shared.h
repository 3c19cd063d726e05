// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include <toftwin/result.h>

#include "daemon/facades/ifm/commands.h"
#include "drivers/o3d303/wire/bytes.h"
#include "drivers/o3d303/wire/schema.h"

namespace toftwin::daemon::ifm {

/// A frame: what each connection gets of it by its schema. Unsupported: it asks for what is not known.
using FrameWriter = std::function<Result<toftwin::o3d303::Bytes>(const toftwin::o3d303::Schema&)>;

/// Asynchronous errors that the camera tells its clients, by the vendor's numbers.
struct PcicError {
  static constexpr int kTooManyConnections = 100'000'001;
  static constexpr int kNoTriggerAllowed = 100'001'000;
  static constexpr int kTriggerOverrun = 110'001'006;
  static constexpr int kIlluminationTooHot = 110'004'000;
};

/// What a camera does for its port.
struct PcicHooks {
  /// Asks for a frame and says later with which error it was refused, 0: it comes.
  std::function<void(std::function<void(int)>)> trigger;
  /// What connections get that have asked for nothing, and its JSON.
  std::function<toftwin::o3d303::Schema()> default_schema;
  std::function<std::string()> default_schema_text = [] { return std::string{}; };
  /// Answers to questions about the device ("G?"), or nothing for a command that is not known.
  std::function<std::string(std::string_view command)> ask;
  /// How many there are, whenever that changed.
  std::function<void(std::size_t)> connections;
  /// Makes an application active and says later whether it could.
  std::function<void(int index, std::function<void(bool)>)> activate =
      [](int, const std::function<void(bool)>& done) { done(false); };
  /// The one that was published last, until the next is; empty: none was.
  std::function<FrameWriter()> last_frame = [] { return FrameWriter{}; };
  /// Which schemas a connection may ask for.
  ServesSchema serves = [](const toftwin::o3d303::Schema&) { return false; };
  /// What the command "I" asks for by a number; empty: nothing has it.
  std::function<toftwin::o3d303::Schema(int)> schema_of_image = [](int) { return toftwin::o3d303::Schema{}; };
  /// The error that lasts, which a connection is told that did not hear it begin; 0: none does.
  std::function<int()> lasting_error = [] { return 0; };
};

class PcicConnection;

/// What all connections of a port have in common, which outlives none of them: `is_alive` tells.
struct PcicShared {
  PcicHooks hooks;
  int last_error = 0;
  static constexpr int kWires = 2;
  std::array<bool, kWires> wires{};  ///< states of the camera's outputs, which nothing is tied to
  std::function<void(const std::shared_ptr<PcicConnection>&)> remove{};
  std::function<void(int)> tell_error{};
  const std::shared_ptr<bool> is_alive = std::make_shared<bool>(true);
};

}  // namespace toftwin::daemon::ifm
