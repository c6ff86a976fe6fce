// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <openssl/bio.h>
#include <openssl/evp.h>
#include <openssl/pkcs7.h>
#include <openssl/x509.h>
#include <openssl/x509v3.h>

#include <memory>
#include <string>

/// OpenSSL's objects as values that free themselves, for the sources here alone.
namespace backwash::security {

template <auto kFree>
struct Free {
  template <typename T>
  void operator()(T* object) const noexcept {
    kFree(object);
  }
};

using Bio = std::unique_ptr<BIO, Free<BIO_free_all>>;
using Key = std::unique_ptr<EVP_PKEY, Free<EVP_PKEY_free>>;
using Certificate = std::unique_ptr<X509, Free<X509_free>>;
using Revocations = std::unique_ptr<X509_CRL, Free<X509_CRL_free>>;
using Signed = std::unique_ptr<PKCS7, Free<PKCS7_free>>;
using Store = std::unique_ptr<X509_STORE, Free<X509_STORE_free>>;
using Verification = std::unique_ptr<X509_STORE_CTX, Free<X509_STORE_CTX_free>>;

/// Reads what is there; `text` outlives it.
Bio reading(const std::string& text);
Bio writing();
std::string text_of(BIO* bio);

/// Null where the text is no such thing.
Key key_of(const std::string& pem);
Certificate certificate_of(const std::string& pem);
Revocations revocations_of(const std::string& pem);

/// As permissions name it: the last part first, commas without blanks (RFC 2253).
std::string subject_of(const X509* certificate);
/// Seconds since 1970.
std::int64_t seconds_of(const ASN1_TIME* time);

}  // namespace backwash::security
