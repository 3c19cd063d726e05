// SPDX-License-Identifier: Apache-2.0
#include "drivers/compliance.h"

#include <fmt/format.h>

#include <array>
#include <chrono>
#include <cmath>
#include <functional>
#include <future>
#include <thread>
#include <utility>

#include <toftwin/names.h>

namespace toftwin::drivers {
namespace {

using Clock = std::chrono::steady_clock;

template <class... Parts>
Error broken(fmt::format_string<Parts...> format, Parts&&... parts) {
  return {Error::Code::Internal, fmt::format(format, std::forward<Parts>(parts)...)};
}
Error doesNotApply(std::string why) { return {Error::Code::Unsupported, std::move(why)}; }

Result<std::unique_ptr<Source>> openWith(const Driver& driver, const std::string& keys) {
  auto table = settings::Table::parse(keys, "compliance.toml");
  if (!table) return table.error();
  return driver.open(*table);
}

/// The camera under test with the little that every check needs.
struct Bench {
  const Candidate& candidate;
  const ComplianceOptions& options;
  std::unique_ptr<Source> source;

  Result<Frame> frame(bool lockstep = false) {
    const auto deadline = Clock::now() + options.frame_timeout;
    if (source->info().can_trigger && !lockstep) {
      if (auto done = source->trigger(); !done) return done.error();
    }
    while (true) {
      Result<Frame> next = source->next({}, lockstep);
      if (next || next.error().code != Error::Code::Timeout) return next;
      if (Clock::now() > deadline)
        return broken("no frame within {} ms", options.frame_timeout.count());
    }
  }

