// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>

#include "calib/compare/json.h"
#include "drivers/usb/cameras.h"
#include "drivers/usb/watch.h"
#include "tools/cli/command.h"
#include "tools/cli/options.h"
#include "tools/cli/terminal.h"

namespace toftwin::cli {
namespace usb_command {

using compare::Json;

struct Options {
  std::string port;
  bool watch = false, json = false;
};

void listAll(bool as_json) {
  Json all = Json::array();
  const auto devices = usb::list();
  for (const usb::Device& device : devices) {
    const std::string warning = usb::warningOf(device);
    all.push(Json::object()
                 .set("camera", usb::nameOf(device))
                 .set("driver", std::string{device.camera->driver})
                 .set("port", device.port)
                 .set("mbit_s", device.mbit_s)
                 .set("serial", device.serial)
                 .set("node", device.node.string())
                 .set("warning", warning));
    if (as_json) continue;
    fmt::print("{}\n", usb::describe(device));
    if (!warning.empty()) fmt::print("  {}\n", warning);
  }
  if (as_json) return fmt::print("{}", all.text());
  if (devices.empty()) fmt::print("no camera that we know is on USB\n");
}

void tell(const usb::Watch::Event& event) {
  if (!event.has_arrived) {
    fmt::print("gone:  {} at {}\n", event.camera->name, event.port);
  } else {
    const auto devices = usb::list();
    const auto found = std::ranges::find(devices, event.port, &usb::Device::port);
    fmt::print("there: {}\n", found == devices.end()
                                  ? fmt::format("{} at {}", event.camera->name, event.port)
                                  : usb::describe(*found));
    if (found != devices.end()) {
      if (const auto warning = usb::warningOf(*found); !warning.empty())
        fmt::print("  {}\n", warning);
    }
  }
  flushOutput();
}

Result<Exit> run(const Options& options) {
  if (!options.port.empty()) {
    if (auto done = usb::reset(options.port); !done) return done.error();
    fmt::print("reset what is at {}\n", options.port);
    return Exit::Ok;
  }
  if (!options.watch) return listAll(options.json), Exit::Ok;
  catchInterrupts();
  auto watch = usb::Watch::begin(tell);
  if (!watch) return watch.error();
  while (!interrupted()) {
    if (auto waited = (*watch)->wait(std::chrono::milliseconds{200}); !waited)
      return waited.error();
  }
  return Exit::Interrupted;
}

}  // namespace usb_command

Command usbCommand() {
  using namespace usb_command;
  return {
      "usb", "lists depth cameras on USB with port and speed, watches them, resets one that hangs",
      "  toftwin usb                list\n"
      "  toftwin usb --watch        tells what comes and goes, until Ctrl-C\n"
      "  toftwin usb --reset 2-1.4  as if it was unplugged and plugged in\n",
      [](Arguments& args) -> Run {
        const auto options = std::make_shared<Options>();
        args.flag("--watch", options->watch, "tells what comes and goes");
        args.option("--reset", options->port, "port of the camera to reset, as the list has it");
        args.flag("--json", options->json, "the list as JSON");
        args.check([options]() -> Result<> {
          if (options->watch + !options->port.empty() + options->json <= 1) return {};
          return Error{Error::Code::InvalidArgument,
                       "--watch, --reset and --json exclude each other"};
        });
        return [options] { return run(*options); };
      }};
}

}  // namespace toftwin::cli
