// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <chrono>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include <toftwin/result.h>

#include "drivers/event_loop.h"
#include "drivers/o3d303/wire/xmlrpc.h"

namespace toftwin::drivers::o3d303 {

using toftwin::o3d303::XmlRpcValue;
using Endpoint = boost::asio::ip::tcp::endpoint;

/// How long a camera in the same network may take to accept a connection. Shorter than the second
/// after which TCP asks again, so that a camera that comes back is found by our next attempt.
inline constexpr std::chrono::milliseconds kConnectTime{300};
inline constexpr std::chrono::milliseconds kAnswerTime{2000};
/// The same for the first question, which costs the camera nothing: one that accepts connections
/// but still starts, or hangs, is asked anew soon.
inline constexpr std::chrono::milliseconds kFirstAnswerTime{400};

/// Connects within kConnectTime. Error Disconnected, with the address and what to do.
Result<> connect(EventLoop& loop, boost::asio::ip::tcp::socket& socket, const Endpoint& to,
                 const std::stop_token& stop = {}, std::string_view driver = "o3d303");

/// Calls the camera's XML-RPC objects, each call over a connection of its own.
class Rpc {
 public:
  static constexpr std::string_view kMain = "/api/rpc/v1/com.ifm.efector/";

  /// `driver` names it in errors; it must outlast this.
  Rpc(EventLoop& loop, Endpoint camera, std::string_view driver = "o3d303")
      : loop_(loop), camera_(std::move(camera)), driver_(driver) {}

  /// Errors: Disconnected if the camera cannot be reached or does not answer; what the camera
  /// refuses is Busy (somebody else configures it), PermissionDenied or InvalidArgument. `object`
  /// is the path below kMain.
  Result<XmlRpcValue> call(std::string_view object, std::string method,
                           std::vector<XmlRpcValue> params, const std::stop_token& stop = {},
                           std::chrono::milliseconds within = kAnswerTime);
  /// A parameter of the device.
  Result<std::string> parameter(const std::string& name, const std::stop_token& stop = {});

 private:
  Result<std::string> exchange(const std::string& path, std::string body,
                               const std::stop_token& stop, std::chrono::milliseconds within);

  EventLoop& loop_;
  Endpoint camera_;
  std::string_view driver_;
};

}  // namespace toftwin::drivers::o3d303
