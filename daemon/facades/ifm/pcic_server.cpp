// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/ifm/pcic_server.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <vector>

#include "daemon/facades/ifm/pcic_connection.h"

namespace toftwin::daemon::ifm {
namespace {

using boost::asio::ip::tcp;
using boost::system::error_code;
using toftwin::o3d303::Bytes;
using toftwin::o3d303::Schema;

constexpr std::size_t kMostPcicConnections = 16;
constexpr std::string_view kAlgorithmTicket = "0020";
std::string errorText(int code) { return fmt::format("{:09}", code); }

}  // namespace

PcicServer::PcicServer(Listening listening, Hooks hooks)
    : shared_{.hooks = std::move(hooks),
              .remove = [this](const auto& connection) { remove(connection); },
              .tell_error = [this](int code) { tellError(code); }},
      accepting_(std::move(listening), [this](tcp::socket socket) { take(std::move(socket)); }) {}

PcicServer::~PcicServer() {
  *shared_.is_alive = false;
  for (const auto& connection : connections_) connection->close();
}

void PcicServer::setOpen(bool is_open) {
  accepting_.setOpen(is_open);
  if (is_open) return;
  const auto all = connections_;
  for (const auto& connection : all) connection->close();
}

void PcicServer::take(tcp::socket socket) {
  if (connections_.size() >= kMostPcicConnections) return tellError(PcicError::kTooManyConnections);
  auto connection = std::make_shared<PcicConnection>(shared_, std::move(socket), freeNumber());
  connections_.push_back(connection);
  shared_.hooks.connections(connections_.size());
  connection->read();
  if (const int error = shared_.hooks.lasting_error(); error != 0) connection->tellError(error);
}

/// The least that no connection has.
int PcicServer::freeNumber() const {
  int number = 1;
  const auto isTaken = [&](const auto& connection) { return connection->number() == number; };
  while (std::ranges::any_of(connections_, isTaken)) ++number;
  return number;
}

void PcicServer::remove(const std::shared_ptr<PcicConnection>& connection) {
  const std::size_t before = connections_.size();
  connections_.remove(connection);
  if (connections_.size() != before) shared_.hooks.connections(connections_.size());
}

bool PcicServer::publish(const FrameWriter& frame, const Damage& damage) {
  struct Made {
    Schema schema;
    toftwin::o3d303::PcicVersion version;
    PcicConnection::SharedBytes bytes;
  };
  std::vector<Made> made;
  const auto all = connections_;  // sending may close one
  bool has_left = false;
  for (const auto& connection : all) {
    if (connection->answerWith(frame)) {
      has_left = true;
      continue;
    }
    const auto schema = connection->wanted();
    if (!schema) continue;
    const auto version = connection->version();
    auto found = std::ranges::find_if(
        made, [&](const Made& one) { return one.schema == *schema && one.version == version; });
    if (found == made.end()) {
      const auto content = frame(*schema);
      if (!content) continue;  // no schema comes here that was not checked
      const std::span<const std::byte> bytes{*content};
      Bytes message = toftwin::o3d303::encodePcic(toftwin::o3d303::kFrameTicket, bytes, version);
      damage.corrupt(message);
      if (damage.is_cut) message.resize(message.size() / 2);
      made.push_back({*schema, version, std::make_shared<const Bytes>(std::move(message))});
      found = made.end() - 1;
    }
    has_left |= damage.is_cut ? connection->endWith(found->bytes) : connection->send(found->bytes, true);
  }
  return has_left;
}

void PcicServer::tellError(int code) {
  shared_.last_error = code;
  tell(toftwin::o3d303::kErrorTicket, Output::kErrors, errorText(code));
}

void PcicServer::tellNotification(int code, std::string_view json) {
  tell(toftwin::o3d303::kNotificationTicket, Output::kNotifications, fmt::format("{:09}:{}", code, json));
}

void PcicServer::tellAlgorithm(std::string_view content) {
  tell(kAlgorithmTicket, Output::kAlgorithm, content);
}

void PcicServer::tell(std::string_view ticket, unsigned output, std::string_view text) {
  const auto all = connections_;
  for (const auto& connection : all) {
    if (!connection->takes(output)) continue;
    connection->send(
        std::make_shared<const Bytes>(toftwin::o3d303::encodePcic(ticket, text, connection->version())),
        false);
  }
}

}  // namespace toftwin::daemon::ifm
