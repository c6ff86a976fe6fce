// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>

#include "core/config/daemon_config.hpp"
#include "services/dds/topics.hpp"

namespace backwash::daemon {

/// Says in the daemon's log which topic its credentials do not allow, and which command makes others.
void warn_not_permitted(const std::string& topic, const decltype(config::Daemon::dds)& config);

/// Writer of what people look at and nothing flies by. Credentials may be older than its topic:
/// then that is said once, at the start, and nothing is written (docs/faults.md row 29). Answers and status are not of
/// this kind: without them no start.
template <typename T>
class ShownWriter {
 public:
  ShownWriter(const dds::Participant& participant, const dds_topic_descriptor& type, const std::string& topic,
              const decltype(config::Daemon::dds)& config, dds::Delivery delivery = dds::Delivery::state) {
    try {
      writer_.emplace(participant, type, topic, delivery);
    } catch (const dds::NotPermitted&) {
      warn_not_permitted(topic, config);
    }
  }
  ShownWriter(const dds::Participant& participant, const decltype(config::Daemon::dds)& config)
      : ShownWriter(participant, dds::TopicOf<T>::type(), dds::topic(config.name_space, dds::TopicOf<T>::kName),
                    config) {
    static_assert(dds::TopicOf<T>::kDelivery == dds::Delivery::state);
  }
  void write(const T& sample) {
    if (writer_) writer_->write(sample);
  }
  /// Readers matched now.
  int matched() const { return writer_ ? writer_->matched() : 0; }

 private:
  std::optional<dds::Writer<T>> writer_;
};

}  // namespace backwash::daemon
