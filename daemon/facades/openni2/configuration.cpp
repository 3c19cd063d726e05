// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdlib>
#include <filesystem>

#include <toftwin/client.h>

#include "daemon/facades/openni2/keys.h"
#include "protocol/settings/settings.h"
#include "protocol/transport/address.h"

namespace toftwin::openni2 {
namespace {

std::vector<std::string> split(std::string_view list) {
  std::vector<std::string> parts;
  while (!list.empty()) {
    const std::size_t comma = std::min(list.find(','), list.size());
    parts.emplace_back(list.substr(0, comma));
    list.remove_prefix(std::min(comma + 1, list.size()));
  }
  return parts;
}

Result<> checkAddresses(const std::vector<std::string>& addresses, const std::string& place) {
  for (const std::string& address : addresses) {
    const auto parsed = transport::parseAddress(address, kDefaultPort);
    if (!parsed) return Error{parsed.error().code, place + ": " + parsed.error().message};
  }
  return {};
}

/// A program with more rights than who runs it does not listen to the environment.
std::string variable(const char* name) {
  const char* value = ::secure_getenv(name);
  return value == nullptr ? "" : value;
}

}  // namespace

Result<Configuration> readConfiguration(const std::string& file, std::string_view where) {
  Configuration configuration;
  std::string place = "TOFTWIN_OPENNI2";
  if (!file.empty()) {
    auto table = settings::Table::load(file);
    if (!table) return table.error();
    table->read(configuration.keys);
    configuration.unevenness = daemon::Unevenness::read(*table, configuration.keys.intervals);
    place = table->place("addresses");
    if (auto checked = table->check(); !checked) return checked.error();
  }
  if (where == "off") configuration.is_off = true;
  if (!where.empty()) {
    configuration.keys.addresses = configuration.is_off ? std::vector<std::string>{} : split(where);
    place = "TOFTWIN_OPENNI2";
  }
  if (auto checked = checkAddresses(configuration.keys.addresses, place); !checked) return checked.error();
  return configuration;
}

Result<Configuration> configurationHere() {
  std::string file = variable("TOFTWIN_OPENNI2_CONFIG");
  std::error_code ignored;
  if (file.empty() && std::filesystem::exists(TOFTWIN_OPENNI2_DEFAULT_CONFIG, ignored))
    file = TOFTWIN_OPENNI2_DEFAULT_CONFIG;
  return readConfiguration(file, variable("TOFTWIN_OPENNI2"));
}

}  // namespace toftwin::openni2
