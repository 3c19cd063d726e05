// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/ros2/participant.h"

#include <boost/asio/ip/address.hpp>
#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <string_view>

#include "daemon/facades/ros2/loopback_only.h"
#include "drivers/logging.h"

namespace toftwin::daemon::ros2 {
namespace {

Error errorOf(std::string_view what, dds_return_t code) {
  return Error{Error::Code::Internal, fmt::format("{}: DDS says \"{}\"", what, dds_strretcode(code))};
}

/// While a thread joins a domain, what DDS says on it belongs to the error, if there is one.
thread_local std::string* said = nullptr;

void logLine(void*, const dds_log_data_t* line) {
  std::string_view text{line->message, line->size};
  while (!text.empty() && text.back() == '\n') text.remove_suffix(1);
  if (said != nullptr) return void(*said += fmt::format("; {}", text));
  if ((line->priority & (DDS_LC_FATAL | DDS_LC_ERROR)) != 0) return logging::error("Cyclone DDS: {}", text);
  if ((line->priority & DDS_LC_WARNING) != 0) logging::warn("Cyclone DDS: {}", text);
}

/// On loopback there is no multicast, so that programs are looked for at each of the ports that DDS gives
/// them; and no line that breaks packets, so that they may be as long as UDP has them.
std::string loopbackXml(const Network& network) {
  return fmt::format(
      "<General><Interfaces><NetworkInterface "
      "address=\"{}\"/></Interfaces><AllowMulticast>false</AllowMulticast>"
      "<MaxMessageSize>65000B</MaxMessageSize><FragmentSize>63000B</FragmentSize></General>"
      "<Discovery><ExternalDomainId>{}</ExternalDomainId><ParticipantIndex>auto</ParticipantIndex>"
      "<MaxAutoParticipantIndex>32</MaxAutoParticipantIndex><Peers><Peer "
      "address=\"127.0.0.1\"/></Peers></Discovery>",
      network.address, network.domain);
}

std::string remoteXml(const Network& network) {
  std::string peers;
  for (const std::string& peer : network.peers) peers += fmt::format("<Peer address=\"{}\"/>", peer);
  const bool is_any = network.address == "0.0.0.0";
  return fmt::format(
      "<General><Interfaces><NetworkInterface {}/></Interfaces></General>"
      "<Discovery><ExternalDomainId>{}</ExternalDomainId><ParticipantIndex>auto</ParticipantIndex>"
      "<MaxAutoParticipantIndex>32</MaxAutoParticipantIndex>{}</Discovery>",
      is_any ? "autodetermine=\"true\"" : fmt::format("address=\"{}\"", network.address), network.domain,
      peers.empty() ? "" : "<Peers>" + peers + "</Peers>");
}

/// Nobody waits for a reader that does not read: keep_last alone bounds what is kept for it.
constexpr std::string_view kInternalXml =
    "<Internal><MaxSampleSize>256MB</MaxSampleSize><Watermarks><WhcHigh>1GB</WhcHigh></Watermarks></"
    "Internal>";

using Qos = std::unique_ptr<dds_qos_t, void (*)(dds_qos_t*)>;
Qos qosOf(const Quality& quality) {
  Qos qos{dds_create_qos(), dds_delete_qos};
  dds_qset_reliability(qos.get(),
                       quality.is_reliable ? DDS_RELIABILITY_RELIABLE : DDS_RELIABILITY_BEST_EFFORT, 0);
  dds_qset_durability(qos.get(),
                      quality.is_latched ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
  dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, quality.keep_last);
  if (quality.is_latched)
    dds_qset_durability_service(qos.get(), 0, DDS_HISTORY_KEEP_LAST, quality.keep_last, -1, -1, -1);
  return qos;
}

}  // namespace

std::uint32_t Writer::readers() const {
  dds_publication_matched_status_t status{};
  return dds_get_publication_matched_status(entity_, &status) == DDS_RETCODE_OK ? status.current_count : 0;
}

Result<> Writer::write(const void* message) const {
  if (const dds_return_t code = dds_write(entity_, message); code != DDS_RETCODE_OK)
    return errorOf("a message cannot be written", code);
  return {};
}

Result<std::unique_ptr<Participant>> Participant::open(const Network& network) {
  boost::system::error_code is_none;
  const auto address = boost::asio::ip::make_address(network.address, is_none);
  if (is_none || !address.is_v4()) {
    return Error{
        Error::Code::InvalidArgument,
        fmt::format("the facade ros2 needs an IPv4 address, such as 127.0.0.1, but address is \"{}\"",
                    network.address)};
  }
  dds_set_log_sink(logLine, nullptr);
  // Cyclone has one configuration per domain and process; a number of our own, which the network does not
  // see, gives each facade its own.
  static std::atomic<dds_domainid_t> next_domain{1000};
  const dds_domainid_t id = next_domain++;
  const std::string xml = "<CycloneDDS><Domain id=\"any\">" +
                          (address.is_loopback() ? loopbackXml(network) : remoteXml(network)) +
                          std::string{kInternalXml} + "</Domain></CycloneDDS>";
  std::unique_ptr<Participant> opened{new Participant};
  const Sockets before = openSockets(network.domain);
  std::string why;
  said = &why;
  opened->domain_ = dds_create_domain(id, xml.c_str());
  if (opened->domain_ > 0) opened->participant_ = dds_create_participant(id, nullptr, nullptr);
  said = nullptr;
  if (opened->participant_ <= 0) {
    return errorOf(
        fmt::format("DDS domain {} cannot be joined on {}{}", network.domain, network.address, why),
        std::min(opened->domain_, opened->participant_));
  }
  if (address.is_loopback()) {
    if (auto confined = confineNewSockets(network.domain, before); !confined) return confined.error();
  }
  return opened;
}

Participant::~Participant() {
  if (domain_ > 0) dds_delete(domain_);
}

Participant::Guid Participant::guidOf(dds_entity_t entity) {
  dds_guid_t guid{};
  Guid bytes{};
  if (dds_get_guid(entity, &guid) == DDS_RETCODE_OK) std::ranges::copy(guid.v, bytes.begin());
  return bytes;
}

std::vector<Participant::Guid> Participant::guidsOf(const std::vector<dds_entity_t>& entities) {
  std::vector<Guid> guids;
  for (const dds_entity_t entity : entities) guids.push_back(guidOf(entity));
  return guids;
}

Result<dds_entity_t> Participant::topic(const std::string& name, const dds_topic_descriptor_t& type) const {
  // ROS 2 puts "rt" before the names of topics, but of its own.
  const std::string full = name.starts_with('/') ? "rt" + name : name;
  const dds_entity_t topic = dds_create_topic(participant_, &type, full.c_str(), nullptr, nullptr);
  if (topic < 0) return errorOf(fmt::format("the topic {}", name), topic);
  return topic;
}

Result<Writer> Participant::write(const std::string& name, const dds_topic_descriptor_t& type,
                                  const Quality& quality) {
  const auto of = topic(name, type);
  if (!of) return of.error();
  const dds_entity_t writer = dds_create_writer(participant_, *of, qosOf(quality).get(), nullptr);
  if (writer < 0) return errorOf(fmt::format("a writer of {}", name), writer);
  writers_.push_back(writer);
  return Writer{writer};
}

Result<dds_entity_t> Participant::read(const std::string& name, const dds_topic_descriptor_t& type,
                                       const Quality& quality, std::function<void()> wake) {
  const auto of = topic(name, type);
  if (!of) return of.error();
  wakes_.push_back(std::make_unique<std::function<void()>>(std::move(wake)));
  const std::unique_ptr<dds_listener_t, void (*)(dds_listener_t*)> listener{
      dds_create_listener(wakes_.back().get()), dds_delete_listener};
  dds_lset_data_available(listener.get(),
                          [](dds_entity_t, void* call) { (*static_cast<std::function<void()>*>(call))(); });
  const Qos qos = qosOf(quality);
  // What is told on /tf must not be taken for an order.
  dds_qset_ignorelocal(qos.get(), DDS_IGNORELOCAL_PARTICIPANT);
  const dds_entity_t reader = dds_create_reader(participant_, *of, qos.get(), listener.get());
  if (reader < 0) return errorOf(fmt::format("a reader of {}", name), reader);
  readers_.push_back(reader);
  return reader;
}

}  // namespace toftwin::daemon::ros2
