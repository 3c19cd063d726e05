// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <optional>
#include <string>

namespace toftwin::daemon {

/// What systemd is told (sd_notify(3)). All of it does nothing where no systemd asks for it.
namespace notify {

void ready(const std::string& status);
void reloading();
void stopping();
void status(const std::string& text);
void watchdog();
/// How often `watchdog` must be called at the latest, if systemd wants it.
std::optional<std::chrono::microseconds> watchdogLimit();

}  // namespace notify
}  // namespace toftwin::daemon
