// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/o3r/sealed_box.h"

#include <sodium.h>

#include <algorithm>
#include <span>
#include <stdexcept>
#include <vector>

#include "drivers/o3d303/wire/base64.h"

namespace toftwin::daemon::o3r {
namespace {

static_assert(crypto_box_PUBLICKEYBYTES == 32 && crypto_box_SECRETKEYBYTES == 32);
constexpr std::size_t kMostNonces = 1024, kLongestBoxPassword = 256;

Error notUnderstood(const char* why) { return {Error::Code::Malformed, std::string{"sealed box: "} + why}; }
Error notAllowed(const char* why) {
  return {Error::Code::PermissionDenied, std::string{"sealed box: "} + why};
}

std::string textAt(const Json& request, const char* name) {
  const auto found = request.find(name);
  return found != request.end() && found->is_string() ? found->get<std::string>() : std::string{};
}

bool isSame(const std::string& one, const std::string& other) {
  return one.size() == other.size() && sodium_memcmp(one.data(), other.data(), one.size()) == 0;
}

}  // namespace

SealedBox::SealedBox() {
  if (sodium_init() < 0) throw std::runtime_error("libsodium finds no source of chance");
  crypto_box_keypair(public_key_.data(), secret_key_.data());
}

std::string SealedBox::publicKey() const {
  const auto bytes = std::as_bytes(std::span{public_key_});
  return toftwin::o3d303::toBase64(toftwin::o3d303::textOf(bytes));
}

Result<Json> SealedBox::open(const std::string& message) {
  const auto sealed = toftwin::o3d303::fromBase64(message);
  if (!sealed || sealed->size() < crypto_box_SEALBYTES)
    return notUnderstood("the message is no base64, or too short");
  std::string text(sealed->size() - crypto_box_SEALBYTES, '\0');
  const auto* cipher = reinterpret_cast<const unsigned char*>(sealed->data());
  if (crypto_box_seal_open(reinterpret_cast<unsigned char*>(text.data()), cipher, sealed->size(),
                           public_key_.data(), secret_key_.data()) != 0)
    return notUnderstood("the message is not sealed for public_key");
  const auto request = readJson(text);
  if (!request || !request->is_object()) return notUnderstood("the message holds no JSON object");
  return obey(*request);
}

/// What was recorded on the line is not obeyed again.
bool SealedBox::isNew(const std::string& nonce) {
  if (nonce.empty() || std::ranges::find(nonces_, nonce) != nonces_.end()) return false;
  nonces_.push_back(nonce);
  if (nonces_.size() > kMostNonces) nonces_.pop_front();
  return true;
}

Result<Json> SealedBox::obey(const Json& request) {
  if (!isNew(textAt(request, "nonce"))) return notAllowed("the message has no nonce, or was here before");
  if (isProtected() && !isSame(textAt(request, "password"), password_)) return notAllowed("wrong password");
  const std::string what = textAt(request, "request");
  if (what == "set_password") {
    std::string wanted = textAt(request, "new_password");
    if (wanted.empty() || wanted.size() > kLongestBoxPassword)
      return notUnderstood("new_password has 1 to 256 bytes");
    password_ = std::move(wanted);
    return Json::object();
  }
  if (what == "remove_password") return password_.clear(), Json::object();
  if (what == "set_configuration" && request.contains("configuration")) return request.at("configuration");
  return notUnderstood("the request is none of set_password, remove_password and set_configuration");
}

}  // namespace toftwin::daemon::o3r
