// SPDX-License-Identifier: BSD-3-Clause
#include "services/security/documents.hpp"

#include <array>
#include <ctime>
#include <string_view>

#include "idl/topics.hpp"

namespace backwash::security {
namespace {

// Every domain: the middleware asks for its own number of one, which is another than that on the wire for a participant
// with sockets of its own (services/dds).
constexpr std::string_view kDomains = "<domains><id_range><min>0</min><max>230</max></id_range></domains>\n";

std::string document(const std::string& schema, const std::string& content) {
  return "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<dds xmlns:xsi=\"http://www.w3.org/2001/XMLSchema-instance\" "
         "xsi:noNamespaceSchemaLocation=\"http://www.omg.org/spec/DDS-SECURITY/20170901/omg_shared_ca_" +
         schema + ".xsd\">\n" + content + "</dds>\n";
}

std::string time_of(std::int64_t s) {
  const std::time_t time = s;
  std::tm parts{};
  ::gmtime_r(&time, &parts);
  std::array<char, 32> text;
  return {text.data(), std::strftime(text.data(), text.size(), "%Y-%m-%dT%H:%M:%SZ", &parts)};
}

bool writes(Role role, const dds::Writers& writers) {
  return (role == Role::vehicle && writers.vehicle) || (role == Role::station && writers.station) ||
         (role == Role::vio && writers.vio);
}

std::vector<std::string> writable(const Grant& grant) {
  std::vector<std::string> topics;
  for (const dds::Topic& topic : dds::kTopics)
    if (writes(grant.role, topic.writers)) topics.push_back("rt/" + grant.name_space + "/" + std::string(topic.name));
  if (grant.role == Role::vehicle) topics.insert(topics.end(), {dds::kDiagnostics, dds::kTf});
  topics.insert(topics.end(), grant.topics.begin(), grant.topics.end());
  return topics;
}

}  // namespace

const char* name(Role role) noexcept {
  switch (role) {
    case Role::vehicle:
      return "vehicle";
    case Role::station:
      return "station";
    case Role::observer:
      return "observer";
    case Role::vio:
      break;
  }
  return "vio";
}

std::string governance_xml(Protection protection) {
  const std::string kind = protection == Protection::sign ? "SIGN" : "ENCRYPT";
  return document(
      "governance",
      "<domain_access_rules><domain_rule>\n" + std::string(kDomains) +
          "<allow_unauthenticated_participants>false</allow_unauthenticated_participants>\n"
          "<enable_join_access_control>true</enable_join_access_control>\n"
          // Encrypted in either case: a filter that changed a signed one (packet_filter.hpp) would break its signature.
          "<discovery_protection_kind>ENCRYPT</discovery_protection_kind>\n"
          "<liveliness_protection_kind>" +
          kind + "</liveliness_protection_kind>\n<rtps_protection_kind>" + kind +
          "_WITH_ORIGIN_AUTHENTICATION</rtps_protection_kind>\n"
          "<topic_access_rules><topic_rule><topic_expression>*</topic_expression>\n"
          "<enable_discovery_protection>true</enable_discovery_protection>\n"
          "<enable_liveliness_protection>true</enable_liveliness_protection>\n"
          "<enable_read_access_control>false</enable_read_access_control>\n"
          "<enable_write_access_control>true</enable_write_access_control>\n"
          // Protected already, as a part of the whole packet.
          "<metadata_protection_kind>NONE</metadata_protection_kind>\n"
          "<data_protection_kind>NONE</data_protection_kind>\n"
          "</topic_rule></topic_access_rules>\n</domain_rule></domain_access_rules>\n");
}

std::string permissions_xml(const std::string& name, const std::string& subject, const Grant& grant,
                            const Validity& validity) {
  std::string publish;
  for (const auto& topic : writable(grant)) publish += "<topic>" + topic + "</topic>\n";
  if (!publish.empty()) publish = "<publish><topics>\n" + publish + "</topics></publish>\n";
  return document("permissions", "<permissions><grant name=\"" + name + "\">\n<subject_name>" + subject +
                                     "</subject_name>\n<validity><not_before>" + time_of(validity.from) +
                                     "</not_before><not_after>" + time_of(validity.until) +
                                     "</not_after></validity>\n<allow_rule>\n" + std::string(kDomains) + publish +
                                     "<subscribe><topics><topic>*</topic></topics></subscribe>\n</allow_rule>\n"
                                     "<default>DENY</default>\n</grant></permissions>\n");
}

}  // namespace backwash::security
