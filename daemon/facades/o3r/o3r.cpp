// SPDX-License-Identifier: Apache-2.0
#include <boost/asio/ip/host_name.hpp>
#include <boost/asio/steady_timer.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>

#include "daemon/facades/event_thread.h"
#include "daemon/facades/ifm/discovery.h"
#include "daemon/facades/ifm/http_server.h"
#include "daemon/facades/listen_for.h"
#include "daemon/facades/mac_address.h"
#include "daemon/facades/o3r/device.h"
#include "daemon/facades/o3r/head.h"
#include "daemon/facades/o3r/keys.h"
#include "daemon/facades/o3r/plugs.h"
#include "drivers/logging.h"
#include "drivers/o3r/wire/numbers.h"
#include "protocol/settings/describe.h"

namespace toftwin::daemon::o3r {
namespace {

using std::chrono::steady_clock;
using toftwin::o3d303::encodeXmlRpc;
using toftwin::o3d303::XmlRpcAnswer;
using toftwin::o3d303::XmlRpcFault;

std::string macText(std::string_view of) {
  const auto mac = macOf(of);
  return fmt::format("{:02X}:{:02X}:{:02X}:{:02X}:{:02X}:{:02X}", mac[0], mac[1], mac[2], mac[3], mac[4],
                     mac[5]);
}

/// Always the same for a name.
std::string serialOf(std::string_view name) {
  std::string digits;
  for (const std::uint8_t byte : macOf(name)) digits += fmt::format("{:02}", byte % 100);
  return digits;
}

class O3rFacade final : public Facade {
 public:
  O3rFacade(Keys keys, std::vector<Plug> plugs, std::filesystem::path line_log, const FacadePlace& place)
      : keys_(std::move(keys)),
        plugs_(std::move(plugs)),
        line_log_(std::move(line_log)),
        place_(place),
        name_("facade o3r of " + place.keys.source),
        thread_(name_),
        boot_(thread_.io()),
        booted_(steady_clock::now() - bootTime()) {}

  ~O3rFacade() override { thread_.stop(); }

  Result<> open() {
    auto xmlrpc =
        listenFor(thread_.io(), place_.keys, static_cast<std::uint16_t>(keys_.xmlrpc_port), "xmlrpc_port");
    if (!xmlrpc) return xmlrpc.error();
    if (auto opened = openDiagnostic(); !opened) return opened;
    std::vector<PortIdentity> ports;
    for (const Plug& plug : plugs_) {
      if (auto opened = openHead(plug); !opened) return opened;
      ports.push_back({.number = plug.port,
                       .is_3d = plug.is_3d,
                       .pcic_port = heads_.at(plug.port)->port(),
                       .serial = serialOf(fmt::format("{}/{}", plug.source, plug.port))});
    }
    const int xmlrpc_port = xmlrpc->acceptor.local_endpoint().port();
    device_.emplace(Identity{.name = keys_.name,
                             .address = place_.keys.address,
                             .serial = serialOf(place_.keys.source),
                             .macs = {macText(place_.keys.source), macText(place_.keys.source + "/eth1")},
                             .diagnostic_port = diagnostic_->port()},
                    ports, keys_.electrons_per_count);
    boost::system::error_code has_none;
    http_.emplace(*std::move(xmlrpc),
                  std::vector<std::string>{place_.keys.address, boost::asio::ip::host_name(has_none)},
                  [this](const std::string& path, const std::string& body, ifm::HttpServer::Answer answer) {
                    ask(path, body, std::move(answer));
                  });
    if (keys_.discoverable) openDiscovery(xmlrpc_port);
    std::string pcic;
    for (const PortIdentity& port : ports)
      pcic += fmt::format("{}{} of port{}", pcic.empty() ? "" : ", ", port.pcic_port, port.number);
    where_ = fmt::format("XML-RPC on {} port {}, PCIC on port {}", place_.keys.address, xmlrpc_port, pcic);
    *clients_ = 0;
    thread_.start();
    return {};
  }
  [[nodiscard]] std::string where() const override { return where_; }

 private:
  Result<> openDiagnostic() {
    auto diagnostic = listenFor(thread_.io(), place_.keys, static_cast<std::uint16_t>(keys_.diagnostic_port),
                                "diagnostic_port");
    if (!diagnostic) return diagnostic.error();
    diagnostic_.emplace(
        *std::move(diagnostic),
        ifm::PcicServer::Hooks{
            .trigger = [](const auto& done) { done(ifm::PcicError::kNoTriggerAllowed); },
            .default_schema = [] { return toftwin::o3r::schemaOf({}); },
            .ask = [](std::string_view) { return std::string{}; },
            .connections = [](std::size_t) {},
            .serves =
                [](const auto& schema) { return writeHeadFrame(schema, toftwin::o3r::HeadFrame{}).ok(); }});
    return {};
  }

