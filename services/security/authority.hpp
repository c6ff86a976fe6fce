// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "services/security/credentials.hpp"

namespace backwash::security {

/// Protection of what all of a domain send: both are authenticated for each receiver, so that one who may only listen
/// cannot speak as another.
enum class Protection { encrypt, sign };

/// What each may write is in idl/topics.hpp; a vehicle also the diagnostics and transforms of ROS 2, an observer
/// nothing.
enum class Role { vehicle, station, observer, vio };
inline constexpr Role kRoles[] = {Role::vehicle, Role::station, Role::observer, Role::vio};
const char* name(Role role) noexcept;

/// Seconds since 1970.
struct Validity {
  std::int64_t from, until;
};

/// What one may write. Everyone who is authenticated may read all.
struct Grant {
  Role role = Role::observer;
  std::string name_space;           ///< of the vehicle that its role is about
  std::vector<std::string> topics;  ///< others that it may write, by their whole name on the wire
};

/// A private key and the certificate for it, PEM.
struct Pair {
  std::string key, certificate;
};

/// Who signs certificates, permissions and the governance of one network. Each call throws std::runtime_error where
/// OpenSSL has no memory or no random numbers.
class Authority {
 public:
  static Pair make(const std::string& name, const Validity& validity);
  /// Nothing where these are no key and certificate that belong together.
  static std::optional<Authority> of(const Pair& pair);

  Pair issue(const std::string& name, Role role, const Validity& validity) const;
  std::string governance(Protection protection) const;
  /// For the holder of the certificate, as long as that is valid.
  std::string permissions(const std::string& name, const std::string& certificate, const Grant& grant) const;
  /// The list of revoked certificates with these as well; `revoked`: the list so far, or nothing.
  std::string revoke(const std::string& revoked, std::span<const std::string> certificates) const;
  const std::string& certificate() const noexcept { return pair_.certificate; }
  std::int64_t ends() const noexcept;

 private:
  explicit Authority(Pair pair) : pair_(std::move(pair)) {}
  std::string sign(const std::string& text) const;
  Pair pair_;
};

/// What a certificate says; nothing where the text is none.
struct Issued {
  std::string role;
  std::int64_t ends;
  bool revoked;
};
std::optional<Issued> issued(const std::string& certificate, const std::string& revoked);

}  // namespace backwash::security
