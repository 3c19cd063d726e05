// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

#include "tools/cli/doctor_checks.h"

/// What of the system keeps cameras from working: USB, network and permissions. Read from /sys,
/// /proc and /etc; nothing is changed, and nobody needs to be root. `root` stands for "/" in the
/// tests.
namespace toftwin::cli {

/// The cameras on USB: slow links, no driver, no permission.
std::vector<Finding> checkUsbCameras(const std::filesystem::path& root);
/// Whether cameras on one bus need more than it has.
Finding checkUsbShares(const std::filesystem::path& root);
/// Whether our udev rules are installed; asked for where there are cameras that need them.
Finding checkUdevRules(const std::filesystem::path& root);
/// What the kernel lends to USB transfers of all cameras together.
Finding checkUsbMemory(const std::filesystem::path& root);
/// Nodes of V4L2 cameras that may not be opened.
std::vector<Finding> checkVideoNodes(const std::filesystem::path& root);
/// The largest receive buffer that a GigE Vision stream gets.
Finding checkSocketBuffers(const std::filesystem::path& root);
/// Each network card with a cable in: its speed and its largest packet.
std::vector<Finding> checkEthernet(const std::filesystem::path& root);
/// Interfaces that drop packets of cameras of another network (reverse-path filter).
Finding checkReversePath(const std::filesystem::path& root);
/// A firewall that drops what a GigE Vision camera sends.
Finding checkFirewall(const std::filesystem::path& root);

/// All of the above.
std::vector<Finding> checkSystem(const std::filesystem::path& root = "/");

}  // namespace toftwin::cli
