// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <tl/expected.hpp>

/// DDS Security: who a process is, and what it may write (SECURITY.md). Only the sources here see OpenSSL.
namespace backwash::security {

/// Files of a folder of credentials, named as ROS 2 names those of an enclave.
inline constexpr const char* kIdentityCa = "identity_ca.cert.pem";        ///< who signs certificates
inline constexpr const char* kCertificate = "cert.pem";                   ///< who one is
inline constexpr const char* kKey = "key.pem";                            ///< its private key, mode 0600
inline constexpr const char* kPermissionsCa = "permissions_ca.cert.pem";  ///< who signs the next two
inline constexpr const char* kGovernance = "governance.p7s";              ///< how all of a domain speak
inline constexpr const char* kPermissions = "permissions.p7s";            ///< what one may write
inline constexpr const char* kRevoked = "crl.pem";  ///< whose certificates count no more; optional

struct Credentials {
  std::string subject;  ///< as the permissions name it
  std::int64_t ends;    ///< of the certificate, s since 1970
};

/// Judges a folder as the middleware will, so that a start with a bad one ends before any port opens: files and modes,
/// key and certificate, their authority, validity, revocation, both signatures, and whose the permissions are.
/// Error: one line, `FILE: what; what would be right`, without a byte of the key.
tl::expected<Credentials, std::string> read_credentials(const std::string& folder);

}  // namespace backwash::security
