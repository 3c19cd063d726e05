// SPDX-License-Identifier: Apache-2.0
// Of builds without libmodbus.
#include "drivers/rig/bus.h"

namespace toftwin::rig {

struct Bus::Line {};

bool hasModbus() { return false; }
Bus::Bus(std::unique_ptr<Line> line) : line_(std::move(line)) {}
Bus::~Bus() = default;

Result<std::unique_ptr<Bus>> Bus::open(const RigFile&) {
  return Error{Error::Code::Unsupported,
               "this build cannot reach a rig: install libmodbus-dev, configure again and build"};
}
Result<double> Bus::read(const Signal&, std::string_view) { return 0.0; }
Result<bool> Bus::isSet(const Signal&, std::string_view) { return false; }
Result<> Bus::write(const Signal&, double, std::string_view) { return {}; }
Result<> Bus::set(const Signal&, bool, std::string_view) { return {}; }

}  // namespace toftwin::rig
