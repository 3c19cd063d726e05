// SPDX-License-Identifier: Apache-2.0
#include "daemon/start_signals.h"

#include <csignal>
#include <initializer_list>

namespace toftwin::daemon {
namespace {

// A signal handler can reach nothing else.
volatile std::sig_atomic_t wants_reload = 0;  // NOLINT(cppcoreguidelines-avoid-non-const-global-variables)
volatile std::sig_atomic_t wants_stop = 0;    // NOLINT(cppcoreguidelines-avoid-non-const-global-variables)

void note(int number) {
  if (number == SIGHUP) {
    wants_reload = 1;
  } else {
    wants_stop = 1;
  }
}

}  // namespace

StartSignals::StartSignals() {
  wants_reload = 0;
  wants_stop = 0;
  for (const int number : {SIGHUP, SIGTERM, SIGINT}) {
    struct sigaction action {};
    action.sa_handler = note;
    action.sa_flags = SA_RESTART | (number == SIGHUP ? 0 : SA_RESETHAND);
    ::sigaction(number, &action, nullptr);
  }
}

bool StartSignals::isReloadWanted() { return wants_reload != 0; }
bool StartSignals::isStopWanted() { return wants_stop != 0; }

}  // namespace toftwin::daemon
