// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <string>

#include <toftwin/result.h>

#include "daemon/facades/o3r/configuration.h"

namespace toftwin::daemon::o3r {

/// The device's means to take a password over a line that others read: messages sealed for its public key, in
/// which the password and what is asked for stand. The seal is libsodium's crypto_box_seal (X25519,
/// XSalsa20-Poly1305). Copies have the same key.
class SealedBox {
 public:
  SealedBox();

  /// In base64.
  [[nodiscard]] std::string publicKey() const;
  [[nodiscard]] bool isProtected() const { return !password_.empty(); }

  /// What a message, in base64, asks for; a password that it sets is set. The configuration to be set, an
  /// empty object if there is none. Malformed: it is not sealed for this key, or says nothing known;
  /// PermissionDenied: wrong password, or the message was here before.
  Result<Json> open(const std::string& message);

 private:
  Result<Json> obey(const Json& request);
  bool isNew(const std::string& nonce);

  std::array<std::uint8_t, 32> public_key_{}, secret_key_{};
  std::string password_;
  std::deque<std::string> nonces_;  ///< of the last messages
};

}  // namespace toftwin::daemon::o3r
