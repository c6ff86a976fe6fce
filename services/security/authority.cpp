// SPDX-License-Identifier: BSD-3-Clause
#include "services/security/authority.hpp"

#include <openssl/pem.h>
#include <openssl/rand.h>

#include <ctime>
#include <stdexcept>

#include "services/security/documents.hpp"
#include "services/security/openssl.hpp"

namespace backwash::security {
namespace {

/// A result of OpenSSL's; throws where it has none.
template <typename T>
T made(T result, const char* call) {
  if (!result) throw std::runtime_error(std::string("OpenSSL: ") + call + " failed");
  return result;
}

std::string pem_of(const EVP_PKEY* key) {
  const Bio out = writing();
  made(PEM_write_bio_PrivateKey(out.get(), key, nullptr, nullptr, 0, nullptr, nullptr), "PEM_write_bio_PrivateKey");
  return text_of(out.get());
}

std::string pem_of(X509* certificate) {
  const Bio out = writing();
  made(PEM_write_bio_X509(out.get(), certificate), "PEM_write_bio_X509");
  return text_of(out.get());
}

void extend(X509* certificate, int kind, const char* value) {
  X509_EXTENSION* extension = made(X509V3_EXT_conf_nid(nullptr, nullptr, kind, value), "X509V3_EXT_conf_nid");
  const int added = X509_add_ext(certificate, extension, -1);
  X509_EXTENSION_free(extension);
  made(added, "X509_add_ext");
}

void add(X509_NAME* subject, const char* part, const std::string& text) {
  made(X509_NAME_add_entry_by_txt(subject, part, MBSTRING_UTF8, reinterpret_cast<const unsigned char*>(text.data()),
                                  static_cast<int>(text.size()), -1, 0),
       "X509_NAME_add_entry_by_txt");
}

/// Not signed: a random serial, the key, the validity.
Certificate blank(EVP_PKEY* key, const Validity& validity) {
  Certificate c(made(X509_new(), "X509_new"));
  std::uint64_t serial = 0;
  made(RAND_bytes(reinterpret_cast<unsigned char*>(&serial), sizeof serial) == 1, "RAND_bytes");
  X509_set_version(c.get(), X509_VERSION_3);
  made(ASN1_INTEGER_set_uint64(X509_get_serialNumber(c.get()), serial >> 1 | 1), "ASN1_INTEGER_set_uint64");
  made(ASN1_TIME_set(X509_getm_notBefore(c.get()), validity.from), "ASN1_TIME_set");
  made(ASN1_TIME_set(X509_getm_notAfter(c.get()), validity.until), "ASN1_TIME_set");
  made(X509_set_pubkey(c.get(), key), "X509_set_pubkey");
  return c;
}

Key new_key() { return Key(made(EVP_EC_gen("P-256"), "EVP_EC_gen")); }

}  // namespace

Pair Authority::make(const std::string& name, const Validity& validity) {
  const Key key = new_key();
  const Certificate c = blank(key.get(), validity);
  X509_NAME* subject = X509_get_subject_name(c.get());
  add(subject, "OU", "authority");
  add(subject, "CN", name);
  made(X509_set_issuer_name(c.get(), subject), "X509_set_issuer_name");
  extend(c.get(), NID_basic_constraints, "critical,CA:TRUE,pathlen:0");
  extend(c.get(), NID_key_usage, "critical, keyCertSign, cRLSign, digitalSignature");
  made(X509_sign(c.get(), key.get(), EVP_sha256()), "X509_sign");
  return {pem_of(key.get()), pem_of(c.get())};
}

std::optional<Authority> Authority::of(const Pair& pair) {
  const Key key = key_of(pair.key);
  const Certificate certificate = certificate_of(pair.certificate);
  if (!key || !certificate || X509_check_private_key(certificate.get(), key.get()) != 1) return std::nullopt;
  return Authority(pair);
}

Pair Authority::issue(const std::string& name, Role role, const Validity& validity) const {
  const Key key = new_key();
  const Certificate c = blank(key.get(), validity);
  X509_NAME* subject = X509_get_subject_name(c.get());
  add(subject, "OU", security::name(role));
  add(subject, "CN", name);
  made(X509_set_issuer_name(c.get(), X509_get_subject_name(certificate_of(pair_.certificate).get())),
       "X509_set_issuer_name");
  extend(c.get(), NID_basic_constraints, "critical,CA:FALSE");
  extend(c.get(), NID_key_usage, "critical,digitalSignature");
  made(X509_sign(c.get(), key_of(pair_.key).get(), EVP_sha256()), "X509_sign");
  return {pem_of(key.get()), pem_of(c.get())};
}

std::string Authority::sign(const std::string& text) const {
  constexpr int kHow = PKCS7_TEXT | PKCS7_DETACHED | PKCS7_STREAM;
  const Bio content = reading(text), out = writing();
  const Signed document(
      made(PKCS7_sign(certificate_of(pair_.certificate).get(), key_of(pair_.key).get(), nullptr, content.get(), kHow),
           "PKCS7_sign"));
  made(SMIME_write_PKCS7(out.get(), document.get(), content.get(), kHow), "SMIME_write_PKCS7");
  return text_of(out.get());
}

std::string Authority::governance(Protection protection) const { return sign(governance_xml(protection)); }

std::string Authority::permissions(const std::string& name, const std::string& certificate, const Grant& grant) const {
  const Certificate c(made(certificate_of(certificate), "PEM_read_bio_X509"));
  return sign(permissions_xml(name, subject_of(c.get()), grant,
                              {seconds_of(X509_get0_notBefore(c.get())), seconds_of(X509_get0_notAfter(c.get()))}));
}

std::string Authority::revoke(const std::string& revoked, std::span<const std::string> certificates) const {
  const Certificate authority = certificate_of(pair_.certificate);
  Revocations list = revocations_of(revoked);
  if (!list) list.reset(made(X509_CRL_new(), "X509_CRL_new"));
  struct FreeTime {
    void operator()(ASN1_TIME* time) const noexcept { ASN1_TIME_free(time); }
  };
  const std::unique_ptr<ASN1_TIME, FreeTime> now(made(ASN1_TIME_set(nullptr, ::time(nullptr)), "ASN1_TIME_set"));
  X509_CRL_set_version(list.get(), X509_CRL_VERSION_2);
  X509_CRL_set_issuer_name(list.get(), X509_get_subject_name(authority.get()));
  // As old as its authority: a computer whose clock is behind takes the newest list too.
  X509_CRL_set1_lastUpdate(list.get(), X509_get0_notBefore(authority.get()));
  // A vehicle that gets no newer list flies on with this one, as long as its authority counts.
  X509_CRL_set1_nextUpdate(list.get(), X509_get0_notAfter(authority.get()));
  for (const auto& pem : certificates) {
    const Certificate certificate(made(certificate_of(pem), "PEM_read_bio_X509"));
    X509_REVOKED* known = nullptr;
    if (X509_CRL_get0_by_cert(list.get(), &known, certificate.get()) == 1) continue;
    X509_REVOKED* entry = made(X509_REVOKED_new(), "X509_REVOKED_new");
    X509_REVOKED_set_serialNumber(entry, X509_get_serialNumber(certificate.get()));
    X509_REVOKED_set_revocationDate(entry, now.get());
    made(X509_CRL_add0_revoked(list.get(), entry), "X509_CRL_add0_revoked");
  }
  X509_CRL_sort(list.get());
  made(X509_CRL_sign(list.get(), key_of(pair_.key).get(), EVP_sha256()), "X509_CRL_sign");
  const Bio out = writing();
  made(PEM_write_bio_X509_CRL(out.get(), list.get()), "PEM_write_bio_X509_CRL");
  return text_of(out.get());
}

std::int64_t Authority::ends() const noexcept {
  return seconds_of(X509_get0_notAfter(certificate_of(pair_.certificate).get()));
}

std::optional<Issued> issued(const std::string& certificate, const std::string& revoked) {
  const Certificate c = certificate_of(certificate);
  if (!c) return std::nullopt;
  std::array<char, 64> role{};
  X509_NAME_get_text_by_NID(X509_get_subject_name(c.get()), NID_organizationalUnitName, role.data(), role.size());
  const Revocations list = revocations_of(revoked);
  X509_REVOKED* entry = nullptr;
  return Issued{role.data(), seconds_of(X509_get0_notAfter(c.get())),
                list && X509_CRL_get0_by_cert(list.get(), &entry, c.get()) == 1};
}

}  // namespace backwash::security
