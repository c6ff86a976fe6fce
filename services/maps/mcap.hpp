// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <string>
#include <string_view>

namespace backwash::maps {

/// One message of a recording, whose texts are the file's.
struct Recorded {
  std::string_view topic, type;  ///< of ROS 2, as sensor_msgs/msg/PointCloud2
  std::string_view encoding;     ///< "cdr" for ROS 2
  std::string_view data;
};

/// Takes a message; says what is wrong with it, or nothing.
using Listener = std::function<std::string(const Recorded&)>;

/// Calls `listener` with all messages of an MCAP file (https://mcap.dev/spec), in the file's order, from its beginning:
/// no index is asked, and a file that was cut short gives its whole chunks. Returns what is wrong, as ": byte N: what",
/// or nothing. `cut`: what to tell of a file without its end.
std::string each_message(std::string_view file, const Listener& listener, std::string& cut);

}  // namespace backwash::maps
