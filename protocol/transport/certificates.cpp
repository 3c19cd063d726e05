// SPDX-License-Identifier: Apache-2.0
#include "protocol/transport/certificates.h"

#include <fcntl.h>
#include <openssl/bio.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/rand.h>
#include <openssl/x509v3.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <memory>

#include "protocol/transport/memfd.h"

namespace toftwin::transport {
namespace {

template <auto free>
struct Freed {
  template <class T>
  void operator()(T* thing) const {
    free(thing);
  }
};
using Key = std::unique_ptr<EVP_PKEY, Freed<EVP_PKEY_free>>;
using Certificate = std::unique_ptr<X509, Freed<X509_free>>;
using Memory = std::unique_ptr<BIO, Freed<BIO_free_all>>;

constexpr const char* kAuthorityName = "authority";

Error failed(const std::string& what) { return {Error::Code::Internal, "OpenSSL cannot make " + what}; }

bool isFileName(const std::string& name) {
  return !name.empty() && name.size() <= 64 && name.front() != '.' && std::ranges::all_of(name, [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '-' || c == '_' || c == '.';
  });
}

Result<> checkName(const std::string& name) {
  if (isFileName(name)) return {};
  return Error{Error::Code::InvalidArgument,
               "\"" + name + "\" is no name for a certificate: letters, digits, '-', '_' and '.', at most 64"};
}

bool add(X509* certificate, X509* issuer, int kind, const std::string& value) {
  X509V3_CTX context;
  X509V3_set_ctx(&context, issuer, certificate, nullptr, nullptr, 0);
  X509_EXTENSION* const extension = X509V3_EXT_conf_nid(nullptr, &context, kind, value.c_str());
  if (extension == nullptr) return false;
  const bool is_added = X509_add_ext(certificate, extension, -1) == 1;
  X509_EXTENSION_free(extension);
  return is_added;
}

/// A certificate of that name for that key, not signed yet. Serial numbers are random, so that nobody has to count.
Certificate draft(const std::string& name, EVP_PKEY* key, const X509_NAME* issuer, int days) {
  constexpr long kDay = 24L * 3600L;
  Certificate made{X509_new()};
  std::array<unsigned char, 16> serial{};
  if (!made || RAND_bytes(serial.data(), static_cast<int>(serial.size())) != 1) return nullptr;
  serial[0] &= 0x7F;  // positive
  const std::unique_ptr<BIGNUM, Freed<BN_free>> number{
      BN_bin2bn(serial.data(), static_cast<int>(serial.size()), nullptr)};
  X509_NAME* const subject = X509_get_subject_name(made.get());
  const bool is_made =
      number != nullptr && X509_set_version(made.get(), 2) == 1 &&
      BN_to_ASN1_INTEGER(number.get(), X509_get_serialNumber(made.get())) != nullptr &&
      X509_gmtime_adj(X509_getm_notBefore(made.get()), -kDay) != nullptr &&  // clocks of a plant differ
      X509_gmtime_adj(X509_getm_notAfter(made.get()), kDay * days) != nullptr &&
      X509_set_pubkey(made.get(), key) == 1 &&
      X509_NAME_add_entry_by_txt(subject, "CN", MBSTRING_UTF8, reinterpret_cast<const unsigned char*>(name.c_str()), -1, -1,
                                 0) == 1 &&
      X509_set_issuer_name(made.get(), issuer == nullptr ? subject : issuer) == 1;
  return is_made ? std::move(made) : nullptr;
}

/// Whole or not at all, and never in the place of another.
Result<> writeNew(const std::filesystem::path& file, BIO* content, mode_t mode) {
  char* text = nullptr;
  const long size = BIO_get_mem_data(content, &text);
  const FileDescriptor out{::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, mode)};
  if (!out) {
    const bool is_there = errno == EEXIST;
    return Error{is_there ? Error::Code::InvalidArgument : Error::Code::PermissionDenied,
                 file.string() + (is_there ? ": is there already, and is left alone"
                                           : ": cannot be made: " + std::string{std::strerror(errno)})};
  }
  if (::write(out.get(), text, static_cast<std::size_t>(size)) == size && ::fsync(out.get()) == 0) return {};
  ::unlink(file.c_str());
  return Error{Error::Code::StorageFull, file.string() + ": cannot be written: " + std::strerror(errno)};
}

Result<> writeBoth(const std::filesystem::path& folder, const std::string& name, X509* certificate, EVP_PKEY* key) {
  const Memory key_text{BIO_new(BIO_s_mem())}, text{BIO_new(BIO_s_mem())};
  if (!key_text || !text || PEM_write_bio_X509(text.get(), certificate) != 1 ||
      PEM_write_bio_PrivateKey(key_text.get(), key, nullptr, nullptr, 0, nullptr, nullptr) != 1)
    return failed("a PEM file");
  const std::filesystem::path key_file = folder / (name + ".key");
  if (auto wrote = writeNew(key_file, key_text.get(), 0600); !wrote) return wrote;
  const Result<> wrote = writeNew(folder / (name + ".pem"), text.get(), 0644);
  if (!wrote) ::unlink(key_file.c_str());
  return wrote;
}

struct Authority {
  Certificate certificate;
  Key key;
};

Result<Authority> readAuthority(const std::filesystem::path& folder) {
  const std::string certificate_file = folder / "authority.pem", key_file = folder / "authority.key";
  const Memory certificate{BIO_new_file(certificate_file.c_str(), "r")}, key{BIO_new_file(key_file.c_str(), "r")};
  Authority authority;
  if (certificate) authority.certificate.reset(PEM_read_bio_X509(certificate.get(), nullptr, nullptr, nullptr));
  if (key) authority.key.reset(PEM_read_bio_PrivateKey(key.get(), nullptr, nullptr, nullptr));
  if (authority.certificate && authority.key) return authority;
  return Error{Error::Code::NotFound,
               folder.string() + ": there is no authority (authority.pem, authority.key); `toftwin certificate authority " +
                   folder.string() + "` makes one"};
}

/// "DNS:dock.local,IP:10.0.0.5"
std::string alternativeNames(const std::vector<std::string>& hosts) {
  std::string names;
  for (const std::string& host : hosts) {
    const bool is_address = host.find(':') != std::string::npos || host.find_first_not_of("0123456789.") == std::string::npos;
    names += (names.empty() ? "" : ",") + std::string{is_address ? "IP:" : "DNS:"} + host;
  }
  return names;
}

}  // namespace

