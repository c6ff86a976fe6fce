// SPDX-License-Identifier: BSD-3-Clause
#include "core/log/mcap/topic_log.hpp"

#include <algorithm>
#include <cmath>

#include "core/log/raw/log_file.hpp"

namespace backwash::log {
namespace {

/// Which of these belong to a longest sequence that never falls.
std::vector<char> never_falling(const std::vector<double>& t) {
  std::vector<std::size_t> ends, before(t.size());  // of sequences of each length, the last of the one that ends lowest
  for (std::size_t k = 0; k < t.size(); ++k) {
    const auto place = std::ranges::upper_bound(ends, t[k], {}, [&](std::size_t e) { return t[e]; });
    before[k] = place == ends.begin() ? t.size() : *(place - 1);
    place == ends.end() ? ends.push_back(k) : void(*place = k);
  }
  std::vector<char> keep(t.size(), 0);
  for (std::size_t k = ends.empty() ? t.size() : ends.back(); k < t.size(); k = before[k]) keep[k] = 1;
  return keep;
}

}  // namespace

void TopicLog::drop_misplaced() {
  for (auto& topic : topics) {
    if (std::ranges::is_sorted(topic.t_s)) continue;
    const auto keep = never_falling(topic.t_s);
    const auto take_out = [&](std::vector<double>& rows) {
      std::size_t k = 0;
      std::erase_if(rows, [&](double) { return keep[k++] == 0; });
    };
    for (auto& [name, rows] : topic.columns) {
      rows.resize(keep.size(), std::nan(""));
      take_out(rows);
    }
    take_out(topic.t_s);
    loss.misplace(static_cast<std::size_t>(std::ranges::count(keep, 0)));
  }
}

const TopicLog::Topic* TopicLog::find(const std::string& name, unsigned instance) const {
  for (const auto& topic : topics)
    if (topic.name == name && topic.instance == instance && !topic.t_s.empty()) return &topic;
  return nullptr;
}

tl::expected<std::string, LogError> read_topic_file(const std::string& path, const std::string& wanted) {
  return read_log_file(path, files::kLargestTable, wanted)
      .and_then([&](std::string content) -> tl::expected<std::string, LogError> {
        auto plain = files::unzipped(std::move(content), files::kLargestTable);
        if (!plain) return tl::make_unexpected(LogError{LogError::Kind::bad_data, path + ":1: " + plain.error()});
        return std::move(*plain);
      });
}

tl::expected<FlightLog, LogError> read_topics(
    const std::string& path, const std::string& wanted,
    tl::expected<TopicLog, std::string> (*decode)(std::span<const std::uint8_t> bytes)) {
  const auto content = read_topic_file(path, wanted);
  if (!content) return tl::make_unexpected(content.error());
  const std::span bytes(reinterpret_cast<const std::uint8_t*>(content->data()), content->size());
  const auto topics = decode(bytes);
  auto log = topics ? flight_of(*topics) : tl::make_unexpected(topics.error());
  if (!log) return tl::make_unexpected(LogError{LogError::Kind::bad_data, path + ":1: " + log.error()});
  return std::move(*log);
}

}  // namespace backwash::log
