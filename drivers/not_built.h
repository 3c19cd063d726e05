// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/source.h"
#include "protocol/settings/describe.h"

namespace toftwin::drivers {

/// The row of a driver that this build lacks: its keys are documented as ever, it lists no camera,
/// and whoever opens one reads how to get it; that is no mistake of the file, and the daemon's other sources run. `What` has name, summary, remedy ("install
/// libopenni2-dev and configure again") and Keys.
template <class What>
Driver notBuilt() {
  static const std::string why = fmt::format("not built: {}", What::remedy);
  return {.name = What::name,
          .summary = What::summary,
          .list = [] { return std::vector<std::string>{}; },
          .open = [](settings::Table& table) -> Result<std::unique_ptr<Source>> {
            table.acceptAll();
            return Error{Error::Code::Unsupported,
                         fmt::format("{}: the driver \"{}\" was {}",
                                     table.place(table.has("driver") ? "driver" : ""), What::name, why)};
          },
          .document = [] { return settings::markdownTable(settings::keysOf<typename What::Keys>()); },
          .not_built = why};
}

}  // namespace toftwin::drivers
