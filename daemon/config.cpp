// SPDX-License-Identifier: Apache-2.0
#include "daemon/config.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <set>
#include <utility>

#include "protocol/settings/describe.h"

namespace toftwin::daemon {
namespace {

bool isName(std::string_view name) {
  return !name.empty() && name.size() <= 64 && std::ranges::all_of(name, [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '-' || c == '_' || c == '.';
  });
}

std::string namesOf(std::span<const drivers::Driver> drivers) {
  std::string names;
  for (const auto& driver : drivers)
    names += (names.empty() ? "" : ", ") + std::string{driver.name};
  return names;
}

const drivers::Driver* findDriver(std::span<const drivers::Driver> drivers, std::string_view name) {
  const auto found = std::ranges::find(drivers, name, &drivers::Driver::name);
  return found == drivers.end() ? nullptr : &*found;
}

/// The keys that every source has; what is wrong with them goes to the table.
SourceKeys readSourceKeys(settings::Table& table, std::span<const drivers::Driver> drivers,
                          std::set<std::string>& names) {
  SourceKeys keys;
  table.read(keys);
  if (!isName(keys.name)) {
    table.complain(table.has("name") ? "name" : "",
                   "name: a source needs a name of letters, digits, '-', '_' and '.', at most 64");
  } else if (!names.insert(keys.name).second) {
    table.complain("name", fmt::format("\"{}\" is the name of another source already", keys.name));
  }
  if (findDriver(drivers, keys.driver) == nullptr) {
    table.complain(table.has("driver") ? "driver" : "",
                   fmt::format("driver \"{}\" is not in this build; there are: {}", keys.driver,
                               namesOf(drivers)));
    table.acceptAll();  // whose keys the others are cannot be told
  }
  return keys;
}

ConfiguredSource readSource(settings::Table table, std::span<const drivers::Driver> drivers,
                            const std::vector<std::string>& running, std::set<std::string>& names) {
  SourceKeys keys = readSourceKeys(table, drivers, names);
  const drivers::Driver* driver = findDriver(drivers, keys.driver);
  // Relative paths in the table start at its file's folder, which therefore counts too.
  std::string fingerprint = table.resolve("").string() + "\n" + table.canonicalText();
  const bool is_as_before = std::ranges::find(running, fingerprint) != running.end();
  ConfiguredSource source{std::move(keys), driver, table, std::move(fingerprint), is_as_before};
  if (driver == nullptr) return source;
  if (is_as_before) {
    table.acceptAll();
  } else {
    source.opened = driver->open(source.table);
  }
  return source;
}

std::filesystem::path recordingFolder(const DaemonKeys& keys, const settings::Table& table) {
  if (!keys.recording_folder.empty())
    return table.resolve(keys.recording_folder).lexically_normal();
  const char* state =
      std::getenv("STATE_DIRECTORY");  // NOLINT(concurrency-mt-unsafe): nobody sets it
  return state == nullptr ? "" : state;
}

Result<Config> readConfig(settings::Table& table, std::span<const drivers::Driver> drivers,
                          const std::vector<std::string>& running) {
  Config config;
  table.read(config.keys);
  if (auto listen = checkListen(config.keys.listen); !listen)
    table.complain("listen", listen.error().message);
  std::set<std::string> names;
  for (settings::Table& below : table.tables("source")) {
    config.sources.push_back(readSource(below, drivers, running, names));
  }
  if (auto checked = table.check(); !checked) return checked.error();
  for (const ConfiguredSource& source : config.sources) {
    if (source.is_as_before || source.opened) continue;
    if (source.opened.error().code == Error::Code::InvalidArgument) return source.opened.error();
  }
  config.recording_folder = recordingFolder(config.keys, table);
  return config;
}

}  // namespace

Result<Config> loadConfig(const std::filesystem::path& file,
                          std::span<const drivers::Driver> drivers,
                          const std::vector<std::string>& running) {
  auto table = settings::Table::load(file);
  if (!table) return table.error();
  return readConfig(*table, drivers, running);
}

Result<Config> parseConfig(std::string_view toml, const std::filesystem::path& name,
                           std::span<const drivers::Driver> drivers,
                           const std::vector<std::string>& running) {
  auto table = settings::Table::parse(toml, name);
  if (!table) return table.error();
  return readConfig(*table, drivers, running);
}

Result<> checkListen(const ListenKeys& listen) {
  const std::string& address = listen.address;
  const bool is_loopback =
      address.empty() || address == "localhost" || address == "::1" || address.starts_with("127.");
  if (is_loopback || listen.allow_remote) return {};
  return Error{
      Error::Code::InvalidArgument,
      fmt::format("address = \"{}\" can be reached from other machines, and there is no password: "
                  "everyone there could see all cameras and steer them. Set allow_remote = true "
                  "if you trust that whole network, or use 127.0.0.1",
                  address)};
}

std::string documentConfig(std::span<const drivers::Driver> drivers) {
  using settings::keysOf;
  using settings::markdownTable;
  std::string text = "### The daemon\n\n" + markdownTable(keysOf<DaemonKeys>()) +
                     "\n### Every `[[source]]`\n\n" + markdownTable(keysOf<SourceKeys>());
  for (const auto& driver : drivers) {
    text += fmt::format("\n### A `[[source]]` with `driver = \"{}\"`: {}\n\n", driver.name,
                        driver.summary);
    text += driver.document();
  }
  return text;
}

}  // namespace toftwin::daemon
