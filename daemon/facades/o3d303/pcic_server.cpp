// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/o3d303/pcic_server.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <vector>

#include "daemon/facades/o3d303/pcic_connection.h"

namespace toftwin::daemon::o3d303 {
namespace {

using boost::asio::ip::tcp;
using boost::system::error_code;
using toftwin::o3d303::Bytes;
using toftwin::o3d303::Schema;

constexpr std::size_t kMostPcicConnections = 16;
std::string errorText(int code) { return fmt::format("{:09}", code); }

}  // namespace

PcicServer::PcicServer(Listening listening, Hooks hooks)
    : hooks_(std::move(hooks)),
      accepting_(std::move(listening), [this](tcp::socket socket) { take(std::move(socket)); }) {}

PcicServer::~PcicServer() {
  *is_alive_ = false;
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
  auto connection = std::make_shared<Connection>(*this, std::move(socket), freeNumber());
  connections_.push_back(connection);
  hooks_.connections(connections_.size());
  connection->read();
  if (const int error = hooks_.lasting_error(); error != 0) connection->tellError(error);
}

/// The least that no connection has.
int PcicServer::freeNumber() const {
  int number = 1;
  const auto isTaken = [&](const auto& connection) { return connection->number() == number; };
  while (std::ranges::any_of(connections_, isTaken)) ++number;
  return number;
}

void PcicServer::remove(const std::shared_ptr<Connection>& connection) {
  const std::size_t before = connections_.size();
  connections_.remove(connection);
  if (connections_.size() != before) hooks_.connections(connections_.size());
}

bool PcicServer::publish(const toftwin::o3d303::CameraFrame& frame, const Damage& damage) {
  struct Made {
    Schema schema;
    toftwin::o3d303::PcicVersion version;
    Connection::SharedBytes bytes;
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
      const auto content = writeFrameContent(*schema, frame);
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
  last_error_ = code;
  tell(toftwin::o3d303::kErrorTicket, Output::kErrors, errorText(code));
}

void PcicServer::tellNotification(int code, std::string_view json) {
  tell(toftwin::o3d303::kNotificationTicket, Output::kNotifications, fmt::format("{:09}:{}", code, json));
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

}  // namespace toftwin::daemon::o3d303
