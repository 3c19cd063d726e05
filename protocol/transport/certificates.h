// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <toftwin/result.h>

namespace toftwin::transport {

/// A small authority of one's own, for a plant that has none: keys on the curve P-256, certificates of X.509 version 3,
/// signed with ECDSA and SHA-256, all as PEM. A file that is there is never overwritten; keys are readable by their owner
/// alone.
struct CertificateWish {
  std::string name;                  ///< its common name, by which [roles] know a client; also the files' name
  std::vector<std::string> hosts{};  ///< of a daemon: names and addresses by which clients call it; none: it is a client's
  int days = 825;                    ///< that it holds
};

/// Makes authority.pem, which all sides trust, and authority.key, which signs, in the folder.
Result<> makeAuthority(const std::filesystem::path& folder, const std::string& name, int days);
/// Makes NAME.pem and NAME.key, signed by the authority of that folder.
Result<> makeCertificate(const std::filesystem::path& folder, const CertificateWish& wish);

}  // namespace toftwin::transport
