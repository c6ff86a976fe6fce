// SPDX-License-Identifier: BSD-3-Clause
// What a confused or hostile participant sends, for tests/system/daemon_dds.sh (faults.md rows 2, 3, 12, 26, 27).
//   dds_probe DOMAIN NAMESPACE foreign|frame|oversized|lying|corrupt|flood|closures|large|nan|jump
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <thread>
#include <vector>

#include "services/dds/topics.hpp"

namespace dds = backwash::dds;
using namespace std::chrono_literals;

namespace {

template <typename Writer>
void until_matched(const Writer& writer) {
  for (int n = 0; n < 500 && writer.matched() == 0; ++n) std::this_thread::sleep_for(10ms);
}

// A command where odometry is expected.
int foreign(const dds::Participant& participant, const std::string& name_space) {
  dds::Writer<dds::Command> writer(participant, dds::TopicOf<dds::Command>::type(), dds::topic(name_space, "odometry"),
                                   dds::Delivery::latest);
  for (int n = 0; n < 20; ++n) {
    dds::Command command{};
    char station[] = "nobody";
    command.station = station;
    writer.write(command);
    std::this_thread::sleep_for(50ms);
  }
  return writer.matched() == 0 ? 0 : 1;
}

// The pose at `x` of this frame, again and again.
int odometry(const dds::Participant& participant, const std::string& name_space, int count,
             std::chrono::microseconds pause, std::string frame = "somewhere", double x = 0) {
  auto writer = dds::make_writer<dds::Odometry>(participant, name_space);
  until_matched(writer);
  char child[] = "base_link";
  dds::Odometry m{};
  m.header.frame_id = frame.data();
  m.child_frame_id = child;
  m.pose.pose.position.x = x;
  m.pose.pose.orientation.w = 1;
  auto due = std::chrono::steady_clock::now();
  for (int n = 0; n < count; ++n) {
    writer.write(m);
    due += pause;
    std::this_thread::sleep_until(due);
  }
  return 0;
}

// Clouds of `count` points of which the first `held` are there.
int clouds(const dds::Participant& participant, const std::string& name_space, std::uint32_t count,
           std::uint32_t held) {
  auto writer = dds::make_writer<dds::PointCloud>(participant, name_space);
  until_matched(writer);
  char frame[] = "map", x[] = "x", y[] = "y", z[] = "z";
  dds::PointField fields[3] = {{x, 0, 7, 1}, {y, 4, 7, 1}, {z, 8, 7, 1}};
  std::vector<std::uint8_t> data(held * 12);
  dds::PointCloud m{};
  m.header.frame_id = frame;
  m.fields = {3, 3, fields, false};
  m.height = 1;
  m.width = count;
  m.point_step = 12;
  m.row_step = count * 12;
  m.data = {held * 12, held * 12, data.data(), false};
  // Several times: best effort may lose a fragment of 4.8 MB.
  for (int n = 0; n < 5; ++n) {
    writer.write(m);
    std::this_thread::sleep_for(200ms);
  }
  return 0;
}

// Loop closures of frames that nobody has, with names that steer terminals, at 1 kHz.
int closures(const dds::Participant& participant, const std::string& name_space) {
  auto writer = dds::make_writer<dds::TransformStamped>(participant, name_space);
  until_matched(writer);
  char child[] = "body";
  auto due = std::chrono::steady_clock::now();
  for (int n = 0; n < 4000; ++n) {
    std::string frame = "\n\x1b[2J" + std::string(1, static_cast<char>('a' + n % 26)) + std::string(200, '!');
    dds::TransformStamped m{};
    m.header.frame_id = frame.data();
    m.child_frame_id = child;
    m.transform.rotation.w = 1;
    writer.write(m);
    due += 1ms;
    std::this_thread::sleep_until(due);
  }
  return 0;
}

int corrupt(const dds::Participant& participant, const std::string& name_space) {
  auto writer = dds::make_writer<dds::Octomap>(participant, name_space);
  until_matched(writer);
  char frame[] = "map", id[] = "OcTree";
  // Half a tree, then two leaves at opposite corners of 2^48 voxels.
  for (const auto& bytes : {std::vector<std::uint8_t>{0x03, 0x00, 0x03}, std::vector<std::uint8_t>{0x01, 0x40}}) {
    auto data = bytes;
    dds::Octomap m{};
    m.header.frame_id = frame;
    m.id = id;
    m.binary = true;
    m.resolution = 0.1;
    const auto size = static_cast<std::uint32_t>(data.size());
    m.data = {size, size, reinterpret_cast<decltype(m.data._buffer)>(data.data()), false};
    writer.write(m);
    std::this_thread::sleep_for(500ms);
  }
  return 0;
}

// A good map of two free cubes of 6.4 m: a box of 128 x 128 x 128 voxels, whose snapshot needs 240 MB.
int large_map(const dds::Participant& participant, const std::string& name_space) {
  auto writer = dds::make_writer<dds::Octomap>(participant, name_space);
  until_matched(writer);
  std::vector<std::uint8_t> data{0x03, 0xc0};
  for (int n = 0; n < 8; ++n) data.insert(data.end(), {0x00, 0xc0});
  data.insert(data.end(), {0x00, 0x40});
  for (int n = 0; n < 8; ++n) data.insert(data.end(), {0x03, 0x00});
  data.insert(data.end(), {0x01, 0x00});
  char frame[] = "map", id[] = "OcTree";
  dds::Octomap m{};
  m.header.frame_id = frame;
  m.id = id;
  m.binary = true;
  m.resolution = 0.1;
  const auto size = static_cast<std::uint32_t>(data.size());
  m.data = {size, size, reinterpret_cast<decltype(m.data._buffer)>(data.data()), false};
  writer.write(m);
  std::this_thread::sleep_for(1s);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) return 64;
  const dds::Participant participant(static_cast<std::uint32_t>(std::atoi(argv[1])), "lo");
  const std::string name_space = argv[2], what = argv[3];
  if (what == "foreign") return foreign(participant, name_space);
  if (what == "frame") return odometry(participant, name_space, 50, 20ms);
  if (what == "flood") return odometry(participant, name_space, 100'000, 100us);
  // Not at the rate of the true odometry: of two samples in one tick the daemon sees the newer.
  if (what == "closures") return closures(participant, name_space);
  if (what == "large") return large_map(participant, name_space);
  if (what == "nan") return odometry(participant, name_space, 700, 17ms, "map", std::nan(""));
  if (what == "jump") return odometry(participant, name_space, 60, 17ms, "map", 50);
  if (what == "oversized") return clouds(participant, name_space, 400'000, 400'000);
  if (what == "lying") return clouds(participant, name_space, 1000, 1);
  if (what == "corrupt") return corrupt(participant, name_space);
  return 64;
}
