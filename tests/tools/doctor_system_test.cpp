// SPDX-License-Identifier: Apache-2.0
// What `toftwin doctor` says of the system, of systems that are folders.
#include "tools/cli/doctor_system.h"

#include <gmock/gmock.h>
#include <unistd.h>

#include <algorithm>

#include <fmt/format.h>

#include "tests/drivers/fake_root.h"

namespace toftwin::cli {
namespace {

using testing::HasSubstr;
using testing::Not;

/// The finding of that name, or a Good one that says so.
Finding findingOf(const std::vector<Finding>& findings, const std::string& check) {
  const auto found = std::ranges::find(findings, check, &Finding::check);
  return found == findings.end() ? Finding{Finding::State::Good, "none of " + check, "", ""}
                                 : *found;
}

TEST(DoctorOfTheSystem, FindsNothingWrongWithNothing) {
  const test::FakeRoot root;
  for (const Finding& finding : checkSystem(root.path())) {
    EXPECT_EQ(finding.state, Finding::State::Good) << finding.check << ": " << finding.found;
  }
}

TEST(DoctorOfTheSystem, SaysWhatAUsbCameraLacksAndTheCommandThatMendsIt) {
  const test::FakeRoot root;
  root.plugIn("1-4", "045e", "02c4", "480");
  root.write("sys/module/usbcore/parameters/usbfs_memory_mb", "16");
  auto findings = checkSystem(root.path());
  EXPECT_EQ(findingOf(findings, "usb camera").state, Finding::State::Warning);
  EXPECT_THAT(findingOf(findings, "usb camera").mend, HasSubstr("USB 3 camera on a link of 480"));
  EXPECT_EQ(findingOf(findings, "udev rules").state, Finding::State::Warning);
  EXPECT_THAT(findingOf(findings, "udev rules").mend,
              HasSubstr("sudo cp systemd/60-toftwin.rules"));
  EXPECT_EQ(findingOf(findings, "usb memory").state, Finding::State::Warning);
  EXPECT_THAT(findingOf(findings, "usb memory").mend, HasSubstr("echo 256 | sudo tee /sys/module"));
  root.write("etc/udev/rules.d/60-toftwin.rules", "");
  root.write("sys/module/usbcore/parameters/usbfs_memory_mb", "1000");
  findings = checkSystem(root.path());
  EXPECT_EQ(findingOf(findings, "udev rules").state, Finding::State::Good);
  EXPECT_EQ(findingOf(findings, "usb memory").state, Finding::State::Good);
}

TEST(DoctorOfTheSystem, SaysWhichCamerasAreTooManyForTheirBus) {
  const test::FakeRoot root;
  root.plugIn("2-1", "045e", "02c4", "5000");
  root.plugIn("1-1", "1d27", "0601", "480");
  EXPECT_EQ(findingOf(checkSystem(root.path()), "usb bus").state, Finding::State::Good);
  root.plugIn("1-2", "1d27", "0609", "480");
  const Finding shared = findingOf(checkSystem(root.path()), "usb bus");
  EXPECT_EQ(shared.state, Finding::State::Warning);
  EXPECT_THAT(shared.found, HasSubstr("share bus 1, and may be too much for it together"));
  EXPECT_THAT(shared.mend, HasSubstr("another controller"));
  root.write("sys/bus/usb/devices/usb1/speed", "480");
  EXPECT_EQ(findingOf(checkSystem(root.path()), "usb bus").state, Finding::State::Warning);
  root.write("sys/bus/usb/devices/usb1/speed", "5000");
  EXPECT_EQ(findingOf(checkSystem(root.path()), "usb bus").state, Finding::State::Good) << "faster than both links together";
}

TEST(DoctorOfTheSystem, SaysHowFastTheNetworkIs) {
  const test::FakeRoot root;
  const auto card = [&](const std::string& name, const char* speed, const char* packet, const char* state = "up") {
    for (const auto& [file, text] : {std::pair{"device/vendor", "0x8086"}, {"speed", speed}, {"mtu", packet}, {"operstate", state}})
      root.write("sys/class/net/" + name + "/" + file, text);
  };
  card("eth0", "1000", "1500");
  card("eth1", "-1", "1500", "down");
  root.write("sys/class/net/lo/mtu", "65536");
  auto findings = checkSystem(root.path());
  EXPECT_EQ(findingOf(findings, "ethernet").state, Finding::State::Good);
  EXPECT_THAT(findingOf(findings, "ethernet").found, HasSubstr("eth0: 1000 Mbit/s, packets of 1500 bytes; larger ones"));
  EXPECT_EQ(std::ranges::count(findings, "ethernet", &Finding::check), 1);
  card("eth0", "100", "1500");
  findings = checkSystem(root.path());
  EXPECT_EQ(findingOf(findings, "ethernet").state, Finding::State::Good) << "an O3D303 has no faster link";
  EXPECT_THAT(findingOf(findings, "ethernet").found, HasSubstr("too slow for GigE Vision at full rate"));
  card("eth0", "10", "1500");
  findings = checkSystem(root.path());
  EXPECT_EQ(findingOf(findings, "ethernet").state, Finding::State::Warning);
  EXPECT_THAT(findingOf(findings, "ethernet").mend, HasSubstr("sudo ethtool -s eth0 autoneg on"));
}

TEST(DoctorOfTheSystem, SaysWhatMayNotBeOpened) {
  const test::FakeRoot root;
  root.plugIn("2-1", "1d27", "0601", "480");
  std::filesystem::permissions(root.path() / "dev/bus/usb/002/005", std::filesystem::perms::none);
  root.write("sys/class/video4linux/video3/name", "a camera");
  root.write("dev/video3", "");
  std::filesystem::permissions(root.path() / "dev/video3", std::filesystem::perms::none);
  std::filesystem::permissions(root.path(), std::filesystem::perms{0755});
  if (!test::othersMayEnter(root.path())) GTEST_SKIP() << "no folder here that another user may enter";
  const auto me = ::geteuid();
  constexpr uid_t kNobody = 65'534;
  if (me == 0) {  // who may open everything
    ASSERT_EQ(::seteuid(kNobody), 0);
  }
  const auto findings = checkSystem(root.path());
  ASSERT_EQ(::seteuid(me), 0);
  EXPECT_EQ(findingOf(findings, "usb camera").state, Finding::State::Bad);
  EXPECT_EQ(findingOf(findings, "video node").state, Finding::State::Bad);
  EXPECT_THAT(findingOf(findings, "video node").mend, HasSubstr("usermod -aG video"));
}

TEST(DoctorOfTheSystem, SaysWhatDropsPackets) {
  const test::FakeRoot root;
  root.write("proc/sys/net/core/rmem_max", "212992");
  for (const char* name : {"all", "default", "lo", "eth0", "eth1"}) {
    root.write(fmt::format("proc/sys/net/ipv4/conf/{}/rp_filter", name), "0");
  }
  root.write("proc/sys/net/ipv4/conf/eth1/rp_filter", "1");
  root.write("etc/ufw/ufw.conf", "# switch\nENABLED=yes");
  auto findings = checkSystem(root.path());
  EXPECT_THAT(findingOf(findings, "net buffers").mend,
              HasSubstr("sysctl -w net.core.rmem_max=16777216"));
  EXPECT_EQ(findingOf(findings, "reverse path").state, Finding::State::Warning);
  EXPECT_THAT(findingOf(findings, "reverse path").mend,
              HasSubstr("net.ipv4.conf.eth1.rp_filter=2"));
  EXPECT_THAT(findingOf(findings, "reverse path").found, Not(HasSubstr("eth0")));
  EXPECT_THAT(findingOf(findings, "firewall").mend, HasSubstr("sudo ufw allow"));
  root.write("etc/ufw/ufw.conf", "ENABLED=no");
  root.write("etc/systemd/system/sysinit.target.wants/nftables.service", "");
  EXPECT_THAT(findingOf(checkSystem(root.path()), "firewall").mend, HasSubstr("sudo nft insert rule inet filter input"));
  std::filesystem::remove(root.path() / "etc/systemd/system/sysinit.target.wants/nftables.service");
  root.write("proc/sys/net/ipv4/conf/all/rp_filter", "2");  // loose wins over strict
  root.write("proc/sys/net/core/rmem_max", "33554432");
  root.write("etc/ufw/ufw.conf", "ENABLED=no");
  findings = checkSystem(root.path());
  for (const char* check : {"net buffers", "reverse path", "firewall"}) {
    EXPECT_EQ(findingOf(findings, check).state, Finding::State::Good) << check;
  }
}

}  // namespace
}  // namespace toftwin::cli
