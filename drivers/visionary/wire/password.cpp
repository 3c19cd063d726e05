// SPDX-License-Identifier: Apache-2.0
#include "drivers/visionary/wire/password.h"

#include <openssl/evp.h>

#include <memory>
#include <string>
#include <vector>

namespace toftwin::visionary {
namespace {

constexpr std::array<std::string_view, 5> kLevelNames{"Run", "Operator", "Maintenance", "AuthorizedClient",
                                                      "Service"};

Digest sha256(const std::vector<std::uint8_t>& bytes) {
  Digest digest{};
  unsigned size = 0;
  EVP_Digest(bytes.data(), bytes.size(), digest.data(), &size, EVP_sha256(), nullptr);
  return digest;
}

}  // namespace

std::optional<UserLevel> userLevelOf(std::uint8_t number) {
  if (number >= kLevelNames.size()) return std::nullopt;
  return static_cast<UserLevel>(number);
}

Digest responseTo(std::span<const std::uint8_t> challenge, std::span<const std::uint8_t> salt,
                  UserLevel level, std::string_view password) {
  std::string text{kLevelNames[static_cast<std::size_t>(level)]};
  text += ":SICK Sensor:";
  text += password;
  if (!salt.empty()) text += ':';
  std::vector<std::uint8_t> secret(text.begin(), text.end());
  secret.insert(secret.end(), salt.begin(), salt.end());
  const Digest hash = sha256(secret);
  std::vector<std::uint8_t> all(hash.begin(), hash.end());
  all.insert(all.end(), challenge.begin(), challenge.end());
  return sha256(all);
}

}  // namespace toftwin::visionary
