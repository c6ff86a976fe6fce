// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <string>
#include <variant>
#include <vector>

#include "core/config/daemon_config.hpp"
#include "services/dds/topics.hpp"

namespace backwash::daemon {

/// The topic that the vehicle's poses come on, in messages of the type odometry.message. Each is handed on as the
/// nav_msgs/Odometry that says the same: with no twist, the child frame that the configuration names, and, where the
/// message has none, a covariance of zeros, which is not known. Used by the reader thread alone.
class PoseSource {
 public:
  /// What the messages say; their strings live until the call returns.
  struct Takers {
    std::function<void(const dds::Odometry&, const dds::Guid& writer)> odometry;
    /// Of a TFMessage: frames.map ← frames.odometry, by any writer.
    std::function<void(const dds::TransformStamped&, const dds::Guid& writer)> closure;
    /// Of a TFMessage, until the vehicle's first pose: what it holds instead, and which would be right.
    std::function<void(const std::string& why)> other;
  };

  /// Throws dds::Error.
  PoseSource(const dds::Participant& participant, const config::Daemon& config);
  /// Every message since the last call.
  void take(const Takers& takers);
  std::vector<dds::Guid> departed() { return base().departed(); }
  const dds::detail::ReaderBase& reader() const;

 private:
  using Readers = std::variant<dds::Reader<dds::Odometry>, dds::Reader<dds::PoseStamped>,
                               dds::Reader<dds::PoseWithCovarianceStamped>, dds::Reader<dds::TfMessage>>;
  static Readers made(const dds::Participant& participant, const config::Daemon& config);
  dds::detail::ReaderBase& base();
  void take_transform(const dds::TransformStamped& message, const dds::Guid& writer, const Takers& takers);

  std::string map_, odometry_, child_;  // frames
  bool heard_ = false;                  ///< the vehicle's transform was among them
  Readers readers_;
};

}  // namespace backwash::daemon
