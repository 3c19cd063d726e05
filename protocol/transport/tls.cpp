// SPDX-License-Identifier: Apache-2.0
#include "protocol/transport/tls.h"

#include <openssl/ssl.h>

#include <algorithm>
#include <exception>
#include <thread>

#include "protocol/transport/tls_context.h"

namespace toftwin::transport {
namespace {

namespace ssl = boost::asio::ssl;
using boost::system::error_code;

Error cannotUse(const std::filesystem::path& file, const char* as, const error_code& fault) {
  return {Error::Code::InvalidArgument,
          file.string() + ": cannot be used as " + as + ": " + fault.message() +
              "; `toftwin certificate` makes such files"};
}

/// AES of 128 bits first, which is no easier to break within anybody's life and a fifth quicker than of 256.
void chooseCiphers(ssl::context& context) {
  ::SSL_CTX_set_ciphersuites(context.native_handle(), "TLS_AES_128_GCM_SHA256:TLS_AES_256_GCM_SHA384:TLS_CHACHA20_POLY1305_SHA256");
  ::SSL_CTX_set_options(context.native_handle(), SSL_OP_CIPHER_SERVER_PREFERENCE);
}

/// As many as encrypt faster than one network takes it.
std::unique_ptr<EncryptAside> threadsAside() {
  constexpr unsigned kMost = 4;
  try {
    return std::make_unique<EncryptAside>(std::clamp(std::thread::hardware_concurrency(), 1U, kMost));
  } catch (const std::exception&) {
    return nullptr;
  }
}

/// Both or neither.
Result<> useCertificate(ssl::context& context, const TlsFiles& files) {
  if (files.certificate.empty() && files.key.empty()) return {};
  error_code fault;
  context.use_certificate_chain_file(files.certificate.string(), fault);
  if (fault) return cannotUse(files.certificate, "a certificate", fault);
  context.use_private_key_file(files.key.string(), ssl::context::pem, fault);
  if (fault) return cannotUse(files.key, "the key of that certificate", fault);
  return {};
}

Result<> useAuthorities(ssl::context& context, const TlsFiles& files) {
  error_code fault;
  context.load_verify_file(files.authorities.string(), fault);
  if (fault) return cannotUse(files.authorities, "certificates of authorities", fault);
  return {};
}

}  // namespace

TlsContext::TlsContext(std::unique_ptr<State> state) : state_(std::move(state)) {}
TlsContext::~TlsContext() = default;

Result<std::shared_ptr<const TlsContext>> TlsContext::forServer(const TlsFiles& files, bool needs_certificate) {
  auto state = std::make_unique<State>(ssl::context::tlsv13_server);
  state->is_server = true;
  chooseCiphers(state->context);
  if (auto used = useCertificate(state->context, files); !used) return used.error();
  if (!files.authorities.empty()) {
    if (auto used = useAuthorities(state->context, files); !used) return used.error();
    state->context.set_verify_mode(needs_certificate ? ssl::verify_peer | ssl::verify_fail_if_no_peer_cert
                                                     : ssl::verify_peer);
  }
  state->aside = threadsAside();
  // Nobody resumes: a client that was let in once is asked again.
  ::SSL_CTX_set_session_cache_mode(state->context.native_handle(), SSL_SESS_CACHE_OFF);
  ::SSL_CTX_set_num_tickets(state->context.native_handle(), 0);
  return std::shared_ptr<const TlsContext>{new TlsContext{std::move(state)}};
}

Result<std::shared_ptr<const TlsContext>> TlsContext::forClient(const TlsFiles& files) {
  auto state = std::make_unique<State>(ssl::context::tlsv13_client);
  chooseCiphers(state->context);
  if (auto used = useCertificate(state->context, files); !used) return used.error();
  error_code fault;
  if (files.authorities.empty()) {
    state->context.set_default_verify_paths(fault);
  } else if (auto used = useAuthorities(state->context, files); !used) {
    return used.error();
  }
  state->context.set_verify_mode(ssl::verify_peer);
  return std::shared_ptr<const TlsContext>{new TlsContext{std::move(state)}};
}

}  // namespace toftwin::transport
