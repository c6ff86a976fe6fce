// SPDX-License-Identifier: BSD-3-Clause
#include <vector>

#include "core/config/daemon_parts.hpp"
#include "core/config/ros_name.hpp"
#include "core/config/strict_table.hpp"

namespace backwash::config {
namespace {

/// Words and numbers of the file that a Daemon does not hold as they are.
struct Said {
  OdometryWords odometry;
  std::string tf = "none", method = "tight", protocol = "mavlink", signing_key_file;
  int cpu = 0;
};

/// Every key of the file.
std::vector<Key> daemon_keys(Daemon& d, Said& said) {
  using enum Key::Presence;
  // clang-format off
  return {
      {"vehicle", &d.vehicle, {}, required, "", "vehicle file or `builtin:NAME`"},
      {"model", &d.model, {}, required, "", "model file or `builtin:NAME`"},
      {"dds.domain", &d.dds.domain, {0, 230}, required, "", "as ROS_DOMAIN_ID", "that of the VIO"},
      {"dds.interface", &d.dds.interface, {}, required, "", "network interface by name, up to 15 characters; CYCLONEDDS_URI takes precedence", "`lo` unless others must reach the vehicle"},
      {"dds.namespace", &d.dds.name_space, {}, required, "", "topics are rt/NAMESPACE/…", "one for each vehicle of a domain"},
      {"dds.odometry_topic", &d.dds.odometry_topic, {}, required, "", "the VIO's odometry, whole name on the wire", "`ros2 topic list`, with rt/ before it"},
      {"dds.tf", &said.tf, {}, optional, "", "transforms to rt/tf: `none`; `map`: `frames.odometry` in `frames.map`; `vehicle`: that and `frames.body`. Not with `odometry.message = \"tf\"`", "`map` where nobody else places the estimator's frame; `vehicle` if the estimator places no body either"},
      {"dds.security", &d.dds.security, {}, optional, "", "folder of credentials: only those with a certificate of the same authority are spoken with", "`backwash keys add FOLDER NAME --role vehicle`"},
      {"link.device", &d.link.device, {}, required, "", "serial path, `udp:ADDRESS:PORT`, `udpin:ADDRESS:PORT` or `tcp:ADDRESS:PORT`, numeric IPv4"},
      {"link.baud", &d.link.baud, {9600, 4'000'000}, required, "", "of a serial port; with `link.share`, of the line behind a socket. Too slow is refused: [A slow line](#a-slow-line)", "230400 or more"},
      {"link.share", &d.link.share, {0.05, 1}, optional, "", "of that rate which is ours", "0.5 for a radio that sends and receives by turns", "0.95 of a serial port; a socket carries everything"},
      {"link.system", &d.link.system, {1, 250}, required, "", "MAVLink system id of the vehicle", "MAV_SYS_ID or SYSID_THISMAV"},
      {"link.protocol", &said.protocol, {}, optional, "", "or `plain`, on a serial port, for a controller without MAVLink (`firmware_bridge/plain/README.md`)"},
      {"link.signing_key_file", &said.signing_key_file, {}, optional, "", "key of MAVLink 2 signatures: sent frames are signed, others refused", "32 bytes or 64 hexadecimal digits, mode 0600; the same in the autopilot"},
      {"control.priority", &d.control.priority, {0, 98}, required, "", "SCHED_FIFO priority of the 50 Hz thread; 0: ordinary", "80; needs LimitRTPRIO"},
      {"control.cpu", &said.cpu, {-1, 1023}, required, "", "processor that it is bound to; −1: any", "one that isolcpus= keeps free"},
      {"control.battery_land", &d.control.battery_land, {0, 1}, required, "", "remaining share below which LAND is asked for, once; 0: never", "what the way home and a landing take"},
      {"gpio.chip", &d.gpio.chip, {}, optional, "", "GPIO chip, /dev/gpiochip0 or its label; needs at least one line below", "`gpiodetect`"},
      {"gpio.stop_switch", &d.gpio.stop_switch, {}, optional, "", "line by name: contact to ground while the vehicle may fly (`firmware_bridge/gpio/README.md`)", "`gpioinfo`"},
      {"gpio.strobe", &d.gpio.strobe, {}, optional, "", "line: another level each tick, for an external watchdog", "`gpioinfo`"},
      {"gpio.led", &d.gpio.led, {}, optional, "", "line: status LED; a flash each second: idle, steady: commanding, 5 Hz: a fault", "`gpioinfo`"},
      {"reach.method", &said.method, {}, optional, "", "clearance kept by plans, stops, places of rest and take-offs: `tight`, the worst case's, or `risk`, that of a stated risk (docs/guide.md, \"How near: the worst case, or a risk\")", "`risk` with a model that was calibrated for this vehicle"},
      {"reach.risk", &d.risk, {1e-6, 0.5}, optional, "", "of a touch, at most, in each way from the vehicle on and each minute at rest. No extended model, no integrator", "0.001", "with `risk`"},
      {"adaptation.enabled", &d.adaptation.enabled, {}, optional, "", "sets grow in flight where errors are shown to be larger than promised (docs/model.md, section 7). No extended model", "true where fans, windows or other propellers are"},
      {"adaptation.alpha", &d.adaptation.alpha, {1e-6, 0.1}, optional, "", "probability of a flight in which that is said wrongly, under 7-4"},
      {"adaptation.calmest", &d.adaptation.calmest, {0.1, 1}, optional, "", "sets shrink at rest down to this factor on Σ, class by class, after a minute of calmer air (7-12); 1: none. 1 with `map.window`, whose floor is assumed", "the lower end of the level that calibration reported"},
      {"adaptation.file", &d.adaptation.file, {}, optional, "", "keeps factors of rough air over restarts, for this vehicle and model file: another's is refused (78), a damaged one moved to FILE.damaged", "/var/lib/backwash/air.factors"},
      {"log.file", &d.log.file, {}, required, "", "raw log; a later start makes NAME-2, NAME-3 …"},
      {"log.max_mib", &d.log.max_mib, {1, 4096}, optional, "MiB", "a larger file is followed by the next number, once the mode is passive"},
      {"frames.map", &d.frames.map, {}, optional, "", "frame of maps, clouds, odometry; the three frames have three names", "header.frame_id of the mapper"},
      {"frames.odometry", &d.frames.odometry, {}, optional, "", "frame of a VIO whose loop closures come as map ← odom on loop_closure", "header.frame_id of the VIO"},
      {"frames.body", &d.frames.body, {}, optional, "", "child frame of odometry; clouds", "child_frame_id of the VIO"},
      {"odometry.profile", &said.odometry.profile, {}, optional, "", "how the estimator fills nav_msgs/Odometry: `ros`, `vins_fusion`, `fast_lio`, `openvins`, `isaac_vslam` or `custom`", "its name"},
      {"odometry.message", &said.odometry.message, {}, optional, "", "type of its messages: `odometry`, `pose` (PoseStamped), `pose_with_covariance`, `tf`; with `custom` alone", "`ros2 topic info`"},
      {"odometry.twist", &said.odometry.twist, {}, optional, "", "frame of the linear velocity, `body`, `world` or `none`; with `custom` alone. Without one slow drift of the pose goes unnoticed", "enable refuses what does not fit, after a walk", "`body`"},
      {"odometry.child", &d.odometry.child, {}, optional, "", "child_frame_id of odometry; with `custom` alone", "the estimator's messages", "`frames.body`"},
      {"odometry.rate_least", &d.odometry.timing.rate_least, {9, 500}, optional, "Hz", "slower odometry is not enabled on; below 20 Hz gaps are allowed for (docs/model.md, 4-13 to 4-15)", "`ros2 topic hz`, less its jitter", "the profile's"},
      {"odometry.latency", &d.odometry.timing.latency, {0, 0.2}, optional, "s", "from header.stamp to the quickest message's arrival", "`ros2 topic delay`; enable says it where it is 30 ms off"},
      {"odometry.sensor_x", &d.odometry.sensor_B.x(), {-5, 5}, optional, "m", "origin of what the pose is of, in the body, forward", "a ruler, from the middle of the rotors"},
      {"odometry.sensor_y", &d.odometry.sensor_B.y(), {-5, 5}, optional, "m", "to the left"},
      {"odometry.sensor_z", &d.odometry.sensor_B.z(), {-5, 5}, optional, "m", "upward"},
      {"odometry.sensor_roll", &d.odometry.sensor_turned.x(), {-3.15, 3.15}, optional, "rad", "its axes in the body: turned about x, then y, then z of the body", "as mounted; upside down: 3.14159"},
      {"odometry.sensor_pitch", &d.odometry.sensor_turned.y(), {-3.15, 3.15}, optional, "rad", "about y"},
      {"odometry.sensor_yaw", &d.odometry.sensor_turned.z(), {-3.15, 3.15}, optional, "rad", "about z"},
      {"map.live", &d.map.live, {}, optional, "", "a mapper is declared: a late map stops the flight"},
      {"map.closing_speed", &d.map.closing_speed, {0, 5}, optional, "m/s", "by which the age of a live map shrinks the trusted clearance, but not while it lifts off", "speed of what may walk in"},
      {"map.sensor_range", &d.map.sensor_range, {0.5, 100}, optional, "m", "points farther away only free the way up to there", "data sheet of the sensor"},
      {"map.max_mib", &d.map.max_mib, {1, 65536}, optional, "MiB", "largest snapshot made of a map, 115 bytes a voxel; with a window more: [A window that moves](#a-window-that-moves)", "memory that is free"},
      {"map.window.occupied", &d.map.window.occupied, {}, with_parent, "", "topic of a mapper's occupied voxels around the vehicle, PointCloud2: [A window that moves](#a-window-that-moves)", "`ros2 topic list`, with rt/ before it, as rt/rog_map/occ"},
      {"map.window.free", &d.map.window.free, {}, optional, "", "topic of its free voxels; without one the window frees nothing"},
      {"map.window.size_x", &d.map.window.size.x(), {1, 200}, with_parent, "m", "edge of the window along x, around the vehicle", "the mapper's, as ROG-Map's visualization_range"},
      {"map.window.size_y", &d.map.window.size.y(), {1, 200}, with_parent, "m", "along y"},
      {"map.window.size_z", &d.map.window.size.z(), {1, 200}, with_parent, "m", "along z"},
      {"map.window.resolution", &d.map.window.resolution, {0.02, 0.2}, with_parent, "m", "edge of its voxels; whole maps have the same", "the mapper's resolution, voxel_size, tsdf_voxel_size"},
      {"map.window.keep_voxels", &d.map.window.keep_voxels, {4096, 1e10}, optional, "", "so many voxels of what the window has said are kept, a byte each; at least those of one window", "memory that is free"},
  };
  // clang-format on
}

/// What is wrong with the names that go to the middleware, if anything.
tl::expected<void, ConfigError> check_names(const StrictTable& file, const Daemon& d) {
  constexpr std::size_t kTopic = kLongestTopic, kNamespace = kTopic - 16;  // rt/NAMESPACE/loop_closure has to fit
  const std::string rule =
      " characters: tokens of letters, digits and single '_' that begin with no digit, between '/'";
  if (!interface_name(d.dds.interface))
    return tl::unexpected(file.error("dds.interface", "needs an interface name: up to 15 letters, digits, . : - @ _"));
  if (!ros_name(d.dds.name_space, kNamespace))
    return tl::unexpected(
        file.error("dds.namespace", "needs a ROS 2 namespace, up to " + std::to_string(kNamespace) + rule));
  if (!ros_name(d.dds.odometry_topic, kTopic))
    return tl::unexpected(
        file.error("dds.odometry_topic", "needs a ROS 2 topic on the wire, up to " + std::to_string(kTopic) + rule));
  return {};
}

tl::expected<void, ConfigError> read_protocol(const StrictTable& file, const std::string& said, Daemon& d) {
  constexpr std::string_view kProtocol = "link.protocol";
  if (said != "mavlink" && said != "plain")
    return tl::unexpected(file.error(kProtocol, "needs \"mavlink\" or \"plain\""));
  if (said == "mavlink") return {};
  d.link.protocol = LinkProtocol::plain;
  if (d.link.endpoint.kind != LinkDevice::Kind::serial)
    return tl::unexpected(file.error(kProtocol, "needs a serial port as link.device"));
  if (d.link.signing_key)
    return tl::unexpected(
        file.error("link.signing_key_file", "needs protocol = \"mavlink\": the plain link has no signatures"));
  return {};
}

/// A chip and at least one of its lines, each another one, or nothing at all.
tl::expected<void, ConfigError> check_gpio(const StrictTable& file, const Daemon& d) {
  const std::pair<std::string_view, const std::string*> lines[] = {{"gpio.chip", &d.gpio.chip},
                                                                   {"gpio.stop_switch", &d.gpio.stop_switch},
                                                                   {"gpio.strobe", &d.gpio.strobe},
                                                                   {"gpio.led", &d.gpio.led}};
  std::size_t given = 0;
  for (const auto& [key, name] : lines) {
    if (name->empty()) continue;
    for (const auto& [other, taken] : lines)
      if (other == key)
        break;
      else if (*taken == *name)
        return tl::unexpected(file.error(key, "needs another value than " + std::string(other)));
    ++given;
  }
  if (given > 0 && (d.gpio.chip.empty() || given == 1))
    return tl::unexpected(file.error("gpio", "needs chip and at least one of stop_switch, strobe and led"));
  return {};
}

tl::expected<void, ConfigError> read_link(const StrictTable& file, const Said& said, Daemon& d) {
  if (!said.signing_key_file.empty()) {
    const auto key = read_key_file(said.signing_key_file);
    if (!key) return tl::unexpected(file.error("link.signing_key_file", key.error()));
    d.link.signing_key = *key;
  }
  const auto endpoint = link_device(d.link.device);
  if (!endpoint)
    return tl::unexpected(file.error(
        "link.device",
        "needs a path, or udp:, udpin: or tcp: with a numeric IPv4 address and a port, as udp:127.0.0.1:14580"));
  d.link.endpoint = *endpoint;
  return read_protocol(file, said.protocol, d);
}

/// A risk is stated where the method asks for one, and nowhere else.
tl::expected<void, ConfigError> check_risk(const StrictTable& file, const std::string& method, const Daemon& d) {
  constexpr std::string_view kMethod = "reach.method";
  if (method != "tight" && method != "risk")
    return tl::unexpected(file.error(kMethod, "needs \"tight\", the worst case, or \"risk\""));
  if ((method == "risk") != d.risk.has_value())
    return tl::unexpected(method == "risk" ? file.error(kMethod, "needs reach.risk too, as 0.001")
                                           : file.error("reach.risk", "needs reach.method = \"risk\""));
  return {};
}

tl::expected<void, ConfigError> check_window(const StrictTable& file, const Daemon& d) {
  if (!d.map.window.declared()) return {};
  if (const auto wrong = wrong_window(d.map.window, d.map.max_mib))
    return tl::unexpected(file.error(wrong->first, wrong->second));
  // Over a floor that is assumed alone the air is calmer than modelled: that says nothing of one that is there.
  if (d.adaptation.enabled && d.adaptation.calmest < 1)
    return tl::unexpected(
        file.error("adaptation.calmest", "needs 1 with map.window, which takes what it has not seen for a floor"));
  return {};
}

}  // namespace

std::string daemon_file_keys() {
  Daemon d;
  Said said;
  return markdown(daemon_keys(d, said));
}

tl::expected<Daemon, ConfigError> load_daemon(const std::string& path) {
  const auto file = StrictTable::open(path, ".daemon.toml");
  if (!file) return tl::unexpected(file.error());

  Daemon d;
  Said said;
  auto good = file->read(daemon_keys(d, said));
  if (good) good = check_names(*file, d);
  if (good) good = read_odometry(*file, said.odometry, d);
  if (good) good = read_link(*file, said, d);
  if (good) good = check_gpio(*file, d);
  if (good) good = read_frames(*file, said.tf, d);
  if (good) good = check_window(*file, d);
  if (good) good = check_risk(*file, said.method, d);
  if (!good) return tl::unexpected(good.error());
  constexpr int kAny = -1;  // of the file: no processor in particular
  if (said.cpu != kAny) d.control.cpu = said.cpu;
  return d;
}

}  // namespace backwash::config