  Result<> openHead(const Plug& plug) {
    FacadePlace place = place_;
    place.keys.source = plug.source;
    const int wanted = keys_.pcic_port == 0 ? 0 : keys_.pcic_port + plug.port;
    auto listening = listenFor(thread_.io(), place.keys, static_cast<std::uint16_t>(wanted), "pcic_port");
    if (!listening) return listening.error();
    const Scales scales{
        .electrons_per_count = keys_.electrons_per_count,
        .distance_resolution_m = toftwin::o3r::distanceResolution(keys_.longest_range.in(metre)),
        .jpeg_quality = static_cast<int>(keys_.jpeg_quality)};
    auto head = std::make_unique<Head>(
        thread_, place, plug.is_3d, scales, LineFaults{keys_.line, name_, lineLogOf(plug)},
        keys_.line.delay_time,
        Head::Hooks{.settings = [this, port = plug.port] { return device_->head(port); },
                    .connections = [this] { countConnections(); }});
    head->listen(*std::move(listening));
    heads_.emplace(plug.port, std::move(head));
    return {};
  }

  /// Each port has a log of its own: FILE.port2 beside FILE, where there are several.
  [[nodiscard]] std::filesystem::path lineLogOf(const Plug& plug) const {
    if (line_log_.empty() || plugs_.size() == 1) return line_log_;
    return line_log_.string() + fmt::format(".port{}", plug.port);
  }

  void openDiscovery(int xmlrpc_port) {
    auto discovery = ifm::Discovery::listen(thread_.io(), place_.keys.address,
                                            static_cast<std::uint16_t>(keys_.discovery_port),
                                            {.port = static_cast<std::uint16_t>(xmlrpc_port),
                                             .device = static_cast<std::uint16_t>(kDeviceNumber),
                                             .mac = macOf(place_.keys.source),
                                             .host_name = place_.keys.source,
                                             .device_name = keys_.name});
    // Who knows the address needs no search, and another device of this machine may be the one that is found.
    if (!discovery)
      return logging::warn("{}: it cannot be searched for: {}", name_, discovery.error().message);
    discovery_ = *std::move(discovery);
  }

  void countConnections() {
    std::size_t count = 0;
    for (const auto& [port, head] : heads_) count += head->connections();
    *clients_ = static_cast<std::int64_t>(count);
  }

  // ---- configuration -----------------------------------------------------------------------------

  void ask(const std::string& path, const std::string& body, ifm::HttpServer::Answer answer) {
    constexpr int kNoXmlRpc = -503;
    const auto call = toftwin::o3d303::readXmlRpcCall(body);
    if (!call) return answer(encodeXmlRpc(XmlRpcAnswer{XmlRpcFault{kNoXmlRpc, call.error().message}}));
    refresh();
    const auto before = std::make_shared<const Device>(*device_);
    const Device::Outcome outcome = device_->answer(path, *call);
    if (outcome.is_reboot) reboot();
    change(outcome.changes,
           [this, before, told = outcome.answer, answer = std::move(answer)](const Result<>& done) {
             if (!done) device_.emplace(*before);  // all of it or nothing
             updateHeads();
             answer(encodeXmlRpc(done ? told : XmlRpcAnswer{faultOf(done.error())}));
           });
  }

  using Wanted = std::map<int, SourceChanges>;
  /// One source after another; where one refuses, those before it are set back.
  void change(const Wanted& wanted, SourceLink::Done done) { changeNext(wanted, {}, std::move(done)); }

  void changeNext(Wanted left, Wanted set_back, const SourceLink::Done& done) {
    if (left.empty()) return done({});
    const auto [port, changes] = *left.begin();
    left.erase(left.begin());
    set_back.emplace(port, presentOf(port, changes));
    heads_.at(port)->link().post(
        [changes = changes](drivers::Source& source) { return setAll(source, changes); },
        [this, port = port, left, set_back, done](const Result<>& result) mutable {
          if (result) return changeNext(std::move(left), std::move(set_back), done);
          set_back.erase(port);  // that source is as it was
          change(set_back, [done, result](const Result<>&) { done(result); });
        });
  }

