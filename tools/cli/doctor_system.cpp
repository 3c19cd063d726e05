// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/doctor_system.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <fstream>
#include <map>
#include <optional>
#include <string>

#include "drivers/source.h"
#include "drivers/usb/cameras.h"

namespace toftwin::cli {
namespace {

namespace fs = std::filesystem;
using State = Finding::State;

constexpr long kUsbMemory_mb = 256;  // two Kinect v2: 2 × 3 transfers of several MB, and reserve
constexpr long kReceiveBuffer = 16 << 20;  // bytes: a tenth of a second of a full gigabit link
constexpr long kFastEthernet_mbit_s = 100, kGigabit_mbit_s = 1000, kJumboPacket = 9000;
constexpr const char* kRules = "60-toftwin.rules";

std::string lineOf(const fs::path& file) {
  std::string line;
  std::ifstream in{file};
  std::getline(in, line);
  return line;
}

std::optional<long> numberIn(const fs::path& file) {
  const std::string line = lineOf(file);
  long number = 0;
  const auto read = std::from_chars(line.data(), line.data() + line.size(), number);
  if (read.ec != std::errc{}) return std::nullopt;
  return number;
}

bool isThere(const fs::path& path) {
  std::error_code ignored;
  return fs::exists(path, ignored);
}

/// The names in a folder, sorted; none if it may not be read.
std::vector<std::string> namesIn(const fs::path& folder) {
  std::vector<std::string> names;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator{folder, ignored}) {
    names.push_back(entry.path().filename().string());
  }
  std::ranges::sort(names);
  return names;
}

bool mayOpen(const fs::path& node) {
  return ::faccessat(AT_FDCWD, node.c_str(), R_OK | W_OK, AT_EACCESS) == 0;
}

std::string remedyOf(std::string_view name) {
  for (const drivers::Driver& driver : drivers::allDrivers()) {
    if (driver.name == name) return std::string{driver.not_built};
  }
  return "this version of toftwin has no such driver";
}

Finding checkUsbCamera(const usb::Device& device, const fs::path& root) {
  const std::string about = usb::describe(device);
  if (std::string slow = usb::warningOf(device); !slow.empty()) {
    return {State::Warning, "usb camera", about, std::move(slow)};
  }
  const fs::path node = root / device.node.relative_path();
  if (isThere(node) && !mayOpen(node)) {
    return {State::Bad, "usb camera",
            fmt::format("{}: you may not open {}", about, device.node.string()),
            "install the udev rules (see below), then unplug the camera and plug it in again"};
  }
  if (device.camera->driver.empty()) return {State::Good, "usb camera", about, ""};
  const std::string remedy = remedyOf(device.camera->driver);
  if (!remedy.empty()) return {State::Warning, "usb camera", about, remedy};
  return {State::Good, "usb camera", about, ""};
}

}  // namespace

std::vector<Finding> checkUsbCameras(const fs::path& root) {
  std::vector<Finding> findings;
  for (const usb::Device& device : usb::list(root))
    findings.push_back(checkUsbCamera(device, root));
  return findings;
}

Finding checkUsbShares(const fs::path& root) {
  std::map<std::string, std::vector<std::string>> on_bus;
  std::map<std::string, double> links_mbit_s;
  for (const usb::Device& device : usb::list(root)) {
    const std::string bus = device.port.substr(0, device.port.find('-'));
    on_bus[bus].push_back(fmt::format("{} at {}", usb::nameOf(device), device.port));
    links_mbit_s[bus] += device.mbit_s;
  }
  for (const auto& [bus, cameras] : on_bus) {
    // What a camera sends is not known here, only that it is not more than its link carries.
    const long bus_mbit_s = numberIn(root / "sys/bus/usb/devices" / ("usb" + bus) / "speed").value_or(0);
    if (cameras.size() < 2 || links_mbit_s[bus] <= static_cast<double>(bus_mbit_s)) continue;
    return {
        State::Warning, "usb bus",
        fmt::format("{} share bus {}, and may be too much for it together", fmt::join(cameras, ", "), bus),
        "if frames are lost: plug one of them into a port of another controller (lsusb -t shows them), or "
        "choose a lower rate or a smaller image"};
  }
  return {State::Good, "usb bus", "no cameras share one that may be too slow for them together", ""};
}

