// SPDX-License-Identifier: BSD-3-Clause
#include "services/dds/quality.hpp"

#include <dds/dds.h>
#include <type_hashes.hpp>

#include <string>

namespace backwash::dds {
namespace {

bool best_effort(Delivery delivery, Role role) {
  return delivery == Delivery::latest || delivery == Delivery::scans || delivery == Delivery::tf ||
         delivery == Delivery::parts || (delivery == Delivery::status && role == Role::reader);
}

int depth(Delivery delivery) {
  switch (delivery) {
    case Delivery::reliable:
    case Delivery::tf:
    case Delivery::parts:
      return 64;
    case Delivery::sent_tf:
      return 100;
    case Delivery::scans:
      return 8;
    default:
      return 1;
  }
}

}  // namespace

dds_qos* quality(Delivery delivery, Role role, std::string_view type) {
  dds_qos_t* qos = dds_create_qos();
  dds_qset_reliability(qos, best_effort(delivery, role) ? DDS_RELIABILITY_BEST_EFFORT : DDS_RELIABILITY_RELIABLE,
                       DDS_MSECS(100));
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, depth(delivery));
  dds_qset_durability(qos, delivery == Delivery::state ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
  // Of readers nothing of the kind is asked: a writer without a lease is as welcome.
  if (delivery == Delivery::reliable && role == Role::writer)
    dds_qset_liveliness(qos, DDS_LIVELINESS_AUTOMATIC, static_cast<dds_duration_t>(kLease_s * 1e9));
  if (const std::string_view hash = type_hash(type); !hash.empty()) {
    const std::string said = "typehash=" + std::string(hash) + ";";
    dds_qset_userdata(qos, said.data(), said.size());
  }
  return qos;
}

}  // namespace backwash::dds
