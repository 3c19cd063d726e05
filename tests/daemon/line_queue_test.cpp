// SPDX-License-Identifier: Apache-2.0
#include "daemon/line_queue.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <future>
#include <thread>

#include "../kept_log.h"
#include "daemon/peer.h"
#include "daemon/peer_log.h"
#include "fakes.h"

namespace toftwin::daemon {
namespace {

struct Pipe {
  int ends[2] = {-1, -1};
  Pipe() { EXPECT_EQ(::pipe2(ends, O_CLOEXEC), 0); }
  ~Pipe() {
    closeReader();
    ::close(ends[1]);
  }
  void closeReader() {
    if (ends[0] >= 0) ::close(std::exchange(ends[0], -1));
  }
  std::string read() const {
    std::array<char, 4096> text{};
    const ssize_t count = ::read(ends[0], text.data(), text.size());
    return {text.data(), count > 0 ? static_cast<std::size_t>(count) : 0};
  }
};

TEST(LineQueue, WritesLinesInTheirOrder) {
  const Pipe pipe;
  {
    LineQueue lines{toDescriptor(pipe.ends[1])};
    for (const char* text : {"one\n", "two\n", "three\n"}) lines.put({6, text});
  }
  EXPECT_EQ(pipe.read(), "one\ntwo\nthree\n");
}

TEST(LineQueue, NobodyWhoPutsALineWaitsForAFullPipeAndWhatIsLostIsCounted) {
  const Pipe pipe;
  LineQueue lines{toDescriptor(pipe.ends[1])};
  const std::string kilobyte(1024, 'x');
  for (int i = 0; i < 3000; ++i) lines.put({6, kilobyte});
  EXPECT_GT(lines.lost(), 1900u);
  EXPECT_LT(lines.lost(), 3000u) << "a megabyte waits";
}  // and its end does not wait for ever

TEST(LineQueue, TellsHowManyLinesWereLostOnceThereIsRoomAgain) {
  const Pipe pipe;
  LineQueue lines{toDescriptor(pipe.ends[1])};
  const std::string kilobyte(1023, 'x');
  for (int i = 0; i < 3000; ++i) lines.put({6, kilobyte + "\n"});
  const std::string expected = " lines of this log were lost: nobody took them in time\n";
  std::string all;
  for (int i = 0; i < 2000 && all.find(expected) == std::string::npos; ++i) all += pipe.read();
  EXPECT_NE(all.find(expected), std::string::npos);
}

TEST(LineQueue, APipeThatNobodyHasAnyMoreCostsItsLinesOnly) {
  Pipe pipe;
  pipe.closeReader();
  std::signal(SIGPIPE, SIG_IGN);  // as in toftwind
  {
    LineQueue lines{toDescriptor(pipe.ends[1])};
    for (int i = 0; i < 10; ++i) lines.put({6, "line\n"});
    for (int i = 0; i < 3000 && lines.lost() < 10; ++i) std::this_thread::sleep_for(std::chrono::milliseconds{10});
    EXPECT_EQ(lines.lost(), 10u);
  }
  std::signal(SIGPIPE, SIG_DFL);
}

TEST(LineQueue, AWriteThatIsStuckIsNotWaitedForAtItsEnd) {
  std::promise<void> unstuck;
  const std::shared_future<void> wait = unstuck.get_future().share();
  const auto began = std::chrono::steady_clock::now();
  {
    LineQueue lines{[wait](const LineQueue::Line&, const std::function<bool()>&) { return wait.wait(), true; }};
    lines.put({6, "line"});
  }
  EXPECT_LT(std::chrono::steady_clock::now() - began, std::chrono::seconds{20});
  unstuck.set_value();
}

struct KeptPeerLog {
  test::FakeClock clock;
  PeerLog log{clock};
  std::shared_ptr<toftwin::test::KeptLog> kept = std::make_shared<toftwin::test::KeptLog>();  // shared with spdlog
  toftwin::test::LoggingTo logging{kept};
};

TEST(PeerLog, TellsOfAPeerAFewLinesOfAKindAtOnceAndThenHowManyMoreThereWere) {
  KeptPeerLog k;
  const auto complain = [&](const std::string& peer) { k.log.warn(peer, "bad bytes of {}", peer); };
  for (int i = 0; i < 100; ++i) complain("a");
  EXPECT_EQ(k.kept->count("bad bytes of a"), 5);
  complain("b");
  k.log.warn("a", "something else");
  EXPECT_EQ(k.kept->count("bad bytes of b"), 1) << "another peer";
  EXPECT_EQ(k.kept->count("something else"), 1) << "another kind";
  k.clock.advance(PeerLog::kPause);
  complain("a");
  EXPECT_EQ(k.kept->count("bad bytes of a (95 more like this of a were not told)"), 1);
}

TEST(PeerLog, RemembersAFewPeersOnly) {
  KeptPeerLog k;
  for (int i = 0; i < 5000; ++i) k.log.warn(std::to_string(i), "bad bytes");
  EXPECT_LE(k.kept->count("bad bytes"), static_cast<int>(PeerLog::kMostKinds) + 5);
}

TEST(Peer, IsPrintedWithoutControlCharacters) {
  EXPECT_EQ(printable("a\x1b[31mred\nline\x7f\xc3"), "a?[31mred?line??");
  EXPECT_EQ(printable(std::string(200, 'a')).size(), 64u);
}

}  // namespace
}  // namespace toftwin::daemon