Finding checkUdevRules(const fs::path& root) {
  for (const char* folder : {"etc/udev/rules.d", "usr/lib/udev/rules.d", "lib/udev/rules.d",
                             "usr/local/lib/udev/rules.d", "run/udev/rules.d"}) {
    if (isThere(root / folder / kRules)) {
      return {State::Good, "udev rules", fmt::format("/{}/{}", folder, kRules), ""};
    }
  }
  const bool is_needed = !usb::list(root).empty();
  return {
      is_needed ? State::Warning : State::Good, "udev rules",
      fmt::format("{} is not installed; USB cameras belong to root", kRules),
      is_needed
          ? fmt::format("sudo cp systemd/{} /etc/udev/rules.d/ && sudo udevadm control --reload && "
                        "sudo udevadm trigger",
                        kRules)
          : ""};
}

Finding checkUsbMemory(const fs::path& root) {
  const auto have = numberIn(root / "sys/module/usbcore/parameters/usbfs_memory_mb");
  if (!have) return {State::Good, "usb memory", "this kernel has no USB", ""};
  const std::string found = fmt::format("{} MB for USB transfers", *have);
  // 0 is no limit.
  if (*have == 0 || *have >= kUsbMemory_mb) return {State::Good, "usb memory", found, ""};
  if (usb::list(root).empty())
    return {State::Good, "usb memory", found + "; enough without cameras", ""};
  return {
      State::Warning, "usb memory", found + ": little for a fast camera, which may lose frames",
      fmt::format("echo {0} | sudo tee /sys/module/usbcore/parameters/usbfs_memory_mb; for good: "
                  "usbcore.usbfs_memory_mb={0} on the kernel's command line",
                  kUsbMemory_mb)};
}

std::vector<Finding> checkVideoNodes(const fs::path& root) {
  std::vector<Finding> findings;
  for (const std::string& name : namesIn(root / "sys/class/video4linux")) {
    const fs::path node = root / "dev" / name;
    if (!isThere(node) || mayOpen(node)) continue;
    findings.push_back({State::Bad, "video node",
                        fmt::format("/dev/{} ({}): you may not open it", name,
                                    lineOf(root / "sys/class/video4linux" / name / "name")),
                        "sudo usermod -aG video \"$USER\", then log in again"});
  }
  return findings;
}

Finding checkSocketBuffers(const fs::path& root) {
  const auto most = numberIn(root / "proc/sys/net/core/rmem_max");
  if (!most) return {State::Good, "net buffers", "not known", ""};
  const std::string found = fmt::format("at most {} kB for what a socket receives", *most / 1024);
  if (*most >= kReceiveBuffer) return {State::Good, "net buffers", found, ""};
  return {State::Warning, "net buffers", found + ": a GigE Vision camera's packets may be lost",
          fmt::format(
              "sudo sysctl -w net.core.rmem_max={0}; for good: echo net.core.rmem_max={0} | sudo "
              "tee /etc/sysctl.d/60-toftwin.conf",
              kReceiveBuffer)};
}

std::vector<Finding> checkEthernet(const fs::path& root) {
  std::vector<Finding> findings;
  const fs::path folder = root / "sys/class/net";
  for (const std::string& name : namesIn(folder)) {
    // Of a card, with a cable in; what is no card has no device.
    if (!isThere(folder / name / "device") || lineOf(folder / name / "operstate") != "up") continue;
    const long mbit_s = numberIn(folder / name / "speed").value_or(0),
               packet = numberIn(folder / name / "mtu").value_or(0);
    if (mbit_s <= 0 || packet <= 0) continue;  // a radio does not say
    const std::string found = fmt::format("{}: {} Mbit/s, packets of {} bytes", name, mbit_s, packet);
    if (mbit_s >= kFastEthernet_mbit_s && mbit_s < kGigabit_mbit_s) {
      findings.push_back({State::Good, "ethernet",
                          found + ": enough for an O3D303, too slow for GigE Vision at full rate", ""});
    } else if (mbit_s < kGigabit_mbit_s) {
      findings.push_back(
          {State::Warning, "ethernet", found + ": too slow for a camera's full rate",
           fmt::format("use a gigabit port and a cable with all four pairs (Cat 5e or better), then "
                       "sudo ethtool -s {} autoneg on",
                       name)});
    } else if (packet < kJumboPacket) {
      findings.push_back(
          {State::Good, "ethernet",
           fmt::format("{}; larger ones (sudo ip link set {} mtu {}, and a switch that passes them) spare "
                       "processor time",
                       found, name, kJumboPacket),
           ""});
    } else {
      findings.push_back({State::Good, "ethernet", found, ""});
    }
  }
  return findings;
}

