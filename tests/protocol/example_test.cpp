// SPDX-License-Identifier: Apache-2.0
// Runs docs/examples/minimal-client, as built against the installed package (TOFTWIN_EXAMPLE).
#include <gmock/gmock.h>
#include <sys/wait.h>

#include <array>
#include <cstdio>
#include <string>

#include "example_messages.h"
#include "fake_daemon.h"

namespace toftwin {
namespace {

using testing::HasSubstr;

struct Output {
  std::string text;
  int exit_code = -1;
};

Output runExample(const std::string& arguments) {
  Output output;
  const std::string command = std::string{TOFTWIN_EXAMPLE} + " " + arguments + " 2>&1";
  FILE* pipe = ::popen(command.c_str(), "r");
  if (!pipe) return output;
  std::array<char, 256> line{};
  while (std::fgets(line.data(), line.size(), pipe)) output.text += line.data();
  const int status = ::pclose(pipe);
  if (WIFEXITED(status)) output.exit_code = WEXITSTATUS(status);
  return output;
}

TEST(MinimalClient, PrintsTheRangeInTheMiddle) {
  FakeDaemon daemon{FakeDaemon::On::Unix, FakeDaemon::polite([](FakeDaemon::Session& session,
                                                                const wire::Message& message) {
                      if (auto* list = std::get_if<wire::ListSources>(&message)) {
                        session.send(wire::SourceList{
                            list->id, {{"kinect", "", "", FrameKind::Simulated, true}}});
                      } else if (std::holds_alternative<wire::Subscribe>(message)) {
                        session.send(wire::FrameMessage{7, wire::exampleFrame(8, 6)});
                      }
                    })};
  const Output output = runExample("'' " + daemon.address());
  // Pixel (4, 3) of 8 × 6 is number 28, and the example's range is 1 m + 1 mm per pixel.
  EXPECT_EQ(output.text, "kinect, frame 41: range at pixel (4, 3) is 1.028 m\n");
  EXPECT_EQ(output.exit_code, 0);
}

TEST(MinimalClient, SaysWhatToDoWithoutADaemon) {
  const Output output = runExample("kinect unix:/nowhere.sock");
  EXPECT_THAT(output.text, HasSubstr("Start it with \"toftwind\""));
  EXPECT_EQ(output.exit_code, 1);
}

}  // namespace
}  // namespace toftwin
