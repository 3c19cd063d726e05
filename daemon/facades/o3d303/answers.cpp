// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/o3d303/answers.h"

#include <charconv>
#include <cmath>

namespace toftwin::daemon::o3d303 {

using toftwin::o3d303::XmlRpcAnswer;
using toftwin::o3d303::XmlRpcCall;
using toftwin::o3d303::XmlRpcFault;
using toftwin::o3d303::XmlRpcValue;

namespace {

template <class Number>
std::optional<Number> wholeText(const std::string& text) {
  Number number{};
  const char* end = text.data() + text.size();
  const auto read = std::from_chars(text.data(), end, number);
  if (read.ec != std::errc{} || read.ptr != end) return std::nullopt;
  return number;
}

}  // namespace

XmlRpcAnswer fault(int code, std::string text) { return XmlRpcFault{code, std::move(text)}; }
XmlRpcAnswer nothing() { return XmlRpcValue{""}; }
XmlRpcAnswer noSuchMethod(const XmlRpcCall& call) {
  return fault(Fault::kNoSuchMethod, "this object has no method " + call.method);
}

XmlRpcAnswer structOf(const Parameters& all) {
  XmlRpcValue::Struct members;
  for (const auto& [name, value] : all) members.emplace_back(name, XmlRpcValue{value});
  return XmlRpcValue{std::move(members)};
}

XmlRpcAnswer look(const Parameters& all, const XmlRpcCall& call) {
  if (call.method == "getAllParameters") return structOf(all);
  if (call.method != "getParameter") return noSuchMethod(call);
  const auto found = all.find(paramText(call, 0));
  if (found == all.end()) return fault(Fault::kNoSuchParameter, "there is no such parameter");
  return XmlRpcValue{found->second};
}

std::string paramText(const XmlRpcCall& call, std::size_t index) {
  return index < call.params.size() ? call.params[index].text() : std::string{};
}

std::optional<int> numberIn(const std::string& text) { return wholeText<int>(text); }

std::optional<double> realIn(const std::string& text) {
  const auto number = wholeText<double>(text);
  return number && std::isfinite(*number) ? number : std::nullopt;
}

toftwin::o3d303::XmlRpcFault faultOf(const Error& error) {
  using Code = Error::Code;
  const int code = error.code == Code::InvalidArgument                               ? Fault::kOutOfRange
                   : error.code == Code::NotFound || error.code == Code::Unsupported ? Fault::kReadOnly
                                                                                     : Fault::kInternal;
  return {code, error.message};
}

}  // namespace toftwin::daemon::o3d303
