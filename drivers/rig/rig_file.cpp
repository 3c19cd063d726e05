// SPDX-License-Identifier: Apache-2.0
#include "drivers/rig/rig_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <utility>

#include "protocol/settings/describe.h"
#include "protocol/settings/settings.h"

namespace toftwin::rig {
namespace {

using settings::Table;

bool isWritable(const Signal& signal) {
  return signal.memory == Memory::Coil || signal.memory == Memory::Holding;
}

/// Complaints about a signal, in the table that has it under that key.
void checkSignal(Table& table, const char* key, const Signal& signal, bool must_be_there,
                 bool is_written) {
  if (!signal.isThere()) {
    if (must_be_there) table.complain(key, "must be there, with an address");
    return;
  }
  if (is_written && !isWritable(signal)) {
    table.complain(key, "is written, so its memory must be coil or holding");
  }
  if (signal.scale == 0.0) table.complain(key, "has scale 0, so that nothing can be told");
}

void checkAxis(Table& table, const AxisSpec& axis, std::set<std::string>& names) {
  if (axis.name.empty()) table.complain("name", "must be there");
  if (!axis.name.empty() && !names.insert(axis.name).second) {
    table.complain("name", fmt::format("= \"{}\" comes twice", axis.name));
  }
  if (!(axis.min < axis.max)) {
    table.complain("min", fmt::format("= {} must be below max = {}: these are the soft limits",
                                      axis.min, axis.max));
  }
  if (axis.direction == std::array<double, 3>{}) table.complain("direction", "has no length");
  checkSignal(table, "target", axis.target, true, true);
  checkSignal(table, "position", axis.position, true, false);
}

/// A rig that is looked at once within the time would always have stalled.
void checkStallTime(Table& table, const char* key, Duration time, const RigFile& file) {
  if (time == 0_s || time > file.poll) return;
  table.complain(key, fmt::format("= {:.6g} must be above poll_ms = {:.6g}", time.in(millisecond),
                                  file.poll.in(millisecond)));
}

void checkAll(Table& table, const RigFile& file) {
  checkStallTime(table, "stall_time_ms", file.stall_time, file);
  checkStallTime(table, "home_stall_time_ms", file.home_stall_time, file);
  if (file.host.empty()) table.complain("", "has no host: write the controller's address");
  checkSignal(table, "stop", file.stop, true, true);
  const std::pair<const char*, const Signal*> written[] = {{"home", &file.home},
                                                           {"go", &file.go},
                                                           {"heartbeat", &file.heartbeat},
                                                           {"captured", &file.captured}};
  for (const auto& [key, signal] : written) checkSignal(table, key, *signal, false, true);
  const std::pair<const char*, const Signal*> read[] = {
      {"emergency", &file.emergency},     {"fault", &file.fault},
      {"fault_code", &file.fault_code},   {"homed", &file.homed},
      {"in_position", &file.in_position}, {"trigger", &file.trigger}};
  for (const auto& [key, signal] : read) checkSignal(table, key, *signal, false, false);
  if (file.home.isThere() != file.homed.isThere()) {
    table.complain(file.home.isThere() ? "home" : "homed",
                   file.home.isThere() ? "is there without homed; they belong together"
                                       : "is there without home; they belong together");
  }
  if (file.axes.empty()) table.complain("", "has no [[axis]]");
  auto tables = table.tables("axis");
  std::set<std::string> names;
  for (std::size_t i = 0; i < std::min(tables.size(), file.axes.size()); ++i) {
    tables[i].acceptAll();  // their keys were read, and looked at, before
    checkAxis(tables[i], file.axes[i], names);
  }
  auto temperatures = table.tables("temperature");
  for (std::size_t i = 0; i < std::min(temperatures.size(), file.temperatures.size()); ++i) {
    temperatures[i].acceptAll();
    checkSignal(temperatures[i], "signal", file.temperatures[i].signal, true, false);
  }
}

/// Lists a signal as one key.
class RigLister : public settings::Lister {
 public:
  explicit RigLister(std::vector<settings::Key>& keys, std::string prefix = {})
      : Lister(keys, prefix), keys_(keys), prefix_(std::move(prefix)) {}

  void group(const char* name, Signal&, const char* help) {
    keys_.push_back({prefix_ + name, "{}", "a signal", "", help});
  }
  template <class Aggregate>
  void group(const char* name, std::vector<Aggregate>&, const char*) {
    Aggregate example;
    RigLister below{keys_, prefix_ + name + "[]."};
    example.visit(below);
  }

 private:
  std::vector<settings::Key>& keys_;
  std::string prefix_;
};

}  // namespace

std::string documentRig() {
  std::vector<settings::Key> keys;
  RigLister lister{keys};
  RigFile file;
  file.visit(lister);
  return settings::markdownTable(keys) + "\nA signal is a table itself:\n\n" +
         settings::markdownTable(settings::keysOf<Signal>());
}

Result<RigFile> loadRig(const std::filesystem::path& path) {
  auto table = Table::load(path);
  if (!table) return table.error();
  RigFile file;
  table->read(file);
  checkAll(*table, file);
  if (auto checked = table->check(); !checked) return checked.error();
  return file;
}

}  // namespace toftwin::rig
