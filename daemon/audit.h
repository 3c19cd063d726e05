// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include <toftwin/result.h>

#include "daemon/clock.h"
#include "daemon/line_queue.h"
#include "daemon/peer_log.h"
#include "protocol/transport/memfd.h"

namespace toftwin::daemon {

/// Who set what, and whether it was done: a line of JSON each, into a file of its own; where there is none, into the log, of
/// each client a few. Whoever tells it never waits for the disk. May be used from any thread.
class AuditLog {
 public:
  /// Into the log.
  explicit AuditLog(const Clock& clock) : clock_(clock) {}
  /// Appends to the file, which is made if it is not there, and readable by the daemon's user and group.
  static Result<std::shared_ptr<AuditLog>> open(const std::filesystem::path& file, const Clock& clock);

  void tell(const std::string& who, const std::string& source, const std::string& what, const Result<>& outcome) noexcept;

 private:
  const Clock& clock_;
  transport::FileDescriptor file_;
  std::unique_ptr<LineQueue> lines_;  ///< after the file: it ends first. Null: into the log
  PeerLog log_{clock_};
};

}  // namespace toftwin::daemon
