// SPDX-License-Identifier: Apache-2.0
#include "daemon/config.h"

#include <boost/asio/ip/address.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <set>
#include <utility>

#include "daemon/corrected_source.h"
#include "daemon/networks.h"
#include "daemon/thrown.h"
#include "protocol/settings/describe.h"
#include "protocol/settings/endable.h"

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
    constexpr std::string_view kRule =
        "a source needs a name of letters, digits, '-', '_' and '.', at most 64";
    if (table.has("name")) {
      table.complain("name", fmt::format("= \"{}\" is no name: {}", keys.name, kRule));
    } else {
      table.complain("", fmt::format("name is missing: {}", kRule));
    }
  } else if (!names.insert(keys.name).second) {
    table.complain("name",
                   fmt::format("= \"{}\" is the name of another source already", keys.name));
  }
  if (findDriver(drivers, keys.driver) == nullptr) {
    const std::string known = namesOf(drivers);
    table.complain(
        table.has("driver") ? "driver" : "",
        table.has("driver")
            ? fmt::format("= \"{}\" is not in this build; there are: {}", keys.driver, known)
            : fmt::format("driver is missing: it must be one of {}", known));
    table.acceptAll();  // whose keys the others are cannot be told
  }
  return keys;
}

/// A line for each file that the table names, and that a TOML file among them names in turn (a
/// scene its meshes): path, size and time of change. Equal text: nobody changed them. But for `written`, which the
/// daemon itself changes.
std::string stampsOf(const settings::Table& table, const std::filesystem::path& written = {}) {
  std::vector<std::filesystem::path> files = table.files();
  std::erase(files, written);
  for (std::size_t i = 0, named_here = files.size(); i < named_here; ++i) {
    if (files[i].extension() != ".toml") continue;
    if (const auto below = settings::Table::load(files[i])) {
      for (std::filesystem::path& file : below->files()) files.push_back(std::move(file));
    }
  }
  std::string stamps;
  for (const std::filesystem::path& file : files) {
    std::error_code vanished;
    const auto size = std::filesystem::file_size(file, vanished);
    const auto changed = std::filesystem::last_write_time(file, vanished).time_since_epoch();
    stamps += fmt::format("{} {} {}\n", file.string(), size, changed.count());
  }
  return stamps;
}

/// No exception of a driver ends the daemon: it counts as a camera that could not be opened.
Result<std::unique_ptr<drivers::Source>> openGuarded(const drivers::Driver& driver,
                                                     settings::Table& table) {
  try {
    auto opened = driver.open(table);
    if (!opened && table.check()) return drivers::answerAtOpening(opened.error());
    return opened;
  } catch (...) {
    return thrownError("the driver");
  }
}

/// Nothing if it is not recorded on and on; what is wrong goes to the table.
std::optional<RecordPlan> readRecord(settings::Table& table, const RecordKeys& keys, const std::filesystem::path& folder) {
  if (keys.file.empty()) {
    if (!keys.split.empty() || !keys.keep.empty()) table.complain("record", "has no file");
    return std::nullopt;
  }
  auto plan = readRecordPlan(keys, folder);
  if (plan) return *std::move(plan);
  table.complain("record", plan.error().message);
  return std::nullopt;
}

std::shared_ptr<const sim::LearnedCorrection> correctionOf(const SourceKeys& keys, settings::Table& table) {
  if (keys.correction.empty()) return nullptr;
  auto read = sim::readCorrection(table.resolve(keys.correction));
  if (read) return *std::move(read);
  table.complain("correction", fmt::format("= \"{}\": {}", keys.correction, read.error().message));
  return nullptr;
}

/// The opened source corrected. That it has no range is a mistake of the configuration.
Result<std::unique_ptr<drivers::Source>> openedCorrected(std::shared_ptr<const sim::LearnedCorrection> correction,
                                                         Result<std::unique_ptr<drivers::Source>> opened,
                                                         settings::Table& table) {
  if (!correction || !opened || *opened == nullptr) return opened;
  if (const std::string problem = sim::problemWith(*correction, (*opened)->info().planes, (*opened)->info().camera); !problem.empty())
    table.complain("correction", "cannot be had: " + problem);
  return corrected(std::move(correction), std::move(opened));
}

