// SPDX-License-Identifier: Apache-2.0
#include "daemon/access.h"

#include <grp.h>
#include <openssl/crypto.h>
#include <pwd.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <utility>

namespace toftwin::daemon {
namespace {

/// A name's number in the system's table, or the number that was written.
std::optional<std::uint32_t> numberOf(const std::string& name, bool is_group) {
  if (!name.empty() && name.find_first_not_of("0123456789") == std::string::npos && name.size() < 10)
    return static_cast<std::uint32_t>(std::stoul(name));
  std::array<char, 16384> space{};
  if (is_group) {
    group entry{}, *found = nullptr;
    ::getgrnam_r(name.c_str(), &entry, space.data(), space.size(), &found);
    return found == nullptr ? std::nullopt : std::optional<std::uint32_t>{entry.gr_gid};
  }
  passwd entry{}, *found = nullptr;
  ::getpwnam_r(name.c_str(), &entry, space.data(), space.size(), &found);
  return found == nullptr ? std::nullopt : std::optional<std::uint32_t>{entry.pw_uid};
}

/// The file's first line. Error: it cannot be read, others may read it, or it is too easily guessed.
Result<std::string> readSecret(const std::filesystem::path& file) {
  constexpr std::size_t kShortest = 16;
  struct stat about {};
  std::string secret;
  std::ifstream in{file};
  if (::stat(file.c_str(), &about) != 0 || !std::getline(in, secret))
    return Error{Error::Code::NotFound, fmt::format("{} cannot be read", file.string())};
  if ((about.st_mode & (S_IRWXG | S_IRWXO)) != 0)
    return Error{Error::Code::PermissionDenied,
                 fmt::format("{} can be read by others: chmod 600 {}", file.string(), file.string())};
  if (secret.size() < kShortest)
    return Error{Error::Code::InvalidArgument,
                 fmt::format("{} has a secret of {} bytes, and {} are the fewest: openssl rand -hex 32 > {}", file.string(),
                             secret.size(), kShortest, file.string())};
  return secret;
}

bool areEqual(const std::string& a, const std::string& b) {
  return a.size() == b.size() && CRYPTO_memcmp(a.data(), b.data(), a.size()) == 0;
}

}  // namespace

Result<Access::Who> Access::readWho(const std::string& text, const std::vector<TokenKeys>& tokens) {
  const auto wrong = [&](const std::string& why) {
    return Error{Error::Code::InvalidArgument, fmt::format("has \"{}\", {}", text, why)};
  };
  if (text == "here") return Who{Who::Kind::Here};
  if (text == "anyone") return Who{Who::Kind::Anyone};
  const auto colon = text.find(':');
  const std::string kind = text.substr(0, colon), name = colon == std::string::npos ? "" : text.substr(colon + 1);
  if (name.empty() || (kind != "user" && kind != "group" && kind != "token" && kind != "certificate"))
    return wrong("but must have user:NAME, group:NAME, token:NAME, certificate:NAME, here or anyone");
  if (kind == "certificate") return Who{Who::Kind::Certificate, 0, name};
  if (kind == "token") {
    if (std::ranges::find(tokens, name, &TokenKeys::name) == tokens.end())
      return wrong("but there is no [[roles.token]] of that name");
    return Who{Who::Kind::Token, 0, name};
  }
  const auto number = numberOf(name, kind == "group");
  if (!number) return wrong(fmt::format("but this machine has no {} of that name", kind));
  return Who{kind == "group" ? Who::Kind::Group : Who::Kind::User, *number, name};
}

Access Access::read(const RoleKeys& keys, const std::function<std::filesystem::path(const std::string&)>& resolve,
                    const Complain& complain) {
  Access access;
  const auto readAll = [&](const char* key, const std::vector<std::string>& texts, std::vector<Who>& into) {
    access.is_limited_ |= !texts.empty();
    for (const std::string& text : texts) {
      if (auto who = readWho(text, keys.tokens)) {
        into.push_back(*std::move(who));
      } else {
        complain(key, who.error().message);
      }
    }
  };
  readAll("view", keys.view, access.view_);
  readAll("control", keys.control, access.control_);
  readAll("record", keys.record, access.record_);
  readAll("admin", keys.admin, access.admin_);
  for (const TokenKeys& token : keys.tokens) {
    if (token.name.empty()) complain("token", "needs a name");
    if (auto secret = readSecret(resolve(token.file))) {
      access.secrets_.push_back({token.name, *std::move(secret)});
    } else {
      complain("token", fmt::format("\"{}\": {}", token.name, secret.error().message));
    }
  }
  return access;
}

bool Access::isOne(const Who& who, const Peer& peer, const std::string& token, const std::string& certificate) {
  switch (who.kind) {
    case Who::Kind::User:
      return peer.user == who.number;
    case Who::Kind::Group:
      return std::ranges::find(peer.groups, who.number) != peer.groups.end();
    case Who::Kind::Token:
      return !token.empty() && token == who.name;
    case Who::Kind::Certificate:
      return !certificate.empty() && certificate == who.name;
    case Who::Kind::Here:
      return peer.user.has_value();
    case Who::Kind::Anyone:
      break;
  }
  return true;
}

Result<Identity> Access::identify(const Peer& peer, const std::string& token, const std::string& certificate) const {
  const auto found =
      std::ranges::find_if(secrets_, [&](const Secret& one) { return !token.empty() && areEqual(one.text, token); });
  if (!token.empty() && found == secrets_.end())
    return Error{Error::Code::PermissionDenied, "the token is none of this daemon's ([[roles.token]])"};
  const std::string token_name = token.empty() ? "" : found->name;
  Identity identity{peer.name(), {}};
  if (!certificate.empty()) identity.name = "certificate:" + certificate;
  if (!token.empty()) identity.name = "token:" + token_name;
  const auto is_among = [&](const std::vector<Who>& all) {
    return std::ranges::any_of(all, [&](const Who& who) { return isOne(who, peer, token_name, certificate); });
  };
  // Whoever could stop the daemon itself.
  const bool is_own = peer.user && (*peer.user == 0 || *peer.user == ::geteuid());
  Grants& grants = identity.grants;
  grants.admin = is_own || is_among(admin_);
  grants.control = grants.admin || !is_limited_ || is_among(control_);
  grants.record = grants.admin || !is_limited_ || is_among(record_);
  grants.view = grants.control || grants.record || is_among(view_);
  if (grants.view) return identity;
  return Error{Error::Code::PermissionDenied,
               fmt::format("{} has no role here: the daemon's [roles] say who may view, control and record", identity.name)};
}

}  // namespace toftwin::daemon