Finding checkReversePath(const fs::path& root) {
  const fs::path folder = root / "proc/sys/net/ipv4/conf";
  // The kernel takes the stricter of "all" and the interface: 1 is strict, 2 is loose.
  const long all = numberIn(folder / "all/rp_filter").value_or(0);
  std::vector<std::string> strict;
  std::size_t wired = 0;
  for (const std::string& name : namesIn(folder)) {
    if (name == "all" || name == "default" || name == "lo") continue;
    ++wired;
    const long own = numberIn(folder / name / "rp_filter").value_or(0);
    if (std::max(all, own) == 1) strict.push_back(name);
  }
  // With one way into the machine, every packet comes the way that its answer would go.
  if (strict.empty() || wired < 2) {
    return {State::Good, "reverse path", "no interface drops packets for the way they come", ""};
  }
  std::string mend = all == 1 ? "sudo sysctl -w net.ipv4.conf.all.rp_filter=2" : "sudo sysctl -w";
  if (all != 1) {
    for (const std::string& name : strict)
      mend += fmt::format(" net.ipv4.conf.{}.rp_filter=2", name);
  }
  return {State::Warning, "reverse path",
          fmt::format("{} drop packets of cameras whose address is not of the interface's network",
                      fmt::join(strict, ", ")),
          mend + ", or give the camera an address of that network"};
}

Finding checkFirewall(const fs::path& root) {
  const auto warn = [](const char* which, const char* mend) {
    return Finding{
        State::Warning, "firewall",
        fmt::format("{} is active: what a GigE Vision camera sends by UDP, and a client of "
                    "another machine, may be dropped",
                    which),
        mend};
  };
  std::ifstream ufw{root / "etc/ufw/ufw.conf"};
  for (std::string line; std::getline(ufw, line);) {
    if (line == "ENABLED=yes") {
      return warn(
          "ufw",
          "sudo ufw allow in on INTERFACE (the camera's); sudo ufw allow 47800/tcp for clients");
    }
  }
  if (isThere(root / "run/firewalld")) {
    return warn(
        "firewalld",
        "sudo firewall-cmd --zone=trusted --add-interface=INTERFACE --permanent (the camera's) && "
        "sudo firewall-cmd --reload");
  }
  if (isThere(root / "etc/systemd/system/sysinit.target.wants/nftables.service")) {
    return warn("nftables",
                "sudo nft insert rule inet filter input iifname INTERFACE accept (the camera's; the table "
                "and chain of Debian's file, else those that sudo nft list chains shows); for good: the rule "
                "iifname INTERFACE accept in that chain of /etc/nftables.conf");
  }
  return {State::Good, "firewall", "neither ufw nor firewalld nor nftables is enabled", ""};
}

std::vector<Finding> checkSystem(const fs::path& root) {
  std::vector<Finding> findings = checkUsbCameras(root);
  findings.push_back(checkUsbShares(root));
  findings.push_back(checkUdevRules(root));
  findings.push_back(checkUsbMemory(root));
  for (Finding& finding : checkVideoNodes(root)) findings.push_back(std::move(finding));
  findings.push_back(checkSocketBuffers(root));
  for (Finding& finding : checkEthernet(root)) findings.push_back(std::move(finding));
  findings.push_back(checkReversePath(root));
  findings.push_back(checkFirewall(root));
  return findings;
}

}  // namespace toftwin::cli
