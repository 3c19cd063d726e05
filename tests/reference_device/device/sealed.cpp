// SPDX-License-Identifier: Apache-2.0
#include "tests/reference_device/device/sealed.h"

#include <algorithm>
#include <string>
#include <string_view>

#include "protocol/settings/settings.h"

namespace toftwin::reference {

Result<Sealed> readSealed(const std::filesystem::path& file, double scale) {
  Sealed sealed;
  if (file.empty()) return sealed;
  auto table = settings::Table::load(file);
  if (!table) return table.error();
  if (auto rig = table->table("rig")) rig->read(sealed.rig);
  for (settings::Table& one : table->tables("hidden")) {
    const std::string name = one.text("effect").value_or("");
    const auto rows = allHidden();
    const auto row = std::ranges::find(rows, name, [](const Row& r) { return r.about.name; });
    if (row == rows.end()) {
      one.complain("effect",
                   "\"" + name + "\" is none of this device's hidden effects (docs/reference-device.md)");
      one.acceptAll();
      continue;
    }
    sealed.hidden.push_back(row->read(one));
    sealed.hidden.back()->strength *= scale;
    sealed.changes_each_frame |= row->about.covariates.find("frame") != std::string_view::npos;
  }
  if (auto checked = table->check(); !checked) return checked.error();
  return sealed;
}

}  // namespace toftwin::reference
