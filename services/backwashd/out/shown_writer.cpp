// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/out/shown_writer.hpp"

#include <spdlog/spdlog.h>

#include "services/security/credentials.hpp"

namespace backwash::daemon {
namespace {

/// Whose credentials these are: the common name in the certificate. The folder's own name may be any.
std::string holder(const std::string& folder) {
  const auto credentials = security::read_credentials(folder);
  const std::string subject = credentials ? credentials->subject : "";
  const auto at = subject.find("CN=");
  if (at == subject.npos) return "NAME";
  return subject.substr(at + 3, subject.find(',', at) - at - 3);
}

}  // namespace

void warn_not_permitted(const std::string& topic, const decltype(config::Daemon::dds)& config) {
  spdlog::warn(
      "the credentials in {} do not allow {}, which is not sent; in the authority's folder KEYS, "
      "backwash keys add KEYS {} --role vehicle --namespace {} --force makes new ones",
      config.security, topic, holder(config.security), config.name_space);
}

}  // namespace backwash::daemon
