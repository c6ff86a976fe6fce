// SPDX-License-Identifier: BSD-3-Clause
#include "services/security/credentials.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <ctime>
#include <system_error>

#include "services/security/openssl.hpp"

namespace backwash::security {
namespace {

using Text = tl::expected<std::string, std::string>;

tl::unexpected<std::string> wrong(const std::string& file, const std::string& what) {
  return tl::make_unexpected(file + ": " + what);
}

/// A whole small regular file. It is judged as it is open, not by its name.
Text content_of(int fd, const std::string& path, bool secret) {
  constexpr off_t kLargest = 1 << 20;  // bytes
  struct stat about {};
  if (::fstat(fd, &about) != 0 || !S_ISREG(about.st_mode) || about.st_size > kLargest)
    return wrong(path, "needs a regular file of at most 1 MiB");
  if (secret && (about.st_mode & 0177) != 0) {
    std::array<char, 80> text;
    std::snprintf(text.data(), text.size(), "has mode %04o, needs 0600: nobody but its owner may read a key",
                  about.st_mode & 07777U);
    return wrong(path, text.data());
  }
  std::string all;
  std::array<char, 4096> block;
  for (ssize_t n = 1; n > 0; all.append(block.data(), static_cast<std::size_t>(n > 0 ? n : 0))) {
    n = ::read(fd, block.data(), block.size());
    if (n < 0) return wrong(path, "cannot be read: " + std::generic_category().message(errno));
  }
  return all;
}

Text read(const std::string& path, bool secret = false) {
  const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);
  if (fd < 0)
    return wrong(path, "cannot be opened: " + std::generic_category().message(errno) +
                           "; backwash keys makes a folder of credentials");
  Text text = content_of(fd, path, secret);
  ::close(fd);
  return text;
}

/// Reads a file of the folder as what `parse` makes of it.
template <typename Parse>
auto parsed(const std::string& path, const char* what, Parse parse, bool secret = false)
    -> tl::expected<decltype(parse(std::string())), std::string> {
  const Text text = read(path, secret);
  if (!text) return tl::unexpected(text.error());
  auto object = parse(*text);
  if (!object) return wrong(path, std::string("needs ") + what + " in PEM, without a pass phrase");
  return object;
}

/// Why the certificate does not count; empty if it does.
std::string refusal(X509* certificate, X509* authority, X509_CRL* revoked) {
  const Store store(X509_STORE_new());
  X509_STORE_add_cert(store.get(), authority);
  if (revoked) {
    X509_STORE_add_crl(store.get(), revoked);
    X509_STORE_set_flags(store.get(), X509_V_FLAG_CRL_CHECK);
  }
  const Verification check(X509_STORE_CTX_new());
  X509_STORE_CTX_init(check.get(), store.get(), certificate, nullptr);
  if (X509_verify_cert(check.get()) == 1) return "";
  return X509_verify_cert_error_string(X509_STORE_CTX_get_error(check.get()));
}

/// By this computer's clock, which may be what is wrong.
std::string today() {
  const std::time_t now = std::time(nullptr);
  std::tm parts{};
  ::gmtime_r(&now, &parts);
  std::array<char, 16> text;
  return {text.data(), std::strftime(text.data(), text.size(), "%Y-%m-%d", &parts)};
}

/// What a signed document says; an error if its signature is not the authority's.
Text signed_text(const std::string& path, X509* authority, const std::string& authority_path) {
  const Text text = read(path);
  if (!text) return tl::unexpected(text.error());
  BIO* content = nullptr;
  const Signed document(SMIME_read_PKCS7(reading(*text).get(), &content));
  const Bio owned(content), out = writing();
  const Store store(X509_STORE_new());
  X509_STORE_add_cert(store.get(), authority);
  // The authority signs itself, and by itself: no other certificate of the message counts.
  STACK_OF(X509)* signers = sk_X509_new_null();
  sk_X509_push(signers, authority);
  const bool good = document && PKCS7_verify(document.get(), signers, store.get(), content, out.get(),
                                             PKCS7_TEXT | PKCS7_NOINTERN | PKCS7_NOVERIFY) == 1;
  sk_X509_free(signers);
  if (!good) return wrong(path, "is not signed by " + authority_path);
  return text_of(out.get());
}

/// Whether one of the grants is for this subject.
bool grants(const std::string& permissions, const std::string& subject) {
  constexpr std::string_view kOpen = "<subject_name>", kClose = "</subject_name>", kBlank = " \t\r\n";
  for (std::size_t at = permissions.find(kOpen); at != permissions.npos; at = permissions.find(kOpen, at)) {
    at += kOpen.size();
    const auto end = permissions.find(kClose, at);
    if (end == permissions.npos) return false;
    const auto first = permissions.find_first_not_of(kBlank, at), last = permissions.find_last_not_of(kBlank, end - 1);
    if (first <= last && permissions.substr(first, last + 1 - first) == subject) return true;
  }
  return false;
}

/// The list of the folder, if it has one.
tl::expected<Revocations, std::string> revocations_in(const std::string& path, X509* authority) {
  if (::access(path.c_str(), F_OK) != 0 && errno == ENOENT) return Revocations();
  auto revoked = parsed(path, "a list of revoked certificates", revocations_of);
  if (revoked && X509_CRL_verify(revoked->get(), X509_get0_pubkey(authority)) != 1)
    return wrong(path, std::string("is not signed by ") + kIdentityCa);
  return revoked;
}

}  // namespace

tl::expected<Credentials, std::string> read_credentials(const std::string& folder) {
  const auto in = [&](const char* name) { return folder + "/" + name; };
  const auto key = parsed(in(kKey), "a private key", key_of, true);
  if (!key) return tl::unexpected(key.error());
  const auto certificate = parsed(in(kCertificate), "a certificate", certificate_of);
  if (!certificate) return tl::unexpected(certificate.error());
  const auto authority = parsed(in(kIdentityCa), "a certificate", certificate_of);
  if (!authority) return tl::unexpected(authority.error());
  const auto permissions_ca = parsed(in(kPermissionsCa), "a certificate", certificate_of);
  if (!permissions_ca) return tl::unexpected(permissions_ca.error());
  const auto revoked = revocations_in(in(kRevoked), authority->get());
  if (!revoked) return tl::unexpected(revoked.error());
  if (X509_check_private_key(certificate->get(), key->get()) != 1)
    return wrong(in(kCertificate), std::string("is of another key than ") + kKey);
  if (const auto why = refusal(certificate->get(), authority->get(), revoked->get()); !why.empty())
    return wrong(in(kCertificate), why + "; needs one of " + kIdentityCa + " that counts now, " + today());
  if (const auto governance = signed_text(in(kGovernance), permissions_ca->get(), kPermissionsCa); !governance)
    return tl::unexpected(governance.error());
  const auto permissions = signed_text(in(kPermissions), permissions_ca->get(), kPermissionsCa);
  if (!permissions) return tl::unexpected(permissions.error());
  Credentials c{subject_of(certificate->get()), seconds_of(X509_get0_notAfter(certificate->get()))};
  if (!grants(*permissions, c.subject)) return wrong(in(kPermissions), "grants nothing to " + c.subject);
  return c;
}

}  // namespace backwash::security
