// SPDX-License-Identifier: Apache-2.0
// The path of a frame from the daemon to the applications, beside a bare TCP sender of the same
// bytes.
//   frame_path_bench [SECONDS]       SECONDS per measurement, default 10
// The daemon's part (hub, sessions, sockets) and each client are processes of their own. The source
// costs nothing: it hands out the same frame of 512 × 424 range, amplitude and flags (1.95 MB).
// Latency is from `received` (the daemon has the whole frame) to the return of Subscription::next; once as it is,
// and once at a priority of real time, where that may be had (root), which shows the path without what else
// the machine does.
#include <arpa/inet.h>
#include <sched.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/uio.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <functional>
#include <memory>
#include <numeric>
#include <string>
#include <thread>
#include <vector>

#include <boost/asio/io_context.hpp>
#include <spdlog/spdlog.h>

#include <toftwin/client.h>

#include "daemon/clock.h"
#include "daemon/hub.h"
#include "daemon/server.h"
#include "daemon/source_host.h"
#include "drivers/source.h"
#include "protocol/wire/codec.h"

namespace toftwin {
namespace {

using namespace std::chrono_literals;
using Seconds = std::chrono::duration<double>;

constexpr int kClients = 8;
constexpr auto kPeriod = std::chrono::nanoseconds{1s} / 30;

[[noreturn]] void giveUp(const std::string& what) {
  std::fprintf(stderr, "frame_path_bench: %s\n", what.c_str());
  std::exit(1);
}

template <class T>
T orGiveUp(Result<T> result) {
  if (!result) giveUp(result.error().message);
  return std::move(*result);
}

std::int64_t hostNow() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

Frame constantFrame() {
  Frame frame;
  frame.camera = {512, 424, 365, 365, 255.5, 211.5, {}, ""};
  Image<float> range_m{512, 424}, amplitude{512, 424};
  for (std::size_t i = 0; i < range_m.size(); ++i) {
    range_m[i] = 1.0f + 0.001f * static_cast<float>(i % 4096);
    amplitude[i] = static_cast<float>(i % 1000);
  }
  frame.planes = {toPlane(PlaneKind::Range, std::move(range_m)),
                  toPlane(PlaneKind::Amplitude, std::move(amplitude)),
                  toPlane(PlaneKind::Flags, Image<std::uint8_t>{512, 424})};
  return frame;
}

/// The same frame again and again, every `period` (0: as soon as it is asked for).
class ConstantSource final : public drivers::Source {
 public:
  explicit ConstantSource(std::chrono::nanoseconds period) : period_(period) {
    info_.driver = "constant";
    info_.camera = frame_.camera;
    for (const Plane& plane : frame_.planes) info_.planes.push_back(plane.kind);
  }
  [[nodiscard]] const drivers::SourceInfo& info() const override { return info_; }
  Result<> start() override {
    due_ = std::chrono::steady_clock::now();
    return {};
  }
  void stop() override {}
  Result<Frame> next(std::stop_token stop, bool) override {
    if (stop.stop_requested()) return Error{Error::Code::Stopped, "stopped"};
    due_ += period_;
    if (period_ > 0ns) std::this_thread::sleep_until(due_);
    frame_.moment.exposures = {{{++time_}, 1_ms, 80_MHz}};
    return frame_;
  }

 private:
  const std::chrono::nanoseconds period_;
  std::chrono::steady_clock::time_point due_;
  std::int64_t time_ = 0;
  Frame frame_ = constantFrame();
  drivers::SourceInfo info_;
};

/// A process that runs `work`, which says through the pipe when it is ready, and is killed at the
/// end.
class Child {
 public:
  explicit Child(const std::function<void(int ready)>& work) {
    int ends[2];
    if (::pipe(ends) != 0) giveUp("pipe failed");
    pid_ = ::fork();
    if (pid_ == 0) {
      ::prctl(PR_SET_PDEATHSIG, SIGKILL);
      work(ends[1]);
      ::_exit(0);
    }
    if (::read(ends[0], &port_, sizeof port_) != sizeof port_) giveUp("the child died");
    ::close(ends[0]);
    ::close(ends[1]);
  }
  ~Child() {
    ::kill(pid_, SIGKILL);
    ::waitpid(pid_, nullptr, 0);
  }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;
  [[nodiscard]] int port() const { return port_; }

