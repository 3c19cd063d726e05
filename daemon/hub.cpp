// SPDX-License-Identifier: Apache-2.0
#include "daemon/hub.h"

#include <fmt/format.h>

#include <utility>

namespace toftwin::daemon {

Hub::~Hub() {
  // Recordings are closed before their sources go.
  for (const auto& [name, source] : sources_) source->requestStop();
  recorders_.clear();
  sources_.clear();
}

void Hub::setOptions(Options options) {
  const std::scoped_lock lock{mutex_};
  options_ = std::move(options);
  budget_->setLimit(options_.total_bytes);
  recordings_budget_->setLimit(options_.recordings_bytes);
}

Hub::Options Hub::options() const {
  const std::scoped_lock lock{mutex_};
  return options_;
}

std::shared_ptr<Account> Hub::clientAccount() const {
  return std::make_shared<Account>(budget_, options().session_bytes);
}

std::shared_ptr<transport::SharedBodies> Hub::sharedBodies() {
  const std::scoped_lock lock{mutex_};
  auto bodies = shared_bodies_.lock();
  if (!bodies) shared_bodies_ = bodies = std::make_shared<transport::SharedBodies>();
  return bodies;
}

void Hub::add(std::shared_ptr<SourceHost> source) {
  const std::scoped_lock lock{mutex_};
  const std::string name = source->name();
  sources_.insert_or_assign(name, std::move(source));
}

std::vector<std::shared_ptr<void>> Hub::remove(const std::string& name) {
  std::vector<std::shared_ptr<void>> gone;
  const std::scoped_lock lock{mutex_};
  if (auto recorder = recorders_.extract(name)) {
    recorder.mapped()->stop([](const Result<std::filesystem::path>&) {});
    gone.push_back(std::move(recorder.mapped()));
  }
  if (auto source = sources_.extract(name)) {
    source.mapped()->requestStop();
    SourceHost* const host = source.mapped().get();
    gone.push_back(std::shared_ptr<void>{host, [kept = std::move(source.mapped())](void*) mutable {
                                           kept->waitForEnd();
                                           kept.reset();
                                         }});
  }
  return gone;
}

Result<std::shared_ptr<SourceHost>> Hub::find(const std::string& name) const {
  const std::scoped_lock lock{mutex_};
  if (auto found = sources_.find(name); found != sources_.end()) return found->second;
  std::string known;
  for (const auto& [other, source] : sources_) known += (known.empty() ? "" : ", ") + other;
  return Error{Error::Code::NotFound, fmt::format("there is no source \"{}\"; there are: {}", name,
                                                  known.empty() ? "none" : known)};
}

std::vector<std::shared_ptr<SourceHost>> Hub::sources() const {
  const std::scoped_lock lock{mutex_};
  std::vector<std::shared_ptr<SourceHost>> all;
  for (const auto& [name, source] : sources_) all.push_back(source);
  return all;
}

namespace {

/// Clients that do not know facades read it in their source's last error.
std::string facadeProblemsOf(const std::string& source, const std::vector<wire::FacadeHealth>& facades) {
  std::string told;
  for (const wire::FacadeHealth& one : facades) {
    if (one.source != source || one.state != FacadeState::NotThere) continue;
    told += fmt::format("{}facade {}: {}", told.empty() ? "" : "; ", one.kind, one.problem);
  }
  return told;
}

}  // namespace

wire::Health Hub::health() const {
  wire::Health health;
  health.uptime = std::chrono::duration<double>{clock_.steady() - began_}.count() * second;
  health.sessions = sessions;
  const std::scoped_lock lock{mutex_};
  for (const ToldFacade& one : facades_) {
    health.facades.push_back(one.health);
    const std::int64_t clients = one.clients ? one.clients->load() : -1;
    if (clients >= 0) health.facades.back().clients = static_cast<std::uint32_t>(clients);
    if (one.booting && *one.booting) health.facades.back().state = FacadeState::Booting;
  }
  for (const auto& [name, source] : sources_) {
    health.sources.push_back(source->health());
    std::string& last_error = health.sources.back().last_error;
    if (const std::string problem = facadeProblemsOf(name, health.facades); !problem.empty())
      last_error = problem + (last_error.empty() ? "" : "; camera: " + last_error);
    const auto recorder = recorders_.find(name);
    if (recorder == recorders_.end()) continue;
    if (!recorder->second->isFinished()) health.sources.back().recording_by = recorder->second->owner().text;
    if (std::string problem = recorder->second->problem(); !problem.empty()) {
      last_error = "recording: " + problem;
    }
  }
  return health;
}

void Hub::setFacades(std::vector<ToldFacade> facades) {
  const std::scoped_lock lock{mutex_};
  facades_ = std::move(facades);
}

void Hub::startRecording(const std::string& source, std::string_view file, Subscribing owner, RecordDone done) {
  auto host = find(source);
  if (!host) return done(host.error());
  const Options now = options();
  auto path = recordingPath(now.recording_folder, file);
  if (!path) return done(path.error());
  auto recorder = std::make_shared<Recorder>(
      *host, *path,
      Recorder::Options{now.recording, now.backlog_bytes,
                        std::make_shared<Account>(recordings_budget_, now.recordings_bytes), std::move(owner)});
  std::shared_ptr<Recorder> before;  // destroyed without the lock
  {
    const std::scoped_lock lock{mutex_};
    const auto [at, is_first] = recorders_.try_emplace(source, recorder);
    if (!is_first && !at->second->isFinished()) {
      return done(Error{Error::Code::Busy,
                        fmt::format("the source \"{}\" is being recorded already, for {}; stop that first", source,
                                    at->second->owner().text)});
    }
    if (!is_first) before = std::exchange(at->second, recorder);
  }
  recorder->start([done](const Result<std::filesystem::path>& opened) {
    if (opened) return done(opened->string());
    done(opened.error());
  });
}

void Hub::keepRecording(const std::string& source, const RecordPlan& plan) {
  const auto host = find(source);
  if (!host) return;
  const Options now = options();
  Recorder::Options recording{now.recording, now.backlog_bytes,
                              std::make_shared<Account>(recordings_budget_, now.recordings_bytes),
                              {.name = "the configuration", .text = "the configuration"}};
  recording.plan = plan;
  recording.clock = &clock_;
  auto recorder = std::make_shared<Recorder>(*host, plan.pattern, std::move(recording));
  {
    const std::scoped_lock lock{mutex_};
    recorders_.insert_or_assign(source, recorder);
  }
  recorder->start([](const Result<std::filesystem::path>&) {});
}

void Hub::setAudit(std::shared_ptr<AuditLog> audit) {
  const std::scoped_lock lock{mutex_};
  audit_ = std::move(audit);
}

std::shared_ptr<AuditLog> Hub::auditLog() const {
  const std::scoped_lock lock{mutex_};
  return audit_;
}

void Hub::audit(const std::string& who, const std::string& source, const std::string& what,
                const Result<>& outcome) const {
  if (const auto log = auditLog()) log->tell(who, source, what, outcome);
}

void Hub::stopRecording(const std::string& source, const std::optional<std::string>& by, RecordDone done) {
  auto host = find(source);
  if (!host) return done(host.error());
  std::shared_ptr<Recorder> recorder;
  {
    const std::scoped_lock lock{mutex_};
    if (auto found = recorders_.find(source); found != recorders_.end()) recorder = found->second;
  }
  if (!recorder || recorder->isSettled()) {
    return done(
        Error{Error::Code::NotFound,
              fmt::format("the source \"{}\" is not being recorded, so there is nothing to stop",
                          source)});
  }
  if (by && recorder->owner().name != *by) {
    return done(Error{Error::Code::PermissionDenied,
                      fmt::format("the recording of \"{}\" belongs to {}: ask them, or stop it as the daemon's own user",
                                  source, recorder->owner().text)});
  }
  recorder->stop([done](const Result<std::filesystem::path>& closed) {
    if (closed) return done(closed->string());
    done(closed.error());
  });
}

}  // namespace toftwin::daemon
