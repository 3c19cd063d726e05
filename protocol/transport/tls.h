// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include <toftwin/result.h>

namespace toftwin::transport {

/// Certificates and keys, in PEM files.
struct TlsFiles {
  std::filesystem::path certificate;  ///< this side's, with those between it and the authority; empty: it has none
  std::filesystem::path key;          ///< of it
  std::filesystem::path authorities;  ///< whose peers are trusted; empty: a server asks its clients for none
};

/// What TLS connections of one side have in common. Version 1.3 and no other. May be used from any thread, and by
/// connections that outlive whoever made it.
class TlsContext {
 public:
  /// `needs_certificate`: a client without one is refused. Errors name the file, and what to do.
  static Result<std::shared_ptr<const TlsContext>> forServer(const TlsFiles& files, bool needs_certificate);
  /// A client trusts the system's authorities where none are named.
  static Result<std::shared_ptr<const TlsContext>> forClient(const TlsFiles& files);
  ~TlsContext();
  TlsContext(const TlsContext&) = delete;
  TlsContext& operator=(const TlsContext&) = delete;

 private:
  friend class FramedSocket;
  struct State;
  explicit TlsContext(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace toftwin::transport