 private:
  pid_t pid_ = -1;
  int port_ = 0;
};

void sayReady(int pipe, int port) {
  if (::write(pipe, &port, sizeof port) != sizeof port) ::_exit(1);
}

void runDaemon(int ready, std::chrono::nanoseconds period, const std::string& socket) {
  spdlog::set_level(spdlog::level::off);
  const daemon::Clock& clock = daemon::systemClock();
  daemon::Hub hub{{}, clock};
  const auto open = [period]() -> Result<std::unique_ptr<drivers::Source>> {
    return std::unique_ptr<drivers::Source>{std::make_unique<ConstantSource>(period)};
  };
  hub.add(std::make_shared<daemon::SourceHost>("cam", open, open(), daemon::SourceHost::Options{},
                                               clock));
  boost::asio::io_context io;
  daemon::Server server{io, hub, {}};
  if (auto listening = server.listenTcp("127.0.0.1", 0); !listening)
    giveUp(listening.error().message);
  if (auto listening = server.listenUnix(socket); !listening) giveUp(listening.error().message);
  sayReady(ready, server.port());
  io.run();
}

// ---- the bare sender
// -------------------------------------------------------------------------------

int listenLocally(int& port) {
  const int listener = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  auto* const any = reinterpret_cast<sockaddr*>(&address);
  if (::bind(listener, any, size) != 0 || ::listen(listener, kClients) != 0 ||
      ::getsockname(listener, any, &size) != 0) {
    giveUp("cannot listen");
  }
  port = ntohs(address.sin_port);
  return listener;
}

/// Sends the bytes to each of `count` receivers, every `period` or without pause, with the time of
/// sending in their first eight.
void runBareSender(int ready, int count, std::chrono::nanoseconds period,
                   std::vector<std::byte> bytes) {
  int port = 0;
  const int listener = listenLocally(port);
  sayReady(ready, port);
  std::vector<int> receivers;
  for (int i = 0; i < count; ++i) receivers.push_back(::accept(listener, nullptr, nullptr));
  for (auto due = std::chrono::steady_clock::now();;) {
    due += period;
    if (period > 0ns) std::this_thread::sleep_until(due);
    const std::int64_t now = hostNow();
    std::memcpy(bytes.data(), &now, sizeof now);
    for (const int receiver : receivers) {
      for (std::size_t sent = 0; sent < bytes.size();) {
        const ssize_t wrote =
            ::send(receiver, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
        if (wrote <= 0) return;
        sent += static_cast<std::size_t>(wrote);
      }
    }
  }
}

int dialLocally(int port) {
  const int fd = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  if (::connect(fd, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0)
    giveUp("cannot connect");
  return fd;
}

// ---- measuring
// -------------------------------------------------------------------------------------

struct Latencies {
  std::vector<double> ms;
  std::uint64_t dropped = 0;

  void print(const char* what) {
    if (ms.empty()) giveUp("no frames");
    std::ranges::sort(ms);
    const auto at = [&](double share) {
      return ms[static_cast<std::size_t>(share * static_cast<double>(ms.size() - 1))];
    };
    std::printf("%-34s %8zu %8.3f %8.3f %8.3f %8.3f %8llu\n", what, ms.size(), at(0.5), at(0.9),
                at(0.99), ms.back(), static_cast<unsigned long long>(dropped));
    std::fflush(stdout);
  }
};

/// Runs `receive` for each client in a process of its own and gathers what they measured.
Latencies ofAllClients(int clients, const std::function<Latencies()>& receive) {
  std::vector<int> pipes;
  for (int i = 0; i < clients; ++i) {
    int ends[2];
    if (::pipe(ends) != 0) giveUp("pipe failed");
    if (::fork() == 0) {
      ::prctl(PR_SET_PDEATHSIG, SIGKILL);
      Latencies mine = receive();
      mine.ms.push_back(static_cast<double>(mine.dropped));  // last
      FILE* const out = ::fdopen(ends[1], "wb");
      std::fwrite(mine.ms.data(), sizeof(double), mine.ms.size(), out);
      std::fflush(out);
      ::_exit(0);
    }
    ::close(ends[1]);
    pipes.push_back(ends[0]);
  }
  Latencies all;
  for (const int pipe : pipes) {
    FILE* const in = ::fdopen(pipe, "rb");
    double value = 0.0;
    while (std::fread(&value, sizeof value, 1, in) == 1) all.ms.push_back(value);
    if (all.ms.empty()) giveUp("a client failed");
    all.dropped += static_cast<std::uint64_t>(all.ms.back());
    all.ms.pop_back();
    std::fclose(in);
    ::wait(nullptr);
  }
  return all;
}

void measureLatency(const char* what, const std::string& address, Seconds time) {
  Latencies all = ofAllClients(kClients, [&] {
    auto client = orGiveUp(Client::connect(address));
    auto subscription = orGiveUp(client.subscribe("cam"));
    Latencies mine;
    const auto end = std::chrono::steady_clock::now() + time;
    for (int i = 0; std::chrono::steady_clock::now() < end; ++i) {
      const auto frame = subscription.next(2s);
      if (!frame) giveUp(frame.error().message);
      if (i < 10) continue;  // connecting is not the frame path
      mine.ms.push_back(static_cast<double>(hostNow() - frame->moment.received.ns) * 1e-6);
      mine.dropped += frame->dropped_before;
    }
    return mine;
  });
  all.print(what);
}

void measureBareLatency(int port, std::size_t size, Seconds time) {
  Latencies all = ofAllClients(kClients, [&] {
    const int fd = dialLocally(port);
    std::vector<std::byte> bytes(size);
    Latencies mine;
    const auto end = std::chrono::steady_clock::now() + time;
    for (int i = 0; std::chrono::steady_clock::now() < end; ++i) {
      if (::recv(fd, bytes.data(), size, MSG_WAITALL) != static_cast<ssize_t>(size)) break;
      std::int64_t sent = 0;
      std::memcpy(&sent, bytes.data(), sizeof sent);
      if (i >= 10) mine.ms.push_back(static_cast<double>(hostNow() - sent) * 1e-6);
    }
    ::close(fd);
    return mine;
  });
  all.print("bare TCP sender");
}

double framesPerSecond(const std::function<bool()>& next, Seconds time) {
  for (int i = 0; i < 20; ++i) {
    if (!next()) giveUp("no frames");
  }
  const auto start = std::chrono::steady_clock::now();
  int frames = 0;
  while (std::chrono::steady_clock::now() - start < time && next()) ++frames;
  return frames / Seconds{std::chrono::steady_clock::now() - start}.count();
}

/// Frames per second of all clients together, each a process of its own.
double together(int clients, const std::function<double()>& framesOfOne) {
  const Latencies rates =
      ofAllClients(clients, [&] { return Latencies{.ms = {framesOfOne()}, .dropped = 0}; });
  return std::accumulate(rates.ms.begin(), rates.ms.end(), 0.0);
}

double measureThroughput(int clients, const std::string& address, Seconds time) {
  return together(clients, [&] {
    auto client = orGiveUp(Client::connect(address));
    auto subscription = orGiveUp(
        client.subscribe("cam", {.policy = SubscribeOptions::Policy::Queue, .queue = 4}));
    return framesPerSecond([&] { return subscription.next(2s).ok(); }, time);
  });
}

double measureBareThroughput(int clients, int port, std::size_t size, Seconds time) {
  return together(clients, [&] {
    const int fd = dialLocally(port);
    std::vector<std::byte> bytes(size);
    return framesPerSecond(
        [&] { return ::recv(fd, bytes.data(), size, MSG_WAITALL) == static_cast<ssize_t>(size); },
        time);
  });
}

double median(std::vector<double> values) {
  std::ranges::sort(values);
  return values[values.size() / 2];
}

/// Rounds of bare sender, TCP, shared memory, one after the other, so that whatever else the machine does
/// meets all alike; the shares are medians over the rounds.
void compareThroughput(int clients, const std::vector<std::byte>& bytes, const std::string& socket,
                       Seconds time) {
  constexpr int kRounds = 15;
  std::vector<double> bare, tcp, shared, tcp_share, shared_share;
  for (int round = 0; round < kRounds; ++round) {
    {
      const Child sender{
          [&](int ready) { runBareSender(ready, clients, std::chrono::nanoseconds{0}, bytes); }};
      bare.push_back(measureBareThroughput(clients, sender.port(), bytes.size(), time / kRounds));
    }
    // A source a little faster than the bare sender: faster still, it would only make frames to drop.
    const std::chrono::nanoseconds period{
        static_cast<std::int64_t>(1e9 * clients / (1.1 * bare.back()))};
    const Child sender{[&](int ready) { runDaemon(ready, period, socket); }};
    tcp.push_back(measureThroughput(clients, "tcp:127.0.0.1:" + std::to_string(sender.port()),
                                    time / kRounds));
    shared.push_back(measureThroughput(clients, "unix:" + socket, time / kRounds));
    tcp_share.push_back(tcp.back() / bare.back());
    shared_share.push_back(shared.back() / bare.back());
    std::filesystem::remove(socket);
  }
  std::printf(
      "\nthroughput, %d client%s, a source at 110 %% of the bare sender; medians of %d rounds\n"
      "%-34s %12s %12s %12s\n",
      clients, clients == 1 ? "" : "s", kRounds, "", "frames/s", "MB/s", "of bare TCP");
  const double mb = static_cast<double>(bytes.size()) * 1e-6;
  const auto print = [&](const char* what, double rate, double share) {
    std::printf("%-34s %12.0f %12.0f %11.0f%%\n", what, rate, rate * mb, 100.0 * share);
  };
  print("bare TCP sender", median(bare), 1.0);
  print("toftwind, TCP", median(tcp), median(tcp_share));
  print("toftwind, Unix socket and memfd", median(shared), median(shared_share));
  std::fflush(stdout);
}

bool setPriority(int policy, int priority) {
  const sched_param parameter{.sched_priority = priority};
  return ::sched_setscheduler(0, policy, &parameter) == 0;
}

void run(Seconds time) {
  const auto bytes = wire::toBytes(*wire::encode(wire::FrameMessage{1, constantFrame()}));
  const double mb = static_cast<double>(bytes.size()) * 1e-6;
  const std::string socket =
      (std::filesystem::temp_directory_path() / ("frame_path_bench-" + std::to_string(::getpid())))
          .string();
  const auto daemonWith = [&](std::chrono::nanoseconds period) {
    return [&, period](int ready) { runDaemon(ready, period, socket); };
  };
  const auto bareWith = [&](int count, std::chrono::nanoseconds period) {
    return [&, count, period](int ready) { runBareSender(ready, count, period, bytes); };
  };

  std::printf("frame: 512 x 424 range + amplitude + flags, %.2f MB; %u CPUs; %.0f s each\n\n", mb,
              std::thread::hardware_concurrency(), time.count());
  std::printf("latency in ms, %d clients, 30 frames/s\n%-34s %8s %8s %8s %8s %8s %8s\n", kClients,
              "", "frames", "p50", "p90", "p99", "max", "dropped");
  std::fflush(stdout);
  {
    const Child sender{daemonWith(kPeriod)};
    measureLatency("toftwind, Unix socket and memfd", "unix:" + socket, time);
    measureLatency("toftwind, TCP", "tcp:127.0.0.1:" + std::to_string(sender.port()), time);
  }
  std::filesystem::remove(socket);
  if (setPriority(SCHED_FIFO, 10)) {  // which those that are forked inherit
    const Child sender{daemonWith(kPeriod)};
    measureLatency("the former at a real-time priority", "unix:" + socket, time);
    setPriority(SCHED_OTHER, 0);
    std::filesystem::remove(socket);
  } else {
    std::printf("(no permission for a real-time priority)\n");
  }
  {
    const Child sender{bareWith(kClients, kPeriod)};
    measureBareLatency(sender.port(), bytes.size(), time);
  }

  for (const int clients : {1, kClients}) compareThroughput(clients, bytes, socket, time);
}

}  // namespace
}  // namespace toftwin

int main(int count, char** arguments) {
  ::signal(SIGPIPE, SIG_IGN);
  const double seconds = count > 1 ? std::atof(arguments[1]) : 10.0;
  if (!(seconds > 0.0)) {
    std::fprintf(stderr, "usage: frame_path_bench [SECONDS]\n");
    return 2;
  }
  toftwin::run(toftwin::Seconds{seconds});
}
