// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <concepts>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include <toftwin/result.h>

/// XML-RPC's messages as text: what the camera is configured with. No sockets here.
namespace toftwin::o3d303 {

/// Bytes, as the text in base64 that they are written as (base64.h).
struct Base64 {
  std::string text;
  bool operator==(const Base64&) const = default;
};

/// A value of a call or an answer. Dates come as the text they are written as.
struct XmlRpcValue {
  using Array = std::vector<XmlRpcValue>;
  using Struct = std::vector<std::pair<std::string, XmlRpcValue>>;  ///< in the order written
  std::variant<std::string, int, bool, double, Array, Struct, Base64> value;

  XmlRpcValue() = default;
  template <class T>
  requires(std::same_as<T, std::string> || std::same_as<T, int> || std::same_as<T, bool> ||
           std::same_as<T, double> || std::same_as<T, Array> || std::same_as<T, Struct> ||
           std::same_as<T, Base64>)
      XmlRpcValue(T held)
      : value(std::move(held)) {}  // NOLINT(google-explicit-constructor)
  XmlRpcValue(const char* text)
      : value(std::string{text}) {}  // NOLINT(google-explicit-constructor)

  bool operator==(const XmlRpcValue&) const = default;
  /// The member of that name as text (numbers too), empty if there is none.
  [[nodiscard]] std::string textAt(std::string_view member) const;
  /// A text, a number written as one, or base64; empty for the rest.
  [[nodiscard]] std::string text() const;
};

struct XmlRpcCall {
  std::string method;
  std::vector<XmlRpcValue> params;
  bool operator==(const XmlRpcCall&) const = default;
};

struct XmlRpcFault {
  int code = 0;
  std::string text;
  bool operator==(const XmlRpcFault&) const = default;
};
using XmlRpcAnswer = std::variant<XmlRpcValue, XmlRpcFault>;

std::string encodeXmlRpc(const XmlRpcCall& call);
std::string encodeXmlRpc(const XmlRpcAnswer& answer);

/// Any text is safe; what is no call or answer is Malformed.
Result<XmlRpcCall> readXmlRpcCall(std::string_view xml);
Result<XmlRpcAnswer> readXmlRpcAnswer(std::string_view xml);

}  // namespace toftwin::o3d303
