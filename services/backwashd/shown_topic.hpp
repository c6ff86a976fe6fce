// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <spdlog/spdlog.h>

#include <optional>
#include <string>

#include "services/dds/topics.hpp"

namespace backwash::daemon {

/// A topic that is shown to whoever looks, and that no flight rests on. Where the credentials were made before there
/// was such a topic, it is left out and the operator is told how to get others; answers and the status are not left
/// out.
template <typename T>
class ShownTopic {
 public:
  /// Of this vehicle: rt/NAMESPACE/…, by the type.
  ShownTopic(const dds::Participant& participant, const std::string& name_space)
      : ShownTopic(participant, name_space, dds::TopicOf<T>::type(), dds::topic(name_space, dds::TopicOf<T>::kName),
                   dds::TopicOf<T>::kDelivery) {}
  /// Of any name. `name_space`: the vehicle's. Throws dds::Error.
  ShownTopic(const dds::Participant& participant, const std::string& name_space, const dds_topic_descriptor& type,
             const std::string& topic, dds::Delivery delivery) {
    try {
      writer_.emplace(participant, type, topic, delivery);
    } catch (const dds::NotPermitted&) {
      spdlog::warn(
          "{} is not sent: the permissions in dds.security do not allow it, they may be older than this version; new "
          "ones: backwash keys add FOLDER NAME --role vehicle --namespace {} --force",
          topic, name_space);
    }
  }
  int matched() const { return writer_ ? writer_->matched() : 0; }
  void write(const T& sample) {
    if (writer_) writer_->write(sample);
  }

 private:
  std::optional<dds::Writer<T>> writer_;
};

}  // namespace backwash::daemon
