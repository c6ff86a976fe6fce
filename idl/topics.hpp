// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string_view>

/// The topics of docs/interfaces.md: name, delivery and who may write each. Types: services/dds/topics.hpp.
namespace backwash::dds {

/// Delivery of a topic.
enum class Delivery {
  latest,    ///< best effort, keep last 1: odometry
  status,    ///< sent reliably, keep last 1: whoever reads is matched, and holds up nobody; read best effort
  sent_tf,   ///< reliable, keep last 100: transforms, as ROS 2's broadcasters send them
  tf,        ///< best effort, keep last 64: transforms of all, ours among them
  scans,     ///< best effort, keep last 8: point clouds, as ROS 2 drivers send sensor data
  parts,     ///< best effort, keep last 64: parts of maps and their receipts, which say themselves what is missing
  reliable,  ///< reliable, keep last 64, a writer's liveliness has a lease of kLease_s: commands and acknowledgements
  state,     ///< reliable, transient local, keep last 1: late joiners get the newest: map, trajectory, tube
};

/// Who may write a topic, by the roles of credentials.
struct Writers {
  bool vehicle = false, station = false, vio = false;
};
inline constexpr Writers kVehicle{.vehicle = true}, kStation{.station = true}, kVio{.vio = true};

/// One topic of a vehicle: rt/NAMESPACE/name on the wire.
struct Topic {
  std::string_view name;
  Delivery delivery;
  Writers writers;
};

inline constexpr Topic kTopics[] = {
    {"odometry", Delivery::latest, kVio},
    {"loop_closure", Delivery::state, kVio},
    {"map", Delivery::state, kVio},
    {"points", Delivery::scans, kVio},
    {"map_part", Delivery::parts, {.station = true, .vio = true}},
    {"command", Delivery::reliable, kStation},
    {"ack", Delivery::reliable, kVehicle},
    {"status", Delivery::status, kVehicle},
    {"tube", Delivery::state, kVehicle},
    {"trajectory", Delivery::state, kVehicle},
    {"markers", Delivery::state, kVehicle},
    {"disturbance", Delivery::state, kVehicle},
    {"map_receipt", Delivery::parts, kVehicle},
    {"battery", Delivery::state, kVehicle},
};

/// ROS 2's one topic of diagnostics: of all robots of a domain, outside every name space.
inline constexpr const char* kDiagnostics = "rt/diagnostics";
/// ROS 2's one topic of transforms: of all robots of a domain, who differ in their frames.
inline constexpr const char* kTf = "rt/tf";

}  // namespace backwash::dds
