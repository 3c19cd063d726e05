// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <string_view>

#include "tools/cli/command.h"
#include "tools/cli/describe.h"
#include "tools/cli/options.h"

namespace toftwin::cli {
namespace set_command {

struct Options {
  DaemonOptions daemon;
  std::string source;
  std::string key;
  std::optional<std::string> value;
  bool json = false;
};

/// KEY=VALUE in one word, as recipes have it, becomes the two.
Result<> split(Options& options) {
  const std::size_t equals = options.key.find('=');
  if (equals == std::string::npos) return {};
  const auto wrong = [&](std::string_view what) {
    return Error{Error::Code::InvalidArgument, fmt::format("{}: {}", options.key, what)};
  };
  if (options.value) return wrong("a second value follows; give one, as KEY VALUE or KEY=VALUE");
  if (equals == 0) return wrong("write KEY=VALUE, with the parameter's name first");
  options.value = options.key.substr(equals + 1);
  options.key.resize(equals);
  return {};
}

std::optional<double> numberIn(const std::string& text) {
  const char* end = text.data() + text.size();
  double number = 0.0;
  const auto [read, error] = std::from_chars(text.data(), end, number);
  if (error != std::errc{} || read != end) return std::nullopt;
  return number;
}

/// All parameters of the source, or the one that is asked for.
Result<std::vector<Parameter>> parametersOf(Client& client, const Options& options) {
  auto details = client.describe(options.source);
  if (!details) return details.error();
  std::vector<Parameter>& all = details->parameters;
  if (options.key.empty()) return std::move(all);
  const auto found = std::ranges::find(all, options.key, &Parameter::name);
  if (found != all.end()) return std::vector{*found};
  std::string known;
  for (const Parameter& parameter : all) known += (known.empty() ? "" : ", ") + parameter.name;
  return Error{Error::Code::NotFound,
               fmt::format("{} has no parameter \"{}\"; it has: {}", options.source, options.key,
                           known.empty() ? "none" : known)};
}

/// A number as such, but to a parameter that is a text alone: "7" may be what a camera is called. To one that
/// has no text, the daemon says what it takes.
Result<> setTo(Client& client, const Options& options) {
  const auto number = numberIn(*options.value);
  if (number) {
    const auto now = parametersOf(client, options);
    if (!now) return now.error();
    const Parameter& parameter = now->front();
    if (parameter.value || !parameter.text) return client.setParameter(options.source, options.key, *number);
  }
  return client.setParameter(options.source, options.key, *options.value);
}

Result<Exit> run(const Options& options) {
  auto client = options.daemon.connect();
  if (!client) return client.error();
  if (options.value) {
    if (auto set = setTo(*client, options); !set) return set.error();
  }
  const auto parameters = parametersOf(*client, options);
  if (!parameters) return parameters.error();
  if (parameters->empty()) fmt::print(stderr, "{} has no parameters\n", options.source);
  fmt::print("{}", options.json ? toJson(*parameters).text() : toText(*parameters));
  return Exit::Ok;
}

}  // namespace set_command

Command setCommand() {
  using namespace set_command;
  return {"set", "show or set a camera's parameters while it runs",
          "  toftwin set kinect                             all, with their values and bounds\n"
          "  toftwin set kinect ambient_klx 20\n"
          "  toftwin set kinect ambient_klx=20              the same\n"
          "  toftwin set kinect exposure_us                 shows this one\n"
          "  toftwin set gige TriggerActivation FallingEdge  one of its choices, by name\n",
          [](Arguments& args) -> Run {
            const auto options = std::make_shared<Options>();
            args.option("SOURCE", options->source, "name of the camera").required();
            args.option("KEY", options->key, "the parameter; its name ends in its unit; KEY=VALUE sets it");
            args.option("VALUE", options->value,
                        "a number, a choice or a text; without it the present one is shown");
            args.flag("--json", options->json, "as JSON");
            args.check([options] { return split(*options); });
            options->daemon.add(args);
            return [options] { return run(*options); };
          }};
}

}  // namespace toftwin::cli
