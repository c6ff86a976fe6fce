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
  /// Whether to read on behind damage, with the next chunk that is whole. Who says that something is wrong ends it
  /// still.
  bool over_damage = false;
};

struct McapEnd {
  std::string wrong;                        ///< what, or nothing
  std::uint64_t at = 0;                     ///< byte of the file: where it is wrong, else behind the last whole record
  bool whole = false;                       ///< the data ended as it should; else the file was cut short, at `at`
  std::size_t places = 0, skipped = 0;      ///< damaged ones that were left out; bytes of them
  std::uint64_t messages = 0, counted = 0;  ///< that were read; that the file says it has, 0 where it does not
  /// What over_damage left out of a file of so many bytes, a sentence; empty: nothing.
  std::string loss(std::size_t bytes) const;
};

/// Goes through the records of an MCAP file (https://mcap.dev/spec) from its beginning. No index is asked, so a file
/// that was cut short gives its whole messages, of a compressed chunk none. Every checksum of what is whole is.
/// Precondition: is_mcap. Offline.
McapEnd walk_mcap(std::string_view file, const McapListener& listener);

}  // namespace backwash::log
