// SPDX-License-Identifier: BSD-3-Clause
#include "services/dds/guard/secured.hpp"

#include <dds/dds.h>
#include <dlfcn.h>

#include <filesystem>
#include <utility>

#include "services/security/credentials.hpp"

namespace backwash::dds {
namespace {

/// Debian keeps the plug-ins in a folder beside the library, others beside it; the loader looks in neither.
std::string plugins() {
  namespace fs = std::filesystem;
  Dl_info library{};
  if (::dladdr(reinterpret_cast<const void*>(&dds_create_participant), &library) == 0) return "";
  const fs::path beside = fs::path(library.dli_fname).parent_path();
  std::error_code unknown;
  for (const fs::path& folder : {beside / "libddsc0debian", beside})
    if (fs::exists(folder / "libdds_security_auth.so", unknown)) return folder.string() + "/";
  return "";
}

}  // namespace

dds_qos* secured(const std::string& credentials) {
  if (credentials.empty()) return nullptr;
  dds_qos_t* qos = dds_create_qos();
  const std::string folder = plugins();
  const std::pair<std::string, std::string> libraries[] = {
      {"auth", "authentication"}, {"access", "access_control"}, {"crypto", "crypto"}};
  for (const auto& [kind, calls] : libraries) {
    const std::string property = "dds.sec." + kind + '.';
    const std::string file = "libdds_security_" + (kind == "access" ? "ac" : kind) + ".so";
    dds_qset_prop(qos, (property + "library.path").c_str(), (folder + file).c_str());
    dds_qset_prop(qos, (property + "library.init").c_str(), ("init_" + calls).c_str());
    dds_qset_prop(qos, (property + "library.finalize").c_str(), ("finalize_" + calls).c_str());
  }
  const std::pair<const char*, const char*> files[] = {{"dds.sec.auth.identity_ca", security::kIdentityCa},
                                                       {"dds.sec.auth.identity_certificate", security::kCertificate},
                                                       {"dds.sec.auth.private_key", security::kKey},
                                                       {"dds.sec.access.permissions_ca", security::kPermissionsCa},
                                                       {"dds.sec.access.governance", security::kGovernance},
                                                       {"dds.sec.access.permissions", security::kPermissions},
                                                       {"org.eclipse.cyclonedds.sec.auth.crl", security::kRevoked}};
  std::error_code unknown;
  for (const auto& [property, name] : files) {
    const std::string path = credentials + "/" + name;
    if (std::filesystem::exists(path, unknown)) dds_qset_prop(qos, property, ("file:" + path).c_str());
  }
  return qos;
}

}  // namespace backwash::dds
