// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <tl/expected.hpp>

namespace backwash::log {

/// A channel of a recording.
struct McapChannel {
  std::string topic, type;  ///< of ROS 2, as sensor_msgs/msg/PointCloud2
  std::string encoding;     ///< "cdr" for ROS 2
};

/// What is done with what a file holds, in the file's order. Who is told of something says what is wrong with it, or
/// nothing. What is empty is not asked.
struct McapListener {
  std::function<std::string(const McapChannel&)> channel;
  /// `data`: the message; it lives until the call returns. `at`: byte of the file where its record begins, or its
  /// chunk where that is compressed.
  std::function<std::string(const McapChannel&, std::string_view data, std::uint64_t at)> message;
  /// The bytes of a chunk that is compressed, `size` in all, or what is wrong with it. Empty: none is read.
  std::function<tl::expected<std::string, std::string>(std::string_view compression, std::string_view packed,
                                                       std::uint64_t size)>
      unpack;
};

struct McapEnd {
  std::string wrong;     ///< what, or nothing
  std::uint64_t at = 0;  ///< byte of the file: where it is wrong, else behind the last whole record
  bool whole = false;    ///< the data ended as it should; else the file was cut short, at `at`
};

/// Goes through the records of an MCAP file (https://mcap.dev/spec) from its beginning. No index is asked, so a file
/// that was cut short gives its whole messages, of a compressed chunk none. Every checksum of what is whole is.
/// Precondition: is_mcap. Offline.
McapEnd walk_mcap(std::string_view file, const McapListener& listener);

}  // namespace backwash::log
