// SPDX-License-Identifier: Apache-2.0
#include <array>

#include "tools/cli/log.h"

namespace toftwin::cli {

std::span<const Command> commands() {
  static const std::array kCommands{
      listCommand(),      infoCommand(),       grabCommand(),       recordCommand(),  replayCommand(), importCommand(),
      poseCommand(),      rigCommand(),        setCommand(),        triggerCommand(), renderCommand(), sceneCommand(),
      calibrateCommand(), planCommand(),       measureCommand(),    compareCommand(), discoverCommand(), correctCommand(),
      validateCommand(),  suitCommand(),       logCommand(),        trendCommand(),   locateCommand(),
      usbCommand(),       doctorCommand(),     complianceCommand(), certificateCommand(), completionCommand(),
  };
  return kCommands;
}

}  // namespace toftwin::cli