  /// What the source has now of what is to be changed.
  SourceChanges presentOf(int port, const SourceChanges& changes) {
    SourceChanges present;
    const auto description = heads_.at(port)->link().describe();
    if (!description) return present;
    for (const Parameter& one : description->parameters) {
      const bool is_changed =
          std::ranges::find(changes, one.name, &SourceChanges::value_type::first) != changes.end();
      if (is_changed && one.value) present.emplace_back(one.name, *one.value);
    }
    return present;
  }

  void updateHeads() {
    for (const auto& [port, head] : heads_) head->update();
  }

  /// What the sources have now is what clients read.
  void refresh() {
    UnitFacts facts{.host_ns = place_.clock.wall().ns,
                    .since_boot_ns = std::chrono::nanoseconds{steady_clock::now() - booted_}.count(),
                    .temperatures_c = {},
                    .ports = {}};
    for (const auto& [port, head] : heads_) {
      for (const NamedTemperature& one : head->temperatures())
        facts.temperatures_c.emplace_back(fmt::format("port{}/{}", port, one.where), one.value.in(celsius));
      const auto description = head->link().describe();
      if (!description) continue;
      PortFacts& source = facts.ports[port];
      source.parameters = description->parameters;
      source.camera = description->camera;
    }
    device_->update(facts);
  }

  // ---- boot --------------------------------------------------------------------------------------

  [[nodiscard]] std::chrono::nanoseconds bootTime() const {
    return std::chrono::nanoseconds{std::llround(place_.keys.boot_time.in(nanosecond))};
  }

  void setOpen(bool is_open) {
    http_->setOpen(is_open);
    diagnostic_->setOpen(is_open);
    for (const auto& [port, head] : heads_) head->setOpen(is_open);
    if (discovery_) discovery_->setOpen(is_open);
  }

  /// After the answer is out.
  void reboot() {
    constexpr std::chrono::milliseconds kAnswerFirst{100};
    boot_.expires_after(kAnswerFirst);
    boot_.async_wait([this](boost::system::error_code cancelled) {
      if (!cancelled) boot();
    });
  }

  /// Nobody answers for the boot time, from which upTime counts.
  void boot() {
    booted_ = steady_clock::now();
    *booting_ = true;
    setOpen(false);
    change(device_->restart(), [this](const Result<>& done) {
      if (!done) logging::warn("{}: after its reboot: {}", name_, done.error().message);
    });
    boot_.expires_after(bootTime());
    boot_.async_wait([this](boost::system::error_code cancelled) {
      if (cancelled) return;
      setOpen(true);
      *booting_ = false;
    });
  }

  const Keys keys_;
  const std::vector<Plug> plugs_;
  const std::filesystem::path line_log_;
  const FacadePlace place_;
  const std::string name_;
  std::string where_;
  EventThread thread_;
  std::optional<Device> device_;
  std::map<int, std::unique_ptr<Head>> heads_;
  std::optional<ifm::PcicServer> diagnostic_;
  std::optional<ifm::HttpServer> http_;
  std::unique_ptr<ifm::Discovery> discovery_;
  boost::asio::steady_timer boot_;
  steady_clock::time_point booted_;
};

FacadeKind::Start read(settings::Table& table) {
  Keys keys;
  table.read(keys);
  const std::filesystem::path log = keys.line.logIn(table);
  const std::string source = table.anew().text("source").value_or("");
  auto plugs = plugsOf(keys.ports, source);
  if (!plugs) table.complain("ports", plugs.error().message);
  return [keys, log, plugs = plugs ? *plugs : std::vector<Plug>{}](
             const FacadePlace& place) -> Result<std::unique_ptr<Facade>> {
    auto facade = std::make_unique<O3rFacade>(keys, plugs, log, place);
    if (auto opened = facade->open(); !opened) return opened.error();
    return std::unique_ptr<Facade>{std::move(facade)};
  };
}

FacadeKind::MoreSources moreSources(settings::Table table) {
  FacadeKind::MoreSources more{.key = "ports", .names = {}};
  const auto plugs = plugsOf(table.texts("ports").value_or(std::vector<std::string>{}), "");
  if (!plugs) return more;
  for (const Plug& plug : *plugs) {
    if (!plug.source.empty()) more.names.push_back(plug.source);
  }
  return more;
}

}  // namespace

FacadeKind facade() {
  return {
      .name = "o3r",
      .summary =
          "an ifm O3R with one to six heads: XML-RPC with a JSON configuration, PCIC, the vendor's search",
      .read = read,
      .document = [] { return settings::markdownTable(settings::keysOf<Keys>()); },
      .not_built = {},
      .more_sources = moreSources};
}

}  // namespace toftwin::daemon::o3r
