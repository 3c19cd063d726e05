// SPDX-License-Identifier: Apache-2.0
#include "free_port.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>

namespace toftwin::daemon::test {
namespace {

// A process that is forked goes on where this one is, so that both ask for the same ports.
TEST(FreePort, IsGivenToOneProcessAloneAndOnce) {
  const std::uint16_t before = freePort();
  EXPECT_NE(before, freePort());
  std::array<int, 2> told{}, may_end{};
  ASSERT_EQ(::pipe(told.data()) | ::pipe(may_end.data()), 0);
  const pid_t child = ::fork();
  if (child == 0) {
    const std::uint16_t port = freePort();
    char ignored = 0;
    const bool is_done =
        ::write(told[1], &port, sizeof port) == sizeof port && ::read(may_end[0], &ignored, 1) == 1;
    ::_exit(is_done ? 0 : 1);
  }
  std::uint16_t of_child = 0;
  EXPECT_EQ(::read(told[0], &of_child, sizeof of_child), ssize_t{sizeof of_child});
  EXPECT_GE(of_child, 20'000);
  EXPECT_NE(freePort(), of_child);
  EXPECT_EQ(::write(may_end[1], "x", 1), 1);
  int status = -1;
  EXPECT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_EQ(status, 0);
  for (const int end : {told[0], told[1], may_end[0], may_end[1]}) ::close(end);
}

}  // namespace
}  // namespace toftwin::daemon::test
