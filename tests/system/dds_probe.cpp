// SPDX-License-Identifier: BSD-3-Clause
// What a confused or hostile participant sends, for the scripts beside it (docs/faults.md rows 2, 3, 12, 26 to 48).
//   dds_probe DOMAIN NAMESPACE foreign|frame|second|oversized|lying|corrupt|closure|closures|elsewhere
//   dds_probe DOMAIN NAMESPACE flood [SECONDS]
//   dds_probe DOMAIN NAMESPACE roomy [SECONDS]  a good map, once; its writer stays for so long
//   dds_probe DOMAIN NAMESPACE mapper        hands the map of the name space `bench` on; after SIGUSR1 the one writer
//                                            that the daemon listens to sends the roomy one
//   dds_probe DOMAIN NAMESPACE large BURSTS  the same, but then the largest maps and clouds
//   dds_probe DOMAIN NAMESPACE nan|jump      hands the odometry of NAMESPACE on as rt/relay/odometry; after SIGUSR1
//                                            the one writer that the daemon listens to fails
#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
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

// A command where odometry is expected; a map and a closure that are not kept for who comes later, or not repeated.
int foreign(const dds::Participant& participant, const std::string& name_space) {
  dds::Writer<dds::Command> writer(participant, dds::TopicOf<dds::Command>::type(), dds::topic(name_space, "odometry"),
                                   dds::Delivery::latest);
  const auto lesser = [&]<typename T>(T, const char* name, dds::Delivery delivery) {
    return dds::Writer<T>(participant, dds::TopicOf<T>::type(), dds::topic(name_space, name), delivery);
  };
  const auto map = lesser(dds::Octomap{}, "map", dds::Delivery::reliable);
  for (int n = 0; n < 30; ++n) {
    dds::Command command{};
    char station[] = "nobody";
    command.station = station;
    writer.write(command);
    std::this_thread::sleep_for(50ms);
  }
  const auto closure = lesser(dds::TransformStamped{}, "loop_closure", dds::Delivery::latest);  // one warning a second
  std::this_thread::sleep_for(300ms);
  return writer.matched() + map.matched() + closure.matched() == 0 ? 0 : 1;
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

volatile std::sig_atomic_t failing = 0;

// Hands odometry on as its only writer; once failing, with `broken` x between (not a number) or instead (far away).
int relay(const dds::Participant& participant, const std::string& name_space, double broken, int count) {
  std::signal(SIGUSR1, [](int) { failing = 1; });
  auto reader = dds::make_reader<dds::Odometry>(participant, name_space);
  auto writer = dds::make_writer<dds::Odometry>(participant, "relay");
  dds::WaitSet waitset(participant);
  waitset.add(reader);
  char frame[] = "map", child[] = "base_link";
  auto due = std::chrono::steady_clock::now();
  while (count > 0) {
    waitset.wait(0.005);
    reader.take([&](const dds::Odometry& m) {
      if (!failing || std::isnan(broken)) writer.write(m);
    });
    const auto now = std::chrono::steady_clock::now();
    // Not at the rate of the true odometry: of two samples in one tick the daemon sees the newer.
    if (!failing || now < due) continue;
    due = now + 17ms;
    --count;
    dds::Odometry m{};
    const auto t = now.time_since_epoch();
    m.header.stamp = {static_cast<std::int32_t>(t / 1s), static_cast<std::uint32_t>((t % 1s).count())};
    m.header.frame_id = frame;
    m.child_frame_id = child;
    m.pose.pose.position.x = broken;
    m.pose.pose.orientation.w = 1;
    writer.write(m);
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

// A good loop closure by half a metre.
int closure(const dds::Participant& participant, const std::string& name_space) {
  auto writer = dds::make_writer<dds::TransformStamped>(participant, name_space);
  until_matched(writer);
  char frame[] = "map", child[] = "odom";
  dds::TransformStamped m{};
  m.header.frame_id = frame;
  m.child_frame_id = child;
  m.transform.translation.x = 0.5;
  m.transform.rotation.w = 1;
  writer.write(m);
  std::this_thread::sleep_for(1s);
  return 0;
}

// A good map in a box of 128 x 128 x 128 voxels: of two free cubes of 6.4 m, or all of it free, which takes 90 MB.
void write_roomy(dds::Writer<dds::Octomap>& writer, std::string frame = "map", bool all_free = false) {
  std::vector<std::uint8_t> data{0x03, static_cast<std::uint8_t>(all_free ? 0 : 0xc0)};
  for (int n = 0; n < 8; ++n) data.insert(data.end(), {0x00, 0xc0});
  if (all_free) {
    data.insert(data.end(), {0x55, 0x55});
  } else {
    data.insert(data.end(), {0x00, 0x40});
    for (int n = 0; n < 8; ++n) data.insert(data.end(), {0x03, 0x00});
    data.insert(data.end(), {0x01, 0x00});
  }
  char id[] = "OcTree";
  dds::Octomap m{};
  m.header.frame_id = frame.data();
  m.id = id;
  m.binary = true;
  m.resolution = 0.1;
  const auto size = static_cast<std::uint32_t>(data.size());
  m.data = {size, size, reinterpret_cast<decltype(m.data._buffer)>(data.data()), false};
  writer.write(m);
}

int roomy(const dds::Participant& participant, const std::string& name_space, const std::string& frame, int seconds) {
  auto writer = dds::make_writer<dds::Octomap>(participant, name_space);
  until_matched(writer);
  write_roomy(writer, frame);
  std::this_thread::sleep_for(seconds * 1s);
  return 0;
}

// The map of the name space `bench`, until SIGUSR1.
void hand_map_on(const dds::Participant& participant, dds::Writer<dds::Octomap>& writer) {
  std::signal(SIGUSR1, [](int) { failing = 1; });
  auto reader = dds::make_reader<dds::Octomap>(participant, "bench");
  for (; !failing; std::this_thread::sleep_for(50ms)) reader.take([&](const dds::Octomap& m) { writer.write(m); });
}

int mapper(const dds::Participant& participant, const std::string& name_space) {
  auto writer = dds::make_writer<dds::Octomap>(participant, name_space);
  hand_map_on(participant, writer);
  write_roomy(writer, "map", true);
  std::this_thread::sleep_for(1s);
  return 0;
}

// For 3 s the largest that is allowed: maps of 40 MB at 5 Hz, clouds of 300,000 points at 10 Hz. Prints from when to
// when (s, monotonic).
void large(dds::Writer<dds::Octomap>& maps, dds::Writer<dds::PointCloud>& clouds_out) {
  char frame[] = "map", id[] = "OcTree", x[] = "x", y[] = "y", z[] = "z";
  std::vector<std::uint8_t> tree(40'000'000, 0xff);
  dds::Octomap map{};
  map.header.frame_id = frame;
  map.id = id;
  map.binary = true;
  map.resolution = 0.1;
  map.data = {40'000'000, 40'000'000, reinterpret_cast<decltype(map.data._buffer)>(tree.data()), false};
  dds::PointField fields[3] = {{x, 0, 7, 1}, {y, 4, 7, 1}, {z, 8, 7, 1}};
  std::vector<float> points(4 * 300'000);
  for (std::size_t n = 0; n < points.size(); ++n) points[n] = 0.001f * static_cast<float>(n % 1777);
  dds::PointCloud cloud{};
  cloud.header.frame_id = frame;
  cloud.fields = {3, 3, fields, false};
  cloud.height = 1;
  cloud.width = 300'000;
  cloud.point_step = 16;
  cloud.row_step = 16 * 300'000;
  cloud.data = {cloud.row_step, cloud.row_step, reinterpret_cast<std::uint8_t*>(points.data()), false};
  const auto begun = std::chrono::steady_clock::now(), end = begun + 3s;
  auto due = begun;
  for (int n = 0; due < end; ++n) {
    if (n % 2 == 0) maps.write(map);
    const auto t = std::chrono::steady_clock::now().time_since_epoch();
    cloud.header.stamp = {static_cast<std::int32_t>(t / 1s), static_cast<std::uint32_t>((t % 1s).count())};
    clouds_out.write(cloud);
    due = std::max(due + 100ms, std::chrono::steady_clock::now() - 100ms);
    std::this_thread::sleep_until(due);
  }
  const auto s = [](auto t) { return std::chrono::duration<double>(t.time_since_epoch()).count(); };
  std::printf("%.3f %.3f\n", s(begun), s(std::chrono::steady_clock::now()));
  std::fflush(stdout);
}

// Bursts with as long a silence before each: what else the machine does is then the same with and without them.
int bursts(const dds::Participant& participant, const std::string& name_space, int count) {
  auto maps = dds::make_writer<dds::Octomap>(participant, name_space);
  auto clouds_out = dds::make_writer<dds::PointCloud>(participant, name_space);
  hand_map_on(participant, maps);
  for (int n = 0; n < count; ++n) {
    std::this_thread::sleep_for(4s);  // of which what the last burst left on its way takes the first
    large(maps, clouds_out);
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4 && argc != 5) return 64;
  const dds::Participant participant(static_cast<std::uint32_t>(std::atoi(argv[1])), "lo");
  const std::string name_space = argv[2], what = argv[3];
  if (what == "foreign") return foreign(participant, name_space);
  if (what == "frame") return odometry(participant, name_space, 50, 20ms);
  if (what == "second") return odometry(participant, name_space, 50, 20ms, "map", 1);
  if (what == "flood")
    return odometry(participant, name_space, argc == 5 ? 10'000 * std::atoi(argv[4]) : 100'000, 100us);
  if (what == "nan") return relay(participant, name_space, std::nan(""), 700);
  if (what == "jump") return relay(participant, name_space, 50, 60);
  if (what == "closures") return closures(participant, name_space);
  if (what == "oversized") return clouds(participant, name_space, 400'000, 400'000);
  if (what == "lying") return clouds(participant, name_space, 1000, 1);
  if (what == "large") return bursts(participant, name_space, argc == 5 ? std::atoi(argv[4]) : 1);
  if (what == "closure") return closure(participant, name_space);
  if (what == "roomy") return roomy(participant, name_space, "map", argc == 5 ? std::atoi(argv[4]) : 1);
  if (what == "elsewhere") return roomy(participant, name_space, "odom", 1);
  if (what == "mapper") return mapper(participant, name_space);
  if (what == "corrupt") return corrupt(participant, name_space);
  return 64;
}