  /// Gives each of the next frames to `look`, which says what is wrong with it.
  Result<> frames(const std::function<Result<>(const Frame&)>& look) {
    for (int i = 0; i < options.frames; ++i) {
      Result<Frame> next = frame();
      if (!next && next.error().code == Error::Code::EndOfStream && i > 0) return {};
      if (!next) return next.error();
      if (auto seen = look(*next); !seen) return broken("frame {}: {}", i, seen.error().message);
    }
    return {};
  }
};

Result<> absentCameraIsNamed(Bench& bench) {
  const Candidate& candidate = bench.candidate;
  if (candidate.absent_keys.empty()) return doesNotApply("no absent camera to ask for");
  const auto opened = openWith(*candidate.driver, candidate.absent_keys);
  if (opened) return broken("{} was opened although it is not there", candidate.absent_name);
  if (opened.error().message.find(candidate.absent_name) == std::string::npos) {
    return broken("the error does not name {}: {}", candidate.absent_name, opened.error().message);
  }
  return {};
}

Result<> describesItself(Bench& bench) {
  const SourceInfo& info = bench.source->info();
  if (info.driver != bench.candidate.driver->name) {
    return broken("info().driver is \"{}\", the row's name is \"{}\"", info.driver,
                  bench.candidate.driver->name);
  }
  if (info.model.empty()) return broken("info().model is empty");
  if (info.camera.width < 1 || info.camera.height < 1) return broken("info().camera has no pixels");
  if (info.planes.empty()) return broken("info().planes is empty");
  return {};
}

Result<> infoIsConstant(Bench& bench) {
  const SourceInfo before = bench.source->info();
  return bench.frames([&](const Frame& frame) -> Result<> {
    const SourceInfo& now = bench.source->info();
    // Not its planes: what is set, perhaps by another program, may give it others.
    if (now.camera != before.camera || now.model != before.model || now.serial != before.serial) {
      return broken("info() changed while the camera was open");
    }
    if (frame.camera != before.camera) return broken("its CameraInfo is not that of info()");
    if (frame.provenance.kind != before.kind) {
      return broken("it is {}, but info() says {}", nameOf(frame.provenance.kind),
                    nameOf(before.kind));
    }
    return {};
  });
}

Result<> planesAreAsAnnounced(Bench& bench) {
  return bench.frames([&](const Frame& frame) -> Result<> {
    const auto& announced = bench.source->info().planes;
    if (frame.planes.size() != announced.size()) {
      return broken("{} planes, announced were {}", frame.planes.size(), announced.size());
    }
    for (std::size_t i = 0; i < announced.size(); ++i) {
      const Plane& plane = frame.planes[i];
      if (plane.kind != announced[i]) {
        return broken("plane {} is {}, announced was {}", i, nameOf(plane.kind),
                      nameOf(announced[i]));
      }
      if (plane.width != frame.camera.width || plane.height != frame.camera.height ||
          plane.channels < 1 || plane.data.size() != plane.byteSize()) {
        return broken("{}: {} x {} x {} with {} bytes does not fit the camera's {} x {}",
                      nameOf(plane.kind), plane.width, plane.height, plane.channels,
                      plane.data.size(), frame.camera.width, frame.camera.height);
      }
    }
    return {};
  });
}

Result<> invalidPixelsAreNaN(Bench& bench) {
  return bench.frames([](const Frame& frame) -> Result<> {
    const Plane* flags = frame.find(PlaneKind::Flags);
    for (const PlaneKind kind : {PlaneKind::Range, PlaneKind::Depth}) {
      const Plane* plane = frame.find(kind);
      if (plane == nullptr || plane->type != ElementType::F32) continue;
      const auto values = plane->as<float>();
      for (std::size_t i = 0; i < values.size(); ++i) {
        const bool has_value = std::isfinite(values[i]) && values[i] > 0.0F;
        if (!has_value && !std::isnan(values[i])) {
          return broken("{} of pixel {} is {}; without a value it must be NaN", nameOf(kind), i,
                        values[i]);
        }
        if (flags == nullptr) continue;
        const bool invalid =
            (flags->as<std::uint8_t>()[i] & static_cast<std::uint8_t>(PixelFlag::Invalid)) != 0;
        if (invalid == has_value) {
          return broken("{} of pixel {} is {}, but its flags say {}", nameOf(kind), i, values[i],
                        invalid ? "invalid" : "valid");
        }
      }
    }
    return {};
  });
}

/// Checks frame after frame that device time goes on.
struct TimeCheck {
  std::optional<DeviceTime> last;
  Result<> operator()(const Frame& frame) {
    if (frame.moment.exposures.empty()) return broken("it has no exposure");
    const DeviceTime begin = frame.moment.exposures.front().start;
    if (last && begin <= *last) {
      return broken("device time {} ns does not follow {} ns", begin.ns, last->ns);
    }
    for (const Exposure& exposure : frame.moment.exposures) {
      if (last && exposure.start < *last) return broken("exposures are not in the order taken");
      last = exposure.start;
    }
    return {};
  }
};

Result<> deviceTimeStrictlyIncreases(Bench& bench) { return bench.frames(TimeCheck{}); }

Result<> startsThreeTimes(Bench& bench) {
  TimeCheck time;
  for (int round = 0; round < 3; ++round) {
    if (round > 0) {
      bench.source->stop();
      if (auto started = bench.source->start(); !started) return started;
    }
    const auto seen = bench.frames([&](const Frame& frame) { return time(frame); });
    if (!seen) return broken("start {}: {}", round + 1, seen.error().message);
  }
  return {};
}

Result<> stopsWhenAsked(Bench& bench) {
  std::stop_source stop;
  auto ended = std::async(std::launch::async, [&] {
    while (true) {
      const Result<Frame> next = bench.source->next(stop.get_token(), false);
      if (!next && next.error().code != Error::Code::Timeout) return next.error();
    }
  });
  // Some frames first, if they come by themselves; how many does not matter.
  std::this_thread::sleep_for(std::chrono::milliseconds{50});
  const auto asked = Clock::now();
  stop.request_stop();
  const Error error = ended.get();
  const auto took = std::chrono::duration_cast<std::chrono::milliseconds>(Clock::now() - asked);
  if (error.code == Error::Code::EndOfStream) return doesNotApply("its stream ended before");
  if (error.code != Error::Code::Stopped) return broken("the wait ended with: {}", error.message);
  if (took > bench.options.stop_timeout) return broken("it took {} ms", took.count());
  return {};
}

Result<> refusesWhatItCannot(Bench& bench) {
  const SourceInfo& info = bench.source->info();
  if (!info.can_set_pose && bench.source->setPose({})) return broken("setPose succeeded");
  if (!info.can_trigger && bench.source->trigger()) return broken("trigger succeeded");
  if (bench.source->setParameter("there is no such parameter", 0.0)) {
    return broken("an unknown parameter was accepted");
  }
  if (info.can_set_pose) {
    if (auto done = bench.source->setPose({}); !done) return done;
  }
  return {};
}

Result<> poseIsThatOfTheNextFrame(Bench& bench) {
  if (!bench.source->info().can_set_pose) return doesNotApply("it cannot be given a pose");
  const Transform<World, Camera> pose{{1.0, 0.0, 0.0, 0.0}, {0.0, 0.0, -0.015625}};
  if (auto done = bench.source->setPose(pose); !done) return done;
  const Result<Frame> next = bench.frame(bench.source->info().can_lockstep);
  if (!next) return next.error();
  if (next->moment.world_from_camera != pose) return broken("the next frame carries another pose");
  return {};
}

/// Set to each of its choices, and at last to the text that it had, it is so. A choice may be refused beside
/// what the others are now; what is none may not be taken.
Result<> keepsItsText(Source& source, std::size_t place, const Parameter& parameter) {
  const auto& [name, value, bounds, text, choices] = parameter;
  std::vector<std::string> wanted = choices;
  wanted.push_back(*text);
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    const Result<> set = source.setParameterText(name, wanted[i]);
    const bool may_stay = !set && set.error().code == Error::Code::InvalidArgument && i + 1 < wanted.size();
    if (may_stay) continue;
    if (!set) return broken("{} = {}: {}", name, wanted[i], set.error().message);
    if (source.state().parameters.at(place).text != wanted[i])
      return broken("{} was set to {}, but state() says otherwise", name, wanted[i]);
  }
  if (!choices.empty() && source.setParameterText(name, "there is no such choice"))
    return broken("{}: a choice that is none was accepted", name);
  return {};
}

Result<> stateIsWhatWasSet(Bench& bench) {
  Source& source = *bench.source;
  const std::vector<Parameter> before = source.state().parameters;
  std::vector<std::string> names;
  for (const Parameter& parameter : before) names.push_back(parameter.name);
  if (names != source.info().parameters)
    return broken("state() names other parameters than info()");
  for (std::size_t i = 0; i < before.size(); ++i) {
    const auto& [name, value, bounds, text, choices] = before[i];
    if (text) {
      if (auto same = keepsItsText(source, i, before[i]); !same) return same;
    }
    if (!value) continue;
    if (!bounds.contains(*value))
      return broken("{} = {} is outside of the bounds that state() gives", name, *value);
    const bool has_low = std::isfinite(bounds.min);
    const double wanted = has_low ? bounds.min : *value;
    const Result<> set = source.setParameter(name, wanted);
    // Its bounds are its own; beside what the others are now it may still not go.
    const bool may_stay = !set && set.error().code == Error::Code::InvalidArgument;
    if (may_stay && source.state().parameters.at(i).value == value) continue;
    if (!set) return broken("{} = {}: {}", name, wanted, set.error().message);
    if (source.state().parameters.at(i).value != wanted)
      return broken("{} was set to {}, but state() says otherwise", name, wanted);
    if (auto done = source.setParameter(name, *value); !done)
      return broken("{} = {} again: {}", name, *value, done.error().message);
  }
  if (!source.info().can_set_pose) return {};
  const Transform<World, Camera> pose{{1.0, 0.0, 0.0, 0.0}, {0.0, 0.0, -0.015625}};
  if (auto done = source.setPose(pose); !done) return done;
  if (source.state().world_from_camera != pose) return broken("state() has another pose than set");
  return {};
}

Result<> lockstepDoesNotWait(Bench& bench) {
  if (!bench.source->info().can_lockstep) return doesNotApply("it cannot be paced");
  for (int i = 0; i < bench.options.frames; ++i) {
    const Result<Frame> next = bench.source->next({}, true);
    if (!next && next.error().code == Error::Code::EndOfStream) return {};
    if (!next) return broken("frame {}: {}", i, next.error().message);
  }
  return {};
}

struct Check {
  std::string_view name, because;
  Result<> (*run)(Bench&);
};
constexpr std::array kChecks{
    Check{"an absent camera is named",
          "\"open failed\" leaves the user guessing which cable to look at", absentCameraIsNamed},
    Check{"it describes itself",
          "a client cannot choose among cameras that do not say what they are", describesItself},
    Check{"what it says of itself is constant", "clients read the calibration once and trust it",
          infoIsConstant},
    Check{"planes are as announced", "clients size their buffers by the announcement",
          planesAreAsAnnounced},
    Check{"invalid pixels are NaN", "a zero for \"no value\" looks like a wall at the lens",
          invalidPixelsAreNaN},
    Check{"device time strictly increases",
          "two frames with one time cannot be told apart or paired", deviceTimeStrictlyIncreases},
    Check{"it starts and stops three times",
          "handles that stop() forgets fail the second or third start", startsThreeTimes},
    Check{"it stops when asked", "a daemon that cannot end a wait cannot end at all",
          stopsWhenAsked},
    Check{"it refuses what it cannot do",
          "a command that does nothing and says \"done\" hides mistakes", refusesWhatItCannot},
    Check{"a pose is that of the next frame",
          "a robot that moved must not get the view from before", poseIsThatOfTheNextFrame},
    Check{"it says what was set",
          "people who cannot see a parameter's value set it blindly, and cannot put it back",
          stateIsWhatWasSet},
    Check{"lockstep does not wait", "a paced source that also waits makes every simulation slow",
          lockstepDoesNotWait},
};

Finding runOne(const Check& check, const Candidate& candidate, const ComplianceOptions& options) {
  Finding finding{check.name, check.because, Finding::Outcome::Passed, {}};
  auto opened = openWith(*candidate.driver, candidate.keys);
  if (!opened) {
    return {check.name, check.because, Finding::Outcome::Failed, opened.error().message};
  }
  Bench bench{candidate, options, *std::move(opened)};
  Result<> outcome = bench.source->start();
  if (outcome) outcome = check.run(bench);
  bench.source->stop();
  if (outcome) return finding;
  finding.outcome = outcome.error().code == Error::Code::Unsupported
                        ? Finding::Outcome::DoesNotApply
                        : Finding::Outcome::Failed;
  finding.detail = outcome.error().message;
  return finding;
}

}  // namespace

Candidate listedCamera(const Driver& driver, const std::string& uri) {
  const std::string absent = std::string{driver.name} + ":there-is-no-such-camera";
  return {.driver = &driver,
          .keys = fmt::format("uri = '{}'", uri),
          .absent_keys = fmt::format("uri = '{}'", absent),
          .absent_name = absent};
}

std::vector<Finding> checkCompliance(const Candidate& camera, const ComplianceOptions& options) {
  std::vector<Finding> findings;
  for (const Check& check : kChecks) {
    if (options.interrupted && options.interrupted()) break;
    findings.push_back(runOne(check, camera, options));
    if (options.report) options.report(findings.back());
  }
  return findings;
}

}  // namespace toftwin::drivers