Result<> makeAuthority(const std::filesystem::path& folder, const std::string& name, int days) {
  std::error_code reported_by_open;
  std::filesystem::create_directories(folder, reported_by_open);
  const Key key{EVP_EC_gen("P-256")};
  const Certificate made = key ? draft(name, key.get(), nullptr, days) : nullptr;
  const bool is_made = made && add(made.get(), made.get(), NID_basic_constraints, "critical,CA:TRUE,pathlen:0") &&
                       add(made.get(), made.get(), NID_key_usage, "critical,keyCertSign,cRLSign") &&
                       add(made.get(), made.get(), NID_subject_key_identifier, "hash") &&
                       X509_sign(made.get(), key.get(), EVP_sha256()) > 0;
  if (!is_made) return failed("an authority");
  return writeBoth(folder, kAuthorityName, made.get(), key.get());
}

Result<> makeCertificate(const std::filesystem::path& folder, const CertificateWish& wish) {
  if (auto checked = checkName(wish.name); !checked) return checked;
  const auto authority = readAuthority(folder);
  if (!authority) return authority.error();
  X509* const issuer = authority->certificate.get();
  const Key key{EVP_EC_gen("P-256")};
  const Certificate made = key ? draft(wish.name, key.get(), X509_get_subject_name(issuer), wish.days) : nullptr;
  const bool is_of_daemon = !wish.hosts.empty();
  const bool is_made = made && add(made.get(), issuer, NID_basic_constraints, "critical,CA:FALSE") &&
                       add(made.get(), issuer, NID_key_usage, "critical,digitalSignature") &&
                       add(made.get(), issuer, NID_ext_key_usage, is_of_daemon ? "serverAuth" : "clientAuth") &&
                       add(made.get(), issuer, NID_subject_key_identifier, "hash") &&
                       add(made.get(), issuer, NID_authority_key_identifier, "keyid");
  if (!is_made) return failed("a certificate");
  if (is_of_daemon && !add(made.get(), issuer, NID_subject_alt_name, alternativeNames(wish.hosts))) {
    return Error{Error::Code::InvalidArgument, "one of the hosts is no name and no address: " + alternativeNames(wish.hosts)};
  }
  if (X509_sign(made.get(), authority->key.get(), EVP_sha256()) <= 0) return failed("a signature");
  return writeBoth(folder, wish.name, made.get(), key.get());
}

}  // namespace toftwin::transport