ConfiguredSource readSource(settings::Table table, std::span<const drivers::Driver> drivers,
                            const std::vector<std::string>& running, std::set<std::string>& names,
                            const std::filesystem::path& recording_folder) {
  SourceKeys keys = readSourceKeys(table, drivers, names);
  auto record = readRecord(table, keys.record, recording_folder);
  const drivers::Driver* driver = findDriver(drivers, keys.driver);
  // Relative paths in the table start at its file's folder, which therefore counts too. The stamps
  // come before the opening: a file that changes in between is opened again rather than missed.
  const std::filesystem::path log = keys.fault_log.empty() ? "" : table.resolve(keys.fault_log);
  std::string fingerprint =
      table.resolve("").string() + "\n" + table.canonicalText() + "\n" + stampsOf(table, log);
  const bool is_as_before = std::ranges::find(running, fingerprint) != running.end();
  ConfiguredSource source{std::move(keys), driver, table, nullptr, nullptr, std::move(fingerprint), is_as_before};
  source.record = std::move(record);
  if (driver == nullptr || settings::EndableReading::now().stop_requested()) return source;
  if (is_as_before) {
    table.acceptAll();
  } else {
    source.faults = std::make_shared<FaultPlan>(source.keys.faults, source.keys.name, log);
    source.correction = correctionOf(source.keys, source.table);
    source.opened = FaultPlan::open(
        source.faults, openedCorrected(source.correction, openGuarded(*driver, source.table), source.table));
  }
  return source;
}

std::string namesOf(std::span<const FacadeKind> facades) {
  std::string names;
  for (const FacadeKind& facade : facades) names += (names.empty() ? "" : ", ") + std::string{facade.name};
  return names;
}

/// The keys that every facade has; what is wrong with them goes to the table.
FacadeKeys readFacadeKeys(settings::Table& table, const std::set<std::string>& sources) {
  FacadeKeys keys;
  table.read(keys);
  if (!sources.contains(keys.source)) {
    table.complain(table.has("source") ? "source" : "",
                   table.has("source")
                       ? fmt::format("= \"{}\" is not the name of a [[source]] of this file", keys.source)
                       : "source is missing: it must be the name of a [[source]]");
  }
  const ListenKeys listen{.address = keys.address, .allow_remote = keys.allow_remote};
  if (auto allowed = Networks::read(keys.allow); !allowed) table.complain("allow", allowed.error().message);
  if (keys.address.empty()) {
    table.complain("address", "is empty, but a facade must listen somewhere, such as on 127.0.0.1");
  } else if (auto checked = checkListen(listen); !checked) {
    table.complain("address", checked.error().message);
  }
  return keys;
}

void checkMoreSources(settings::Table& table, const FacadeKind::MoreSources& more, const std::set<std::string>& sources) {
  for (const std::string& name : more.names) {
    if (!sources.contains(name))
      table.complain(more.key, fmt::format("names \"{}\", which is not the name of a [[source]] of this file", name));
  }
}

ConfiguredFacade readFacade(settings::Table& table, std::span<const FacadeKind> facades,
                            const std::set<std::string>& sources) {
  FacadeKeys keys = readFacadeKeys(table, sources);
  std::string fingerprint = table.resolve("").string() + "\n" + table.canonicalText() + "\n" + stampsOf(table);
  const auto kind = std::ranges::find(facades, std::string_view{keys.kind}, &FacadeKind::name);
  Unevenness unevenness = Unevenness::read(table, keys.intervals);
  ConfiguredFacade facade{std::move(keys), std::move(unevenness), std::move(fingerprint), {}};
  if (kind != facades.end() && kind->not_built.empty()) {
    facade.start = kind->read(table);
    if (kind->more_sources != nullptr) checkMoreSources(table, kind->more_sources(table.anew()), sources);
    return facade;
  }
  if (kind != facades.end()) {
    facade.not_built = fmt::format("{}: it was {}", table.place("kind"), kind->not_built);
  } else {
    table.complain(
        table.has("kind") ? "kind" : "",
        table.has("kind")
            ? fmt::format("= \"{}\" is no facade; there are: {}", facade.keys.kind, namesOf(facades))
            : fmt::format("kind is missing: it must be one of {}", namesOf(facades)));
  }
  table.acceptAll();  // whose keys the others are cannot be told
  return facade;
}

std::filesystem::path recordingFolder(const DaemonKeys& keys, const settings::Table& table) {
  if (!keys.recording_folder.empty())
    return table.resolve(keys.recording_folder).lexically_normal();
  const char* state =
      std::getenv("STATE_DIRECTORY");  // NOLINT(concurrency-mt-unsafe): nobody sets it
  return state == nullptr ? "" : state;
}

/// Null if there is no certificate, or if something is wrong with it, which goes to the table of [listen].
std::shared_ptr<const transport::TlsContext> readTls(const settings::Table& table, settings::Table& listen,
                                                     const ListenKeys& keys) {
  if (keys.certificate.empty() != keys.key.empty()) {
    listen.complain(keys.key.empty() ? "certificate" : "key", "stands alone: certificate and key belong together");
    return nullptr;
  }
  if (keys.certificate.empty()) return nullptr;
  const auto at = [&](const std::string& file) { return file.empty() ? std::filesystem::path{} : table.resolve(file); };
  auto made = transport::TlsContext::forServer({at(keys.certificate), at(keys.key), at(keys.client_authorities)}, false);
  if (made) return *std::move(made);
  listen.complain("certificate", made.error().message);
  return nullptr;
}

