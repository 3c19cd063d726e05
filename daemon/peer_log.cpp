// SPDX-License-Identifier: Apache-2.0
#include "daemon/peer_log.h"

#include <fmt/format.h>

#include <algorithm>

namespace toftwin::daemon {

PeerLog::Kind& PeerLog::kindOf(const std::string& peer, const char* format) {
  const auto found = kinds_.find({peer, format});
  if (found != kinds_.end()) return found->second;
  if (kinds_.size() >= kMostKinds) {  // those that have been quiet make room
    std::erase_if(kinds_, [now = clock_.steady()](const auto& kind) { return now - kind.second.last >= kPause; });
  }
  return kinds_.size() >= kMostKinds ? kinds_[{"", nullptr}] : kinds_[{peer, format}];
}

void PeerLog::write(logging::Level level, const std::string& peer, fmt::string_view format, fmt::format_args values) {
  std::uint64_t withheld = 0;
  {
    const std::scoped_lock lock{mutex_};
    Kind& kind = kindOf(peer, format.data());
    const SteadyTime now = clock_.steady();
    const bool is_quiet = now - kind.last >= kPause;
    if (kind.told > 0 && is_quiet && kind.withheld == 0) kind.told = 0;
    if (kind.told >= kAtOnce && !is_quiet) {
      ++kind.withheld;
      return;
    }
    ++kind.told;
    kind.last = now;
    withheld = std::exchange(kind.withheld, 0);
  }
  std::string text = fmt::vformat(format, values);
  if (withheld > 0) text += fmt::format(" ({} more like this of {} were not told)", withheld, peer);
  level == logging::Level::Warn ? logging::warn("{}", text) : logging::info("{}", text);
}

}  // namespace toftwin::daemon
