// SPDX-License-Identifier: Apache-2.0
// What clients get of a running daemon: clients_bench ADDRESS SOURCE CLIENTS SECONDS. Of "tls:" addresses the authorities are in
// TOFTWIN_AUTHORITIES. Prints frames a second of all, and the time from the daemon's having a frame to the application's,
// of the same machine's clock: median and 99th percentile.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <thread>
#include <vector>

#include <toftwin/client.h>

namespace {

using namespace toftwin;
using std::chrono::steady_clock;

std::vector<double> latenciesOf(const std::string& address, const std::string& source, std::chrono::seconds time) {
  std::vector<double> ms;
  ClientOptions options;
  if (const char* authorities = std::getenv("TOFTWIN_AUTHORITIES")) options.authorities = authorities;
  auto client = Client::connect(address, options);
  if (!client) return std::fprintf(stderr, "%s\n", client.error().message.c_str()), ms;
  auto stream = client->subscribe(source);
  if (!stream) return std::fprintf(stderr, "%s\n", stream.error().message.c_str()), ms;
  for (const auto end = steady_clock::now() + time; steady_clock::now() < end;) {
    const auto frame = stream->next(std::chrono::seconds{5});
    if (!frame) break;
    const auto now = std::chrono::system_clock::now().time_since_epoch();
    ms.push_back(1e-6 * static_cast<double>(std::chrono::nanoseconds{now}.count() - frame->moment.received.ns));
  }
  return ms;
}

}  // namespace

int main(int count, char** words) {
  if (count != 5) return std::fprintf(stderr, "usage: clients_bench ADDRESS SOURCE CLIENTS SECONDS\n"), 2;
  const int clients = std::atoi(words[3]), seconds = std::atoi(words[4]);
  std::vector<std::vector<double>> all(static_cast<std::size_t>(clients));
  {
    std::vector<std::jthread> threads;
    for (auto& ms : all)
      threads.emplace_back([&ms, &words, seconds] { ms = latenciesOf(words[1], words[2], std::chrono::seconds{seconds}); });
  }
  std::vector<double> ms;
  for (const auto& one : all) ms.insert(ms.end(), one.begin(), one.end());
  if (ms.empty()) return 1;
  std::ranges::sort(ms);
  const auto at = [&](double part) { return ms[static_cast<std::size_t>(part * static_cast<double>(ms.size() - 1))]; };
  std::printf("%.1f frames/s, p50 %.2f ms, p99 %.2f ms\n", static_cast<double>(ms.size()) / seconds, at(0.5), at(0.99));
  return 0;
}
