// SPDX-License-Identifier: Apache-2.0
#include "daemon/audit.h"

#include <fcntl.h>

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <cerrno>
#include <cstring>
#include <ctime>

#include "drivers/logging.h"

namespace toftwin::daemon {
namespace {

/// As a text of JSON: what is no printable ASCII, quote or backslash is escaped byte by byte.
std::string json(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x20 || byte >= 0x7F || c == '"' || c == '\\') {
      out += fmt::format("\\u{:04x}", byte);
    } else {
      out += c;
    }
  }
  return out + "\"";
}

std::string timeText(HostTime time) {
  const auto seconds = static_cast<std::time_t>(time.ns / 1'000'000'000);
  return fmt::format("{:%Y-%m-%dT%H:%M:%S}.{:03}Z", fmt::gmtime(seconds), time.ns / 1'000'000 % 1000);
}

}  // namespace

Result<std::shared_ptr<AuditLog>> AuditLog::open(const std::filesystem::path& file, const Clock& clock) {
  transport::FileDescriptor opened{::open(file.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC | O_NOCTTY, 0640)};
  if (!opened) {
    return Error{Error::Code::PermissionDenied,
                 fmt::format("{}: cannot be written: {}", file.string(), std::strerror(errno))};
  }
  auto log = std::make_shared<AuditLog>(clock);
  log->file_ = std::move(opened);
  log->lines_ = std::make_unique<LineQueue>(toDescriptor(log->file_.get()));
  return log;
}

void AuditLog::tell(const std::string& who, const std::string& source, const std::string& what,
                    const Result<>& outcome) noexcept try {
  const std::string failed = outcome ? "" : outcome.error().message;
  if (!lines_) {
    return log_.info(who, "audit: {}: {}: {}{}{}", who, source, what, outcome ? "" : "; not done: ", failed);
  }
  lines_->put({6, fmt::format("{{\"time\":{},\"who\":{},\"source\":{},\"what\":{},\"done\":{},\"why_not\":{}}}\n",
                              json(timeText(clock_.wall())), json(who), json(source), json(what), outcome.ok(),
                              json(failed))});
} catch (...) {
  logging::error("audit: no memory for a line");
}

}  // namespace toftwin::daemon
