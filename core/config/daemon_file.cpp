// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <iterator>
#include <tuple>

#include "core/config/daemon_parts.hpp"
#include "core/config/ros_name.hpp"
#include "core/config/strict_table.hpp"

namespace backwash::config {
namespace {

constexpr std::string_view kLive = "map.live";
constexpr std::string_view kWindow[] = {"map.window.occupied", "map.window.free"};
constexpr std::string_view kProtocol = "link.protocol";
constexpr std::string_view kShare = "link.share";
constexpr std::string_view kSigningKeyFile = "link.signing_key_file";
constexpr std::string_view kReach[] = {"reach.method"};
constexpr std::string_view kAdaptation[] = {"adaptation.enabled", "adaptation.file"};
constexpr std::string_view kGpio[] = {"gpio.chip", "gpio.stop_switch", "gpio.strobe", "gpio.led"};

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

tl::expected<void, ConfigError> read_protocol(const StrictTable& file, Daemon& d) {
  if (!file.has(kProtocol)) return {};
  const auto protocol = file.text(kProtocol);
  if (!protocol) return tl::unexpected(protocol.error());
  if (*protocol != "mavlink" && *protocol != "plain")
    return tl::unexpected(file.error(kProtocol, "needs \"mavlink\" or \"plain\""));
  if (*protocol == "mavlink") return {};
  d.link.protocol = LinkProtocol::plain;
  if (d.link.endpoint.kind != LinkDevice::Kind::serial)
    return tl::unexpected(file.error(kProtocol, "needs a serial port as link.device"));
  if (d.link.signing_key)
    return tl::unexpected(
        file.error(kSigningKeyFile, "needs protocol = \"mavlink\": the plain link has no signatures"));
  return {};
}

tl::expected<void, ConfigError> read_signing_key(const StrictTable& file, Daemon& d) {
  if (!file.has(kSigningKeyFile)) return {};
  const auto path = file.text(kSigningKeyFile);
  if (!path) return tl::unexpected(path.error());
  const auto key = read_key_file(*path);
  if (!key) return tl::unexpected(file.error(kSigningKeyFile, key.error()));
  d.link.signing_key = *key;
  return {};
}

/// A chip and at least one of its lines, or nothing at all.
tl::expected<void, ConfigError> read_gpio(const StrictTable& file, Daemon& d) {
  const std::pair<std::string_view, std::string*> lines[] = {
      {kGpio[0], &d.gpio.chip}, {kGpio[1], &d.gpio.stop_switch}, {kGpio[2], &d.gpio.strobe}, {kGpio[3], &d.gpio.led}};
  std::size_t given = 0;
  for (const auto& [key, target] : lines) {
    if (!file.has(key)) continue;
    auto text = file.text(key);
    if (!text) return tl::unexpected(text.error());
    for (const auto& [other, taken] : lines)
      if (*taken == *text) return tl::unexpected(file.error(key, "needs another value than " + std::string(other)));
    *target = std::move(*text);
    ++given;
  }
  if (given > 0 && (d.gpio.chip.empty() || given == 1))
    return tl::unexpected(file.error("gpio", "needs chip and at least one of stop_switch, strobe and led"));
  return {};
}

tl::expected<void, ConfigError> read_link(const StrictTable& file, Daemon& d) {
  if (auto good = read_signing_key(file, d); !good) return good;
  const auto endpoint = link_device(d.link.device);
  if (!endpoint)
    return tl::unexpected(file.error(
        "link.device",
        "needs a path, or udp:, udpin: or tcp: with a numeric IPv4 address and a port, as udp:127.0.0.1:14580"));
  d.link.endpoint = *endpoint;
  return read_protocol(file, d);
}

/// A risk is stated where the method asks for one, and nowhere else.
tl::expected<void, ConfigError> read_risk(const StrictTable& file, double risk, Daemon& d) {
  std::string method = "tight";
  const TextKey own[] = {{kReach[0], &method}};
  if (auto read = read_texts(file, own, false); !read) return read;
  if (method != "tight" && method != "risk")
    return tl::unexpected(file.error(kReach[0], "needs \"tight\", the worst case, or \"risk\""));
  if ((method == "risk") != file.has("reach.risk"))
    return tl::unexpected(method == "risk" ? file.error(kReach[0], "needs reach.risk too, as 0.001")
                                           : file.error("reach.risk", "needs reach.method = \"risk\""));
  if (method == "risk") d.risk = risk;
  return {};
}

/// A window is declared by its table.
tl::expected<void, ConfigError> read_window(const StrictTable& file, Daemon& d) {
  if (!file.has("map.window")) return {};
  const TextKey occupied[] = {{kWindow[0], &d.map.window.occupied}}, free[] = {{kWindow[1], &d.map.window.free}};
  if (auto read = read_texts(file, occupied, true); !read) return read;
  if (auto read = read_texts(file, free, false); !read) return read;
  if (const auto wrong = wrong_window(d.map.window, d.map.max_mib))
    return tl::unexpected(file.error(wrong->first, wrong->second));
  return {};
}

tl::expected<void, ConfigError> read_flags(const StrictTable& file, Daemon& d) {
  const std::pair<std::string_view, bool*> flags[] = {{kLive, &d.map.live}, {kAdaptation[0], &d.adaptation.enabled}};
  for (const auto& [key, target] : flags) {
    if (!file.has(key)) continue;
    const auto flag = file.flag(key);
    if (!flag) return tl::unexpected(flag.error());
    *target = *flag;
  }
  // Over a floor that is assumed alone the air is calmer than modelled: that says nothing of one that is there.
  if (d.adaptation.enabled && d.adaptation.calmest < 1 && d.map.window.declared())
    return tl::unexpected(
        file.error("adaptation.calmest", "needs 1 with map.window, which takes what it has not seen for a floor"));
  return {};
}

/// Numbers of the file that a Daemon does not hold as they are.
struct Converted {
  double domain = 0, baud = 0, share = 0, system = 0, priority = 0, cpu = 0, risk = 0;
};

/// Every number of the file; no keys but theirs and `others`.
tl::expected<void, ConfigError> read_numbers(const StrictTable& file, std::span<const std::string_view> others,
                                             Daemon& d, Converted& c) {
  constexpr auto kOptional = NumberKey::Presence::optional, kWithTable = NumberKey::Presence::with_parent;
  const NumberKey numbers[] = {
      {"dds.domain", &c.domain, {0, 230}},
      {"link.baud", &c.baud, {9600, 4'000'000}},
      {kShare, &c.share, {0.05, 1}, kOptional},
      {"link.system", &c.system, {1, 250}},
      {"control.priority", &c.priority, {0, 98}},
      {"map.closing_speed", &d.map.closing_speed, {0, 5}, kOptional},
      {"map.sensor_range", &d.map.sensor_range, {0.5, 100}, kOptional},
      {"map.max_mib", &d.map.max_mib, {1, 65536}, kOptional},
      {"map.window.size_x", &d.map.window.size.x(), {1, 200}, kWithTable},
      {"map.window.size_y", &d.map.window.size.y(), {1, 200}, kWithTable},
      {"map.window.size_z", &d.map.window.size.z(), {1, 200}, kWithTable},
      {"map.window.resolution", &d.map.window.resolution, {0.02, 0.2}, kWithTable},
      {"map.window.keep_voxels", &d.map.window.keep_voxels, {4096, 1e10}, kOptional},
      {"log.max_mib", &d.log.max_mib, {1, 4096}, kOptional},
      {"odometry.sensor_x", &d.odometry.sensor_B.x(), {-5, 5}, kOptional},
      {"odometry.sensor_y", &d.odometry.sensor_B.y(), {-5, 5}, kOptional},
      {"odometry.sensor_z", &d.odometry.sensor_B.z(), {-5, 5}, kOptional},
      {"odometry.sensor_roll", &d.odometry.sensor_turned.x(), {-3.15, 3.15}, kOptional},
      {"odometry.sensor_pitch", &d.odometry.sensor_turned.y(), {-3.15, 3.15}, kOptional},
      {"odometry.sensor_yaw", &d.odometry.sensor_turned.z(), {-3.15, 3.15}, kOptional},
      {kRateLeast, &d.odometry.timing.rate_least, {9, 500}, kOptional},
      {"odometry.latency", &d.odometry.timing.latency, {0, 0.2}, kOptional},
      {"reach.risk", &c.risk, {1e-6, 0.5}, kOptional},
      {"adaptation.alpha", &d.adaptation.alpha, {1e-6, 0.1}, kOptional},
      {"adaptation.calmest", &d.adaptation.calmest, {0.1, 1}, kOptional},
      {"control.cpu", &c.cpu, {-1, 1023}},
      {"control.battery_land", &d.control.battery_land, {0, 1}},
  };
  return file.read(numbers, others);
}

tl::expected<void, ConfigError> convert(const StrictTable& file, const Converted& c, Daemon& d) {
  if (file.has(kShare)) d.link.share = c.share;
  constexpr int kAny = -1;  // of the file: no processor in particular
  int cpu = kAny;
  const std::tuple<std::string_view, double, int*> whole[] = {{"dds.domain", c.domain, &d.dds.domain},
                                                              {"link.baud", c.baud, &d.link.baud},
                                                              {"link.system", c.system, &d.link.system},
                                                              {"control.priority", c.priority, &d.control.priority},
                                                              {"control.cpu", c.cpu, &cpu}};
  for (const auto& [key, value, target] : whole) {
    if (value != static_cast<int>(value)) return tl::unexpected(file.error(key, "needs a whole number"));
    *target = static_cast<int>(value);
  }
  if (cpu != kAny) d.control.cpu = cpu;
  return {};
}

}  // namespace

tl::expected<Daemon, ConfigError> load_daemon(const std::string& path) {
  const auto file = StrictTable::open(path, ".daemon.toml");
  if (!file) return tl::unexpected(file.error());

  Daemon d;
  Converted converted;
  const TextKey texts[] = {
      {"vehicle", &d.vehicle},
      {"model", &d.model},
      {"dds.interface", &d.dds.interface},
      {"dds.namespace", &d.dds.name_space},
      {"dds.odometry_topic", &d.dds.odometry_topic},
      {"link.device", &d.link.device},
      {"log.file", &d.log.file},
  };
  std::string tf = "none";
  const TextKey optional[] = {{"dds.security", &d.dds.security}, {"dds.tf", &tf},
                              {"frames.map", &d.frames.map},     {"frames.odometry", &d.frames.odometry},
                              {"frames.body", &d.frames.body},   {kAdaptation[1], &d.adaptation.file}};
  std::vector<std::string_view> others{kLive, kReach[0], kAdaptation[0], kAdaptation[1], kProtocol, kSigningKeyFile};
  others.insert(others.end(), std::begin(kOdometryTexts), std::end(kOdometryTexts));
  others.insert(others.end(), std::begin(kGpio), std::end(kGpio));
  others.insert(others.end(), std::begin(kWindow), std::end(kWindow));
  for (const auto& [key, target] : texts) others.push_back(key);
  for (const auto& [key, target] : optional) others.push_back(key);
  if (auto read = read_numbers(*file, others, d, converted); !read) return tl::unexpected(read.error());
  if (auto read = read_texts(*file, texts, true); !read) return tl::unexpected(read.error());
  if (auto good = check_names(*file, d); !good) return tl::unexpected(good.error());
  if (auto read = read_texts(*file, optional, false); !read) return tl::unexpected(read.error());
  if (auto read = read_odometry(*file, d); !read) return tl::unexpected(read.error());
  if (auto good = read_link(*file, d); !good) return tl::unexpected(good.error());
  if (auto good = read_gpio(*file, d); !good) return tl::unexpected(good.error());
  if (auto good = read_frames(*file, tf, d); !good) return tl::unexpected(good.error());
  if (auto read = read_window(*file, d); !read) return tl::unexpected(read.error());
  if (auto read = read_risk(*file, converted.risk, d); !read) return tl::unexpected(read.error());
  if (auto read = read_flags(*file, d); !read) return tl::unexpected(read.error());
  if (auto good = convert(*file, converted, d); !good) return tl::unexpected(good.error());
  return d;
}

}  // namespace backwash::config