/// Other machines are let in encrypted and by roles, or by the word for it.
Result<> checkRemote(const ListenKeys& listen, const RoleKeys& roles) {
  const ListenKeys only_here{.address = listen.address};
  if (listen.insecure || listen.address.empty() || checkListen(only_here) || !checkListen(listen)) return {};
  const bool has_roles = !(roles.view.empty() && roles.control.empty() && roles.record.empty() && roles.admin.empty());
  if (!listen.certificate.empty() && has_roles) return {};
  return Error{Error::Code::InvalidArgument,
               fmt::format("= true lets other machines in, but there {}: `toftwin certificate` makes listen.certificate and "
                           "listen.key, [roles] say who may do what. Or set insecure = true if you trust that whole network",
                           listen.certificate.empty() ? has_roles ? "is no certificate, so that anybody listens"
                                                                  : "are no certificate and no roles"
                                                      : "are no roles, so that everybody may do all")};
}

std::shared_ptr<const Access> readAccess(settings::Table& table, const RoleKeys& keys) {
  auto roles = table.table("roles");
  if (!roles) return std::make_shared<Access>();
  roles->acceptAll();  // read above
  return std::make_shared<Access>(Access::read(
      keys, [&](const std::string& path) { return table.resolve(path); },
      [&](const std::string& key, const std::string& what) { roles->complain(key, what); }));
}

Result<Config> readConfig(settings::Table& table, std::span<const drivers::Driver> drivers,
                          const std::vector<std::string>& running, std::span<const FacadeKind> facades) {
  Config config;
  table.read(config.keys);
  if (auto listen = table.table("listen")) {
    listen->acceptAll();  // read above
    if (auto checked = checkListen(config.keys.listen); !checked)
      listen->complain("address", checked.error().message);
    config.tls = readTls(table, *listen, config.keys.listen);
    if (auto checked = checkRemote(config.keys.listen, config.keys.roles); !checked)
      listen->complain("allow_remote", checked.error().message);
  }
  config.recording_folder = recordingFolder(config.keys, table);
  if (!config.keys.audit_log.empty()) config.audit_log = table.resolve(config.keys.audit_log).lexically_normal();
  config.access = readAccess(table, config.keys.roles);
  // As all paths in the file; --socket is the shell's, and stays.
  std::string& socket = config.keys.listen.socket;
  if (!socket.empty() && socket != "auto")
    socket = table.resolve(socket).lexically_normal().string();
  std::set<std::string> names;
  for (settings::Table& below : table.tables("source")) {
    config.sources.push_back(readSource(below, drivers, running, names, config.recording_folder));
  }
  for (settings::Table& below : table.tables("facade")) {
    config.facades.push_back(readFacade(below, facades, names));
  }
  if (settings::EndableReading::now().stop_requested()) return Error{Error::Code::Stopped, "asked to stop while reading the configuration"};
  if (auto checked = table.check(); !checked) return checked.error();
  return config;
}

}  // namespace

Result<Config> loadConfig(const std::filesystem::path& file,
                          std::span<const drivers::Driver> drivers,
                          const std::vector<std::string>& running, std::stop_token stop) {
  auto table = settings::Table::load(file);
  if (!table) return table.error();
  const settings::EndableReading endable{std::move(stop)};
  return readConfig(*table, drivers, running, allFacades());
}

Result<Config> parseConfig(std::string_view toml, const std::filesystem::path& name,
                           std::span<const drivers::Driver> drivers, const std::vector<std::string>& running,
                           std::span<const FacadeKind> facades) {
  auto table = settings::Table::parse(toml, name);
  if (!table) return table.error();
  return readConfig(*table, drivers, running, facades);
}

Result<> checkListen(const ListenKeys& listen) {
  const std::string& address = listen.address;
  boost::system::error_code is_none;
  const auto parsed =
      boost::asio::ip::make_address(address == "localhost" ? "127.0.0.1" : address, is_none);
  if (address.empty()) return {};
  if (is_none) {
    return Error{
        Error::Code::InvalidArgument,
        fmt::format("= \"{}\" is no IP address: use 127.0.0.1 or ::1 (this machine only), one of "
                    "those that `ip address` shows, or \"\" for no TCP",
                    address)};
  }
  if (parsed.is_loopback() || listen.allow_remote) return {};
  return Error{
      Error::Code::InvalidArgument,
      fmt::format("= \"{}\" can be reached from other machines, and there is no password: "
                  "everyone there could see all cameras and steer them. Set allow_remote = true "
                  "if that is meant, or use 127.0.0.1",
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
  text += "\n### Every `[[facade]]`\n\n" + markdownTable(keysOf<FacadeKeys>());
  for (const FacadeKind& facade : allFacades()) {
    text += fmt::format("\n### A `[[facade]]` with `kind = \"{}\"`: {}\n\n", facade.name, facade.summary);
    text += facade.document();
  }
  return text;
}

}  // namespace toftwin::daemon
