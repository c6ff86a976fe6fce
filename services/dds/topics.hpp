// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <chrono>
#include <string>
#include <string_view>
#include <vector>

#include "backwash_msgs.h"
#include "ros2.h"
#include "services/dds/dds.hpp"

/// Messages by their names here, and the topic of each (idl/topics.hpp).
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

/// Which of kTopics has this name.
consteval std::size_t topic_named(std::string_view name) {
  return static_cast<std::size_t>(std::ranges::find(kTopics, name, &Topic::name) - kTopics);
}
template <const dds_topic_descriptor& descriptor, std::size_t row>
struct Typed {
  static const dds_topic_descriptor& type() { return descriptor; }
  static constexpr const char* kName = kTopics[row].name.data();  // of a literal, which ends
  static constexpr Delivery kDelivery = kTopics[row].delivery;
};

/// The topic of a type: TopicOf<Status>::kName.
template <typename T>
struct TopicOf;
template <>
struct TopicOf<Odometry> : Typed<nav_msgs_msg_dds__Odometry__desc, topic_named("odometry")> {};
template <>
struct TopicOf<Octomap> : Typed<octomap_msgs_msg_dds__Octomap__desc, topic_named("map")> {};
template <>
struct TopicOf<PointCloud> : Typed<sensor_msgs_msg_dds__PointCloud2__desc, topic_named("points")> {};
template <>
struct TopicOf<Disturbance> : Typed<sensor_msgs_msg_dds__PointCloud2__desc, topic_named("disturbance")> {};
template <>
struct TopicOf<TransformStamped> : Typed<geometry_msgs_msg_dds__TransformStamped__desc, topic_named("loop_closure")> {};
template <>
struct TopicOf<Command> : Typed<backwash_msgs_msg_dds__Command__desc, topic_named("command")> {};
template <>
struct TopicOf<Ack> : Typed<backwash_msgs_msg_dds__Ack__desc, topic_named("ack")> {};
template <>
struct TopicOf<Status> : Typed<backwash_msgs_msg_dds__Status__desc, topic_named("status")> {};
template <>
struct TopicOf<MapPart> : Typed<backwash_msgs_msg_dds__MapPart__desc, topic_named("map_part")> {};
template <>
struct TopicOf<MapReceipt> : Typed<backwash_msgs_msg_dds__MapReceipt__desc, topic_named("map_receipt")> {};
template <>
struct TopicOf<Tube> : Typed<backwash_msgs_msg_dds__ReachTube__desc, topic_named("tube")> {};
template <>
struct TopicOf<Path> : Typed<nav_msgs_msg_dds__Path__desc, topic_named("trajectory")> {};
template <>
struct TopicOf<MarkerArray> : Typed<visualization_msgs_msg_dds__MarkerArray__desc, topic_named("markers")> {};
template <>
struct TopicOf<BatteryState> : Typed<sensor_msgs_msg_dds__BatteryState__desc, topic_named("battery")> {};

/// All topics of the vehicle with this name space, and diagnostics, and `more`: for Receiving::topics.
inline std::vector<std::string> topics(const std::string& name_space, std::vector<std::string> more = {}) {
  more.push_back(kDiagnostics);
  for (const Topic& each : kTopics) more.push_back(topic(name_space, std::string(each.name)));
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
