// SPDX-License-Identifier: Apache-2.0
#include "drivers/o3d303/configuration.h"

#include <fmt/format.h>

#include <charconv>
#include <functional>
#include <optional>
#include <random>

namespace toftwin::drivers::o3d303 {
namespace {

constexpr int kRun = 0, kEdit = 1;

/// One per process: a session that a broken connection left behind is ours to end, another's is
/// not.
const std::string& sessionId() {
  static const std::string id = [] {
    std::random_device random;
    std::string digits;
    for (int i = 0; i < 4; ++i) digits += fmt::format("{:08x}", random());
    return digits;
  }();
  return id;
}
std::string sessionPath() { return "session_" + sessionId() + "/"; }

/// A session in edit mode with the active application open. Ends with the object.
class EditSession {
 public:
  static Result<EditSession> open(Rpc& rpc, const std::string& password) {
    const auto active = rpc.parameter("ActiveApplication");
    if (!active) return active.error();
    int index = 0;
    std::from_chars(active->data(), active->data() + active->size(), index);
    if (index < 1) {
      return Error{
          Error::Code::Incompatible,
          "o3d303: the camera has no active application; make one active with the vendor's tool"};
    }
    static_cast<void>(rpc.call(sessionPath(), "cancelSession", {}));  // left behind by a lost line
    if (auto begun = rpc.call("", "requestSession", {password, sessionId()}); !begun)
      return begun.error();
    EditSession session{rpc};
    if (auto done = rpc.call(sessionPath(), "setOperatingMode", {kEdit}); !done)
      return done.error();
    if (auto done = rpc.call(sessionPath() + "edit/", "editApplication", {index}); !done) {
      return done.error();
    }
    return session;
  }
  EditSession(EditSession&& other) noexcept : rpc_(std::exchange(other.rpc_, nullptr)) {}
  EditSession& operator=(EditSession&&) = delete;
  ~EditSession() {
    if (rpc_ == nullptr) return;
    static_cast<void>(call("edit/", "stopEditingApplication", {}));
    static_cast<void>(call("", "setOperatingMode", {kRun}));
    static_cast<void>(call("", "cancelSession", {}));
  }

  Result<XmlRpcValue> call(const std::string& object, const char* method,
                           std::vector<XmlRpcValue> params) {
    return rpc_->call(sessionPath() + object, method, std::move(params));
  }
  Result<> set(const std::string& object, const Changes& changes) {
    for (const auto& [name, value] : changes) {
      auto done = call(object, "setParameter", {name, value});
      if (!done) {
        return Error{done.error().code,
                     fmt::format("{} = {}: {}", name, value, done.error().message)};
      }
    }
    return {};
  }
  Result<std::map<std::string, std::string>> parametersOf(const std::string& object) {
    const auto all = call(object, "getAllParameters", {});
    if (!all) return all.error();
    std::map<std::string, std::string> texts;
    if (const auto* members = std::get_if<XmlRpcValue::Struct>(&all->value)) {
      for (const auto& [name, value] : *members) texts[name] = value.text();
    }
    return texts;
  }

 private:
  explicit EditSession(Rpc& rpc) : rpc_(&rpc) {}
  Rpc* rpc_;
};

constexpr const char* kApplication = "edit/application/";
constexpr const char* kImager = "edit/application/imager_001/";

Result<Configuration> readAll(EditSession& session) {
  auto application = session.parametersOf(kApplication);
  if (!application) return application.error();
  auto imager = session.parametersOf(kImager);
  if (!imager) return imager.error();
  return Configuration{*std::move(application), *std::move(imager)};
}

Result<Configuration> configureBy(Rpc& rpc, const std::string& password,
                                  const std::function<Wanted(const Configuration&)>& wish) {
  auto session = EditSession::open(rpc, password);
  if (!session) return session.error();
  auto now = readAll(*session);
  if (!now) return now;
  const Wanted wanted = wish(*now);
  if (wanted.application.empty() && wanted.imager.empty()) return now;
  if (auto set = session->set(kApplication, wanted.application); !set) return set.error();
  if (auto set = session->set(kImager, wanted.imager); !set) return set.error();
  if (auto saved = session->call(kApplication, "save", {}); !saved) return saved.error();
  return readAll(*session);
}

std::string valueOf(const std::map<std::string, std::string>& texts, const char* name) {
  const auto found = texts.find(name);
  return found == texts.end() ? std::string{} : found->second;
}

/// The imager's type, "under5m_low": measuring range and number of exposures.
std::string imagerType(const Keys& keys, const std::string& now) {
  const std::size_t cut = now.find('_');
  std::string range = now.substr(0, cut);
  std::string exposures = cut == std::string::npos ? "low" : now.substr(cut + 1);
  switch (keys.measuring_range) {
    case MeasuringRange::AsSet:
      break;
    case MeasuringRange::Under5m:
      range = "under5m";
      break;
    case MeasuringRange::UpTo30m:
      range = "upto30m";
      break;
    case MeasuringRange::MoreThan30m:
      range = "morethan30m";
      break;
  }
  switch (keys.exposures) {
    case Exposures::AsSet:
      break;
    case Exposures::Low:
      exposures = "low";
      break;
    case Exposures::Moderate:
      exposures = "moderate";
      break;
    case Exposures::High:
      exposures = "high";
      break;
  }
  return range + "_" + exposures;
}

}  // namespace

Wanted changesFor(const Keys& keys, const Configuration& now) {
  Wanted all;
  if (keys.trigger != Trigger::AsSet) {
    all.application.emplace_back("TriggerMode", keys.trigger == Trigger::FreeRun ? "1" : "2");
  }
  // The type first: what else there is to set depends on it.
  if (keys.measuring_range != MeasuringRange::AsSet || keys.exposures != Exposures::AsSet) {
    all.imager.emplace_back("Type", imagerType(keys, valueOf(now.imager, "Type")));
  }
  if (keys.exposure > 0_us) {
    all.imager.emplace_back("ExposureTime", fmt::format("{:.0f}", keys.exposure.in(microsecond)));
  }
  if (keys.frame_rate > 0_Hz) {
    all.imager.emplace_back("FrameRate", fmt::format("{}", keys.frame_rate.in(hertz)));
  }
  if (keys.channel >= 0) all.imager.emplace_back("Channel", std::to_string(keys.channel));
  // What is as wanted already is not written: writing wears the camera's memory out.
  std::erase_if(all.application, [&](const auto& change) {
    return valueOf(now.application, change.first.c_str()) == change.second;
  });
  std::erase_if(all.imager, [&](const auto& change) {
    return valueOf(now.imager, change.first.c_str()) == change.second;
  });
  return all;
}

Result<Configuration> configure(Rpc& rpc, const Keys& keys) {
  return configureBy(rpc, keys.password,
                     [&](const Configuration& now) { return changesFor(keys, now); });
}

Result<Configuration> configure(Rpc& rpc, const Keys& keys, const Changes& imager) {
  return configureBy(rpc, keys.password, [&](const Configuration&) { return Wanted{{}, imager}; });
}

}  // namespace toftwin::drivers::o3d303
