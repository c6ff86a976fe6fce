// SPDX-License-Identifier: BSD-3-Clause
#include "core/log/mcap/topic_log.hpp"

#include "core/log/raw/log_file.hpp"

namespace backwash::log {

const TopicLog::Topic* TopicLog::find(const std::string& name, unsigned instance) const {
  for (const auto& topic : topics)
    if (topic.name == name && topic.instance == instance && !topic.t_s.empty()) return &topic;
  return nullptr;
}

tl::expected<FlightLog, LogError> read_topics(
    const std::string& path, const std::string& wanted,
    tl::expected<TopicLog, std::string> (*decode)(std::span<const std::uint8_t> bytes)) {
  const auto content = read_log_file(path, files::kLargestTable, wanted);
  if (!content) return tl::make_unexpected(content.error());
  const std::span bytes(reinterpret_cast<const std::uint8_t*>(content->data()), content->size());
  const auto topics = decode(bytes);
  auto log = topics ? flight_of(*topics) : tl::make_unexpected(topics.error());
  if (!log) return tl::make_unexpected(LogError{LogError::Kind::bad_data, path + ":1: " + log.error()});
  return std::move(*log);
}

}  // namespace backwash::log
