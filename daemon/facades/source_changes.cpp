// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/source_changes.h"

#include <algorithm>
#include <utility>

namespace toftwin::daemon {

Result<> setAll(drivers::Source& source, SourceChanges changes) {
  const auto before = source.state().parameters;
  SourceChanges done;
  while (!changes.empty()) {
    SourceChanges refused;
    Result<> first_refusal;
    for (auto& [name, value] : changes) {
      auto set = source.setParameter(name, value);
      if (set) {
        done.emplace_back(name, value);
        continue;
      }
      if (first_refusal) first_refusal = set;
      refused.emplace_back(name, value);
    }
    if (refused.size() == changes.size()) {
      std::ranges::reverse(done);
      for (const auto& [name, value] : done) {
        const auto was = std::ranges::find(before, name, &Parameter::name);
        if (was != before.end() && was->value) static_cast<void>(source.setParameter(name, *was->value));
      }
      return first_refusal;
    }
    changes = std::move(refused);
  }
  return {};
}

}  // namespace toftwin::daemon
