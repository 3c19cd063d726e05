// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/openni2/worker.h"

#include <dlfcn.h>
#include <pthread.h>

#include <csignal>
#include <memory>
#include <utility>

namespace toftwin::openni2 {
namespace {

constexpr std::chrono::seconds kWorkPatience{6};  // longer than a client waits for an answer

/// The code of a thread that is left behind must stay where it is.
void keepModule() {
  Dl_info here{};
  if (::dladdr(reinterpret_cast<void*>(&keepModule), &here) == 0) return;
  ::dlopen(here.dli_fname, RTLD_NOW | RTLD_NOLOAD | RTLD_NODELETE);
}

}  // namespace

struct SignalsBlocked::Mask {
  sigset_t signals;
};
SignalsBlocked::SignalsBlocked() : before_(std::make_unique<Mask>()) {
  sigset_t all;
  ::sigfillset(&all);
  ::pthread_sigmask(SIG_SETMASK, &all, &before_->signals);
}
SignalsBlocked::~SignalsBlocked() { ::pthread_sigmask(SIG_SETMASK, &before_->signals, nullptr); }

Worker::Worker(std::function<void(std::stop_token)> run) {
  const SignalsBlocked blocked;
  std::packaged_task<void()> task{[run = std::move(run), stop = stop_.get_token()] { run(stop); }};
  ended_ = task.get_future();
  thread_ = std::thread{std::move(task)};
}

bool Worker::finish() {
  if (!thread_.joinable()) return true;
  stop_.request_stop();
  const bool is_itself = thread_.get_id() == std::this_thread::get_id();
  if (!is_itself && ended_.wait_for(kWorkPatience) == std::future_status::ready) {
    thread_.join();
    return true;
  }
  keepModule();
  thread_.detach();
  return false;
}

}  // namespace toftwin::openni2
