// SPDX-License-Identifier: Apache-2.0
#include "drivers/aravis/ptp.h"

#include <chrono>
#include <cstdint>
#include <memory>

#include "../kept_log.h"
#include "aravis_testing.h"
#include "drivers/aravis/connection.h"

namespace toftwin::drivers::aravis {
namespace {

using Emulated = toftwin::test::EmulatedGige;
using AravisPtp = test::Aravis;

TEST_F(AravisPtp, ACameraThatDoesNotTellWhatItsClockFollowsIsNamedOnceAndAskedEveryTenSeconds) {
  const auto log = std::make_shared<toftwin::test::KeptLog>();  // shared with spdlog
  const toftwin::test::LoggingTo kept{log};
  const auto connection = Connection::open(camera_.address());
  ASSERT_TRUE(connection.ok()) << connection.error().message;
  constexpr std::uint32_t kListening = 1, kSlave = 2, kNoStatus = 77;
  PtpWatch watch;
  const auto asksAfter = [&](std::chrono::seconds time, std::uint32_t status) {
    camera_.setReg(Emulated::kPtpStatus, status);
    camera_.setReg(Emulated::kPtpLatch, 0);
    watch.look(Features{connection->device()}, "it", SteadyTime{} + time);
    return camera_.reg(Emulated::kPtpLatch) == 1;
  };
  using std::chrono::seconds;
  EXPECT_TRUE(asksAfter(seconds{100}, kSlave));
  EXPECT_TRUE(asksAfter(seconds{110}, kNoStatus));
  EXPECT_FALSE(asksAfter(seconds{111}, kNoStatus));
  EXPECT_TRUE(asksAfter(seconds{120}, kNoStatus));
  EXPECT_TRUE(asksAfter(seconds{130}, kSlave));
  EXPECT_EQ(log->count("it: does not tell whether its clock follows the network's"), 1);
  EXPECT_EQ(log->count("PtpStatus is Slave"), 1) << "it follows the same as before";
  EXPECT_TRUE(asksAfter(seconds{140}, kListening));
  EXPECT_FALSE(asksAfter(seconds{140}, kListening));
  EXPECT_TRUE(asksAfter(seconds{141}, kListening));
}

}  // namespace
}  // namespace toftwin::drivers::aravis
