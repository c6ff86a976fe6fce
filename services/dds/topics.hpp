// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <string>
#include <vector>

#include "backwash_msgs.h"
#include "ros2.h"
#include "services/dds/dds.hpp"

/// The topics of docs/interfaces.md: name, type and delivery in one place.
namespace backwash::dds {

using Odometry = nav_msgs_msg_dds__Odometry_;
using Path = nav_msgs_msg_dds__Path_;
using PoseStamped = geometry_msgs_msg_dds__PoseStamped_;
using PoseWithCovarianceStamped = geometry_msgs_msg_dds__PoseWithCovarianceStamped_;
using TfMessage = tf2_msgs_msg_dds__TFMessage_;
using PointCloud = sensor_msgs_msg_dds__PointCloud2_;
struct Disturbance : PointCloud {};  ///< another topic than that of the scans
using PointField = sensor_msgs_msg_dds__PointField_;
using TransformStamped = geometry_msgs_msg_dds__TransformStamped_;
using Octomap = octomap_msgs_msg_dds__Octomap_;
using Marker = visualization_msgs_msg_dds__Marker_;
using MarkerArray = visualization_msgs_msg_dds__MarkerArray_;
using KeyValue = diagnostic_msgs_msg_dds__KeyValue_;
using DiagnosticStatus = diagnostic_msgs_msg_dds__DiagnosticStatus_;
using DiagnosticArray = diagnostic_msgs_msg_dds__DiagnosticArray_;
using BatteryState = sensor_msgs_msg_dds__BatteryState_;
using Command = backwash_msgs_msg_dds__Command_;
using Ack = backwash_msgs_msg_dds__Ack_;
using Status = backwash_msgs_msg_dds__Status_;
using Parameter = backwash_msgs_msg_dds__Parameter_;
using Advice = backwash_msgs_msg_dds__Advice_;
using Timing = backwash_msgs_msg_dds__Timing_;
using MapPart = backwash_msgs_msg_dds__MapPart_;
using MapReceipt = backwash_msgs_msg_dds__MapReceipt_;
using Tube = backwash_msgs_msg_dds__ReachTube_;
using TubeStep = backwash_msgs_msg_dds__ReachStep_;

/// Names of a status's advice that are no parameters: some that are not known yet; arming would be refused.
inline constexpr const char *kAsking = "parameters", *kArming = "arming";

/// Topic `name` of the vehicle with this name space, as ROS 2 spells it on the wire: rt/NAMESPACE/NAME.
inline std::string topic(const std::string& name_space, const std::string& name) {
  return "rt/" + name_space + "/" + name;
}

/// A stamp in nanoseconds.
inline std::int64_t nanoseconds(const builtin_interfaces_msg_dds__Time_& t) {
  return std::int64_t{t.sec} * 1'000'000'000 + t.nanosec;
}

/// Now, as ROS 2 stamps messages.
inline builtin_interfaces_msg_dds__Time_ wall_clock() {
  const auto since = std::chrono::system_clock::now().time_since_epoch();
  const auto s = std::chrono::duration_cast<std::chrono::seconds>(since);
  return {static_cast<std::int32_t>(s.count()),
          static_cast<std::uint32_t>(std::chrono::duration_cast<std::chrono::nanoseconds>(since - s).count())};
}

template <typename T>
struct TopicOf;
template <>
struct TopicOf<Odometry> {
  static const dds_topic_descriptor& type() { return nav_msgs_msg_dds__Odometry__desc; }
  static constexpr const char* kName = "odometry";
  static constexpr Delivery kDelivery = Delivery::latest;
};
template <>
struct TopicOf<Octomap> {
  static const dds_topic_descriptor& type() { return octomap_msgs_msg_dds__Octomap__desc; }
  static constexpr const char* kName = "map";
  static constexpr Delivery kDelivery = Delivery::state;
};
template <>
struct TopicOf<PointCloud> {
  static const dds_topic_descriptor& type() { return sensor_msgs_msg_dds__PointCloud2__desc; }
  static constexpr const char* kName = "points";
  static constexpr Delivery kDelivery = Delivery::scans;
};
template <>
struct TopicOf<Disturbance> {
  static const dds_topic_descriptor& type() { return sensor_msgs_msg_dds__PointCloud2__desc; }
  static constexpr const char* kName = "disturbance";
  static constexpr Delivery kDelivery = Delivery::state;
};
template <>
struct TopicOf<TransformStamped> {
  static const dds_topic_descriptor& type() { return geometry_msgs_msg_dds__TransformStamped__desc; }
  static constexpr const char* kName = "loop_closure";
  static constexpr Delivery kDelivery = Delivery::state;
};
template <>
struct TopicOf<Command> {
  static const dds_topic_descriptor& type() { return backwash_msgs_msg_dds__Command__desc; }
  static constexpr const char* kName = "command";
  static constexpr Delivery kDelivery = Delivery::reliable;
};
template <>
struct TopicOf<Ack> {
  static const dds_topic_descriptor& type() { return backwash_msgs_msg_dds__Ack__desc; }
  static constexpr const char* kName = "ack";
  static constexpr Delivery kDelivery = Delivery::reliable;
};
template <>
struct TopicOf<Status> {
  static const dds_topic_descriptor& type() { return backwash_msgs_msg_dds__Status__desc; }
  static constexpr const char* kName = "status";
  static constexpr Delivery kDelivery = Delivery::status;
};
template <>
struct TopicOf<MapPart> {
  static const dds_topic_descriptor& type() { return backwash_msgs_msg_dds__MapPart__desc; }
  static constexpr const char* kName = "map_part";
  static constexpr Delivery kDelivery = Delivery::parts;
};
template <>
struct TopicOf<MapReceipt> {
  static const dds_topic_descriptor& type() { return backwash_msgs_msg_dds__MapReceipt__desc; }
  static constexpr const char* kName = "map_receipt";
  static constexpr Delivery kDelivery = Delivery::parts;
};
template <>
struct TopicOf<Tube> {
  static const dds_topic_descriptor& type() { return backwash_msgs_msg_dds__ReachTube__desc; }
  static constexpr const char* kName = "tube";
  static constexpr Delivery kDelivery = Delivery::state;
};
template <>
struct TopicOf<Path> {
  static const dds_topic_descriptor& type() { return nav_msgs_msg_dds__Path__desc; }
  static constexpr const char* kName = "trajectory";
  static constexpr Delivery kDelivery = Delivery::state;
};

template <>
struct TopicOf<MarkerArray> {
  static const dds_topic_descriptor& type() { return visualization_msgs_msg_dds__MarkerArray__desc; }
  static constexpr const char* kName = "markers";
  static constexpr Delivery kDelivery = Delivery::state;
};
template <>
struct TopicOf<BatteryState> {
  static const dds_topic_descriptor& type() { return sensor_msgs_msg_dds__BatteryState__desc; }
  static constexpr const char* kName = "battery";
  static constexpr Delivery kDelivery = Delivery::state;
};

/// ROS 2's one topic of diagnostics: of all robots of a domain, outside every name space.
constexpr const char* kDiagnostics = "rt/diagnostics";
/// ROS 2's one topic of transforms: of all robots of a domain, who differ in their frames.
constexpr const char* kTf = "rt/tf";

/// All topics of the vehicle with this name space, and diagnostics, and `more`: for Receiving::topics.
inline std::vector<std::string> topics(const std::string& name_space, std::vector<std::string> more = {}) {
  more.push_back(kDiagnostics);
  const auto add = [&]<typename... T>(TopicOf<T>...) { (more.push_back(topic(name_space, TopicOf<T>::kName)), ...); };
  add(TopicOf<Odometry>(), TopicOf<Octomap>(), TopicOf<PointCloud>(), TopicOf<Disturbance>(),
      TopicOf<TransformStamped>(), TopicOf<Command>(), TopicOf<Ack>(), TopicOf<Status>(), TopicOf<MapPart>(),
      TopicOf<MapReceipt>(), TopicOf<Tube>(), TopicOf<Path>(), TopicOf<MarkerArray>(), TopicOf<BatteryState>());
  return more;
}

template <typename T>
Reader<T> make_reader(const Participant& participant, const std::string& name_space) {
  return {participant, TopicOf<T>::type(), topic(name_space, TopicOf<T>::kName), TopicOf<T>::kDelivery};
}
template <typename T>
Writer<T> make_writer(const Participant& participant, const std::string& name_space) {
  return {participant, TopicOf<T>::type(), topic(name_space, TopicOf<T>::kName), TopicOf<T>::kDelivery};
}

}  // namespace backwash::dds
