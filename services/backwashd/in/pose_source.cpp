// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/in/pose_source.hpp"

#include <span>
#include <string_view>
#include <type_traits>

#include "services/backwashd/text.hpp"

namespace backwash::daemon {
namespace {

template <typename T>
dds::Odometry without_twist(const T& message, const std::string& child) {
  dds::Odometry m{};
  m.header = message.header;
  m.child_frame_id = dds::c_string(child);
  return m;
}

dds::Odometry as_odometry(const dds::PoseStamped& message, const std::string& child) {
  dds::Odometry m = without_twist(message, child);
  m.pose.pose = message.pose;
  return m;
}

dds::Odometry as_odometry(const dds::PoseWithCovarianceStamped& message, const std::string& child) {
  dds::Odometry m = without_twist(message, child);
  m.pose = message.pose;
  return m;
}

dds::Odometry as_odometry(const dds::TransformStamped& message, const std::string& child) {
  dds::Odometry m = without_twist(message, child);
  const auto& t = message.transform.translation;
  m.pose.pose = {{t.x, t.y, t.z}, message.transform.rotation};
  return m;
}

std::string_view text_or_none(const char* s) { return s ? s : ""; }

}  // namespace

OurTransforms::OurTransforms(const config::Daemon& config)
    : map_(config.frames.map),
      odometry_(config.frames.odometry),
      child_(config.odometry.child.empty() ? config.frames.body : config.odometry.child) {}

void OurTransforms::take(const dds::TransformStamped& m, const dds::Guid& writer, const PoseTakers& takers) {
  const std::string_view frame = text_or_none(m.header.frame_id), child = text_or_none(m.child_frame_id);
  if (child == child_ && (frame == map_ || frame == odometry_)) {
    heard_ = true;
    return takers.odometry(as_odometry(m, child_), writer);
  }
  if (frame == map_ && child == odometry_) return takers.closure(m, writer);
  if (heard_) return;
  const auto why = [&] {
    return "the transform of '" + printable(child) + "' in '" + printable(frame) +
           "' is not the vehicle's: expected '" + child_ + "' in '" + map_ + "' or '" + odometry_ +
           "'; see odometry.child and [frames] of the configuration";
  };
  takers.other(std::ref(why));
}

PoseSource::Readers PoseSource::made(const dds::Participant& participant, const config::Daemon& config) {
  const std::string& topic = config.dds.odometry_topic;
  using enum config::PoseMessage;
  using dds::Delivery;
  switch (config.odometry.message) {
    case pose:
      return dds::Reader<dds::PoseStamped>(participant, geometry_msgs_msg_dds__PoseStamped__desc, topic,
                                           Delivery::latest);
    case pose_with_covariance:
      return dds::Reader<dds::PoseWithCovarianceStamped>(
          participant, geometry_msgs_msg_dds__PoseWithCovarianceStamped__desc, topic, Delivery::latest);
    case tf:
      return dds::Reader<dds::TfMessage>(participant, tf2_msgs_msg_dds__TFMessage__desc, topic, Delivery::tf);
    case odometry:
      break;
  }
  return dds::Reader<dds::Odometry>(participant, dds::TopicOf<dds::Odometry>::type(), topic,
                                    dds::TopicOf<dds::Odometry>::kDelivery);
}

PoseSource::PoseSource(const dds::Participant& participant, const config::Daemon& config)
    : ours_(config), readers_(made(participant, config)) {}

dds::detail::ReaderBase& PoseSource::base() {
  return std::visit([](auto& r) -> dds::detail::ReaderBase& { return r; }, readers_);
}
const dds::detail::ReaderBase& PoseSource::reader() const {
  return std::visit([](const auto& r) -> const dds::detail::ReaderBase& { return r; }, readers_);
}

void PoseSource::take(const PoseTakers& takers) {
  std::visit(
      [&]<typename T>(dds::Reader<T>& reader) {
        reader.take([&](const T& m, const dds::Guid& writer) {
          if constexpr (std::is_same_v<T, dds::TfMessage>)
            for (const auto& t : std::span(m.transforms._buffer, m.transforms._length)) ours_.take(t, writer, takers);
          else if constexpr (std::is_same_v<T, dds::Odometry>)
            takers.odometry(m, writer);
          else
            takers.odometry(as_odometry(m, ours_.child()), writer);
        });
      },
      readers_);
}

}  // namespace backwash::daemon
