// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <string>
#include <variant>
#include <vector>

#include "core/config/daemon_config.hpp"
#include "services/dds/topics.hpp"

namespace backwash::daemon {

/// What the messages of a topic of poses say; their strings live until the call returns.
struct PoseTakers {
  /// Makes one line; only if it is said.
  using Why = std::function<std::string()>;
  std::function<void(const dds::Odometry&, const dds::Guid& writer)> odometry;
  /// Of a TFMessage: frames.map ← frames.odometry, by any writer.
  std::function<void(const dds::TransformStamped&, const dds::Guid& writer)> closure;
  /// Of a TFMessage, until the vehicle's first pose: what it holds instead, and which would be right.
  std::function<void(const Why&)> other;
};

/// Which of all transforms on /tf are ours: that of the vehicle in one of the two frames that it is flown in, and that
/// of one of these in the other. The same vehicle in a third frame is another's, and no check of ours sees it. Pure.
class OurTransforms {
 public:
  explicit OurTransforms(const config::Daemon& config);
  void take(const dds::TransformStamped& message, const dds::Guid& writer, const PoseTakers& takers);
  /// Child frame of the vehicle's poses.
  const std::string& child() const noexcept { return child_; }

 private:
  std::string map_, odometry_, child_;  // frames
  bool heard_ = false;                  ///< the vehicle's transform was among them
};

/// The topic that the vehicle's poses come on, in messages of the type odometry.message. Each is handed on as the
/// nav_msgs/Odometry that says the same: with no twist, the child frame that the configuration names, and, where the
/// message has none, a covariance of zeros, which is not known. Used by the reader thread alone.
class PoseSource {
 public:
  /// Throws dds::Error.
  PoseSource(const dds::Participant& participant, const config::Daemon& config);
  /// Every message since the last call.
  void take(const PoseTakers& takers);
  std::vector<dds::Guid> departed() { return base().departed(); }
  const dds::detail::ReaderBase& reader() const;

 private:
  using Readers = std::variant<dds::Reader<dds::Odometry>, dds::Reader<dds::PoseStamped>,
                               dds::Reader<dds::PoseWithCovarianceStamped>, dds::Reader<dds::TfMessage>>;
  static Readers made(const dds::Participant& participant, const config::Daemon& config);
  dds::detail::ReaderBase& base();

  OurTransforms ours_;
  Readers readers_;
};

}  // namespace backwash::daemon
