// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "daemon/facades/o3d303/device.h"

/// Short words for what the camera's objects answer and are asked.
namespace toftwin::daemon::o3d303 {

toftwin::o3d303::XmlRpcAnswer fault(int code, std::string text);
/// What a client is told of a source's refusal.
toftwin::o3d303::XmlRpcFault faultOf(const Error& error);
/// What the camera answers where there is nothing to say.
toftwin::o3d303::XmlRpcAnswer nothing();
toftwin::o3d303::XmlRpcAnswer noSuchMethod(const toftwin::o3d303::XmlRpcCall& call);
toftwin::o3d303::XmlRpcAnswer structOf(const Parameters& all);
/// getParameter and getAllParameters.
toftwin::o3d303::XmlRpcAnswer look(const Parameters& all, const toftwin::o3d303::XmlRpcCall& call);
/// Empty if there is no such parameter.
std::string paramText(const toftwin::o3d303::XmlRpcCall& call, std::size_t index);
/// The whole text as a number.
std::optional<int> numberIn(const std::string& text);
std::optional<double> realIn(const std::string& text);

}  // namespace toftwin::daemon::o3d303
