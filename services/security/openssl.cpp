// SPDX-License-Identifier: BSD-3-Clause
#include "services/security/openssl.hpp"

#include <openssl/pem.h>

#include <ctime>

namespace backwash::security {

Bio reading(const std::string& text) { return Bio(BIO_new_mem_buf(text.data(), static_cast<int>(text.size()))); }

Bio writing() { return Bio(BIO_new(BIO_s_mem())); }

std::string text_of(BIO* bio) {
  char* data = nullptr;
  const long size = BIO_get_mem_data(bio, &data);
  return {data, static_cast<std::size_t>(size)};
}

namespace {

/// A key with a pass phrase is none here: nobody is there to be asked.
int no_phrase(char*, int, int, void*) { return -1; }

}  // namespace

Key key_of(const std::string& pem) {
  return Key(PEM_read_bio_PrivateKey(reading(pem).get(), nullptr, no_phrase, nullptr));
}

Certificate certificate_of(const std::string& pem) {
  return Certificate(PEM_read_bio_X509(reading(pem).get(), nullptr, no_phrase, nullptr));
}

Revocations revocations_of(const std::string& pem) {
  return Revocations(PEM_read_bio_X509_CRL(reading(pem).get(), nullptr, no_phrase, nullptr));
}

std::string subject_of(const X509* certificate) {
  const Bio text = writing();
  X509_NAME_print_ex(text.get(), X509_get_subject_name(certificate), 0, XN_FLAG_RFC2253);
  return text_of(text.get());
}

std::int64_t seconds_of(const ASN1_TIME* time) {
  std::tm parts{};
  return ASN1_TIME_to_tm(time, &parts) == 1 ? std::int64_t{::timegm(&parts)} : 0;
}

}  // namespace backwash::security
