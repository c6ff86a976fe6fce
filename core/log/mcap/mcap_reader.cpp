// SPDX-License-Identifier: BSD-3-Clause
#include "core/log/mcap/mcap_reader.hpp"

#include <algorithm>
#include <string_view>

#include "core/log/mcap/mcap_walk.hpp"
#include "core/log/mcap/mcap_writer.hpp"
#include "core/log/mcap/ros_messages.hpp"

namespace backwash::log {

bool is_mcap(std::span<const std::uint8_t> bytes) noexcept {
  return bytes.size() >= kMcapMagic.size() && std::equal(kMcapMagic.begin(), kMcapMagic.end(), bytes.begin());
}

tl::expected<RawLog, LogError> raw_log_of_mcap(const std::string& path, std::span<const std::uint8_t> bytes) {
  RawLog log;
  bool told = false;
  McapListener listener;
  listener.channel = [&](const McapChannel& channel) -> std::string {
    if (channel.topic != kRawTopic) return "";
    told = true;
    return channel.encoding == "cdr" ? "" : "the channel's encoding is not cdr";
  };
  listener.message = [&](const McapChannel& channel, std::string_view data, std::uint64_t) -> std::string {
    if (channel.topic != kRawTopic) return "";
    const auto octets = ros::octets_of({reinterpret_cast<const std::uint8_t*>(data.data()), data.size()});
    const auto record = octets ? raw_record(*octets) : std::nullopt;
    if (!record || sizeof record->header + record->bytes.size() != octets->size())
      return "this message holds no record of a raw log";
    log.records.push_back(*record);
    log.records.back().offset = static_cast<std::uint64_t>(octets->data() - bytes.data());
    return "";
  };
  const auto end = walk_mcap({reinterpret_cast<const char*>(bytes.data()), bytes.size()}, listener);
  const auto wrong = [&](const std::string& what) {
    return tl::unexpected(LogError{LogError::Kind::bad_data, path + ": byte " + std::to_string(end.at) + ": " + what});
  };
  if (!end.wrong.empty()) return wrong(end.wrong);
  if (!told)
    return wrong("no channel " + std::string(kRawTopic) +
                 " before it: not a log of backwashd; of a bag the clouds are a map: "
                 "backwash map convert " +
                 path + " -o map.bt; its poses: ros2 bag play, and ros2 topic echo --csv");
  if (!end.whole && end.at < bytes.size()) log.cut_at = end.at;
  return log;
}

}  // namespace backwash::log
