// SPDX-License-Identifier: Apache-2.0
// Takes one frame and prints the range in the middle of its image.
//   minimal_client [SOURCE [ADDRESS]]      without SOURCE: the daemon's first
#include <toftwin/client.h>

#include <cstdio>
#include <string>

namespace {

int fail(const toftwin::Error& error) {
  std::fprintf(stderr, "minimal_client: %s\n", error.message.c_str());
  return 1;
}

}  // namespace

int main(int count, char** arguments) {
  auto client = toftwin::Client::connect(count > 2 ? arguments[2] : "");
  if (!client) return fail(client.error());

  std::string source = count > 1 ? arguments[1] : "";
  if (source.empty()) {
    const auto sources = client->sources();
    if (!sources) return fail(sources.error());
    if (sources->empty()) return fail({.code = {}, .message = "the daemon has no sources"});
    source = sources->front().name;
  }

  auto subscription = client->subscribe(source, {.planes = {toftwin::PlaneKind::Range}});
  if (!subscription) return fail(subscription.error());
  const auto frame = subscription->next(std::chrono::seconds{10});
  if (!frame) return fail(frame.error());

  const toftwin::Plane* range = frame->find(toftwin::PlaneKind::Range);
  if (!range || range->type != toftwin::ElementType::F32) {
    return fail({.code = {}, .message = source + " has no range plane of floats"});
  }
  const int x = range->width / 2, y = range->height / 2;
  const float range_m = range->as<float>()[static_cast<std::size_t>(y * range->width + x)];
  std::printf("%s, frame %llu: range at pixel (%d, %d) is %.3f m\n", source.c_str(),
              static_cast<unsigned long long>(frame->sequence), x, y, static_cast<double>(range_m));
}
