// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <toftwin/client.h>

#include "tools/cli/arguments.h"
#include "tools/cli/export/atomic_file.h"
#include "tools/cli/export/export.h"

/// Options that several subcommands have, and what they mean.
namespace toftwin::cli {

/// --address and --timeout.
struct DaemonOptions {
  std::string address;
  double timeout_s = 5.0;
  void add(Arguments& args);
  /// The connection, or an Error Disconnected (whatever the reason) that says how to start a
  /// daemon.
  [[nodiscard]] Result<Client> connect() const;
  /// With what the environment says of this client: TOFTWIN_TOKEN, and for "tls:" TOFTWIN_AUTHORITIES, TOFTWIN_CERTIFICATE
  /// and TOFTWIN_KEY.
  [[nodiscard]] ClientOptions clientOptions() const;
  [[nodiscard]] std::chrono::milliseconds timeout() const {
    return std::chrono::milliseconds{static_cast<std::int64_t>(timeout_s * 1000.0)};
  }
};

/// --plane, --color and what else says how a frame becomes a file.
struct OutputOptions {
  std::string file;
  std::vector<std::string> plane_names;
  std::string depth_format;
  ExportOptions how;
  void add(Arguments& args, bool required);
  /// --format and what goes with formats of many frames.
  void addFormat(Arguments& args);
  /// Puts the names into `how`. An unknown extension or plane, and an option that means nothing for
  /// this kind of file, are errors of the command line, before any work.
  Result<> check();
  /// The same for these formats instead of the file's; an option must mean something for one of them.
  Result<> check(const std::vector<Format>& formats);
};

/// What is wrong with an address, or nothing.
std::string isAddress(const std::string& text);

/// The next frame, or Stopped soon after Ctrl-C.
Result<Frame> waitForFrame(Subscription& frames, std::chrono::milliseconds timeout);

/// "frame.png", or "frame-0007.png" where there are several.
std::string numbered(const std::string& file, std::uint64_t number, bool several);

/// A sorted list of the planes' names, for --help.
std::string planeNames();

}  // namespace toftwin::cli
