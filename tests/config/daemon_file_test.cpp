// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "core/config/daemon_config.hpp"
#include "tests/config/file_texts.hpp"

namespace backwash::config {
namespace {

using testing::HasSubstr;

std::string shipped() {
  std::ifstream in(std::string(BACKWASH_SOURCE_DIR) + "/core/config/files/backwashd.daemon.toml");
  return {std::istreambuf_iterator<char>(in), {}};
}

/// Of this process alone: tests run side by side.
std::filesystem::path temporary(const std::string& name) {
  return std::filesystem::temp_directory_path() / ("backwash." + std::to_string(::getpid()) + "." + name);
}

tl::expected<Daemon, ConfigError> loaded(const std::string& text) {
  const auto path = temporary("daemon_file_test.toml");
  std::ofstream(path) << text;
  auto read = load_daemon(path);
  std::filesystem::remove(path);
  return read;
}

/// What the shipped file says of itself once `from` is replaced by `to`.
std::string error_after(const std::string& from, const std::string& to) {
  std::string text = shipped();
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  text.replace(at, from.size(), to);
  const auto read = loaded(text);
  return read ? std::string("no error") : read.error().message;
}

TEST(DaemonFile, ReadsTheShippedExample) {
  const auto d = load_daemon("builtin:backwashd");
  ASSERT_TRUE(d) << d.error().message;
  EXPECT_EQ(d->vehicle, "builtin:quad-5in");
  EXPECT_EQ(d->dds.name_space, "backwash");
  EXPECT_EQ(d->link.baud, 921600);
  EXPECT_EQ(d->control.priority, 80);
  EXPECT_EQ(d->control.cpu, std::nullopt);
  EXPECT_DOUBLE_EQ(d->control.battery_land, 0.15);
}

/// The shipped file with these lines instead of its [odometry] and [frames].
Daemon with_odometry(const std::string& lines, const std::string& map = "map") {
  std::string text = shipped();
  const auto frames = text.find("\n[frames]"), odometry = text.find("\n[odometry]"), next = text.find("\n[map]");
  EXPECT_TRUE(frames < odometry && odometry < next && next != std::string::npos);
  text.replace(frames, next - frames, "\n[frames]\nmap = \"" + map + "\"\n[odometry]\n" + lines + "\n");
  const auto read = loaded(text);
  EXPECT_TRUE(read) << lines << ": " << (read ? "" : read.error().message);
  return read.value_or(Daemon{});
}

TEST(DaemonFile, AnEstimatorsProfileSetsItsFramesAndItsTwist) {
  struct Case {
    std::string lines;
    Twist twist;
    std::string frame, child;
  };
  for (const auto& [lines, twist, frame, child] :
       std::vector<Case>{{"profile = \"vins_fusion\"", Twist::world, "world", "world"},
                         {"profile = \"fast_lio\"", Twist::none, "camera_init", "body"},
                         {"profile = \"custom\"\ntwist = \"world\"\nchild = \"lidar\"", Twist::world, "odom", "lidar"},
                         {"", Twist::body, "odom", ""}}) {
    const auto d = with_odometry(lines);
    EXPECT_EQ(d.odometry.twist, twist) << lines;
    EXPECT_EQ(d.frames.odometry, frame) << lines;
    EXPECT_EQ(d.odometry.child, child) << lines;
  }
}

TEST(DaemonFile, MessagesOfPosesAloneHaveNoTwist) {
  const auto custom = [](const std::string& lines) { return "profile = \"custom\"\n" + lines; };
  for (const auto message : {PoseMessage::pose, PoseMessage::pose_with_covariance, PoseMessage::tf}) {
    const std::string line = "message = \"" + std::string(name(message)) + "\"";
    for (const auto& lines : {line, line + "\ntwist = \"none\""}) {
      const auto d = with_odometry(custom(lines));
      EXPECT_TRUE(d.odometry.message == message && d.odometry.twist == Twist::none) << lines;
    }
    EXPECT_THAT(error_after("profile = \"ros\"", custom(line + "\ntwist = \"world\"")),
                testing::AllOf(HasSubstr("odometry.twist"), HasSubstr("poses alone")));
  }
  EXPECT_THAT(error_after("profile = \"ros\"", "message = \"pose\""),
              testing::AllOf(HasSubstr("odometry.message"), HasSubstr("profile = \"custom\"")));
  for (const std::string child : {"child = \"map\"", "child = \"odom\""})
    EXPECT_THAT(error_after("profile = \"ros\"", custom("message = \"tf\"\n" + child)), HasSubstr("odometry.child"));
  EXPECT_THAT(error_after("profile = \"ros\"", custom("message = \"PoseStamped\"")),
              testing::AllOf(HasSubstr("odometry.message"), HasSubstr("\"pose_with_covariance\"")));
}

TEST(DaemonFile, ASensorsPlaceAndTurnStandBesideItsProfile) {
  const auto d = with_odometry("profile = \"fast_lio\"\nsensor_roll = 3.14159\nsensor_x = 0.1");
  EXPECT_DOUBLE_EQ(d.odometry.sensor_B.x(), 0.1);
  EXPECT_DOUBLE_EQ(d.odometry.sensor_turned.x(), 3.14159);
}

TEST(DaemonFile, TheRateIsTheProfilesUnlessItIsSaid) {
  EXPECT_EQ(with_odometry("profile = \"ros\"").odometry.timing.rate_least, 20);
  EXPECT_TRUE(with_odometry("profile = \"vins_fusion\"").odometry.timing.usual());
  EXPECT_EQ(with_odometry("profile = \"fast_lio\"").odometry.timing.rate_least, 9) << "its lidar's 10 Hz, and jitter";
  const auto d = with_odometry("profile = \"fast_lio\"\nrate_least = 20\nlatency = 0.04");
  EXPECT_EQ(d.odometry.timing.rate_least, 20);
  EXPECT_EQ(d.odometry.timing.latency, 0.04);
}

TEST(DaemonFile, AMapInTheEstimatorsOwnFrameKeepsItsName) {
  const auto d = with_odometry("profile = \"openvins\"", "global");
  EXPECT_EQ(d.frames.map, "global");
  EXPECT_EQ(d.odometry.child, "imu");
}

TEST(DaemonFile, AProfileThatIsNoneAndKeysThatItDoesNotTakeAreNamed) {
  EXPECT_THAT(error_after("profile = \"ros\"", "profile = \"fastlio\""),
              testing::AllOf(HasSubstr("odometry.profile"), HasSubstr("\"fast_lio\"")));
  EXPECT_THAT(error_after("profile = \"ros\"", "twist = \"none\""),
              testing::AllOf(HasSubstr("odometry.twist"), HasSubstr("profile = \"custom\"")));
  EXPECT_THAT(error_after("profile = \"ros\"", "profile = \"custom\"\ntwist = \"map\""),
              HasSubstr("\"body\", \"world\" or \"none\""));
  EXPECT_THAT(error_after("profile = \"ros\"", "sensor_x = 6.0"), HasSubstr("odometry.sensor_x"));
  EXPECT_THAT(error_after("profile = \"ros\"", "rate_least = 8.9"), HasSubstr("odometry.rate_least"));
  EXPECT_THAT(error_after("profile = \"ros\"", "latency = 0.21"), HasSubstr("odometry.latency"));
}

TEST(DaemonFile, AShareOfTheLineIsAboveNothingAndAtMostAllOfIt) {
  EXPECT_FALSE(load_daemon("builtin:backwashd")->link.share);
  for (const std::string good : {"0.05", "0.5", "1"})
    EXPECT_EQ(error_after("system = 1 ", "share = " + good + "\nsystem = 1 "), "no error") << good;
  for (const std::string bad : {"0", "0.04", "1.01", "nan"})
    EXPECT_THAT(error_after("system = 1 ", "share = " + bad + "\nsystem = 1 "), HasSubstr("key 'link.share'")) << bad;
}

TEST(DaemonFile, ReadsTheFormsOfALinkDevice) {
  using Kind = LinkDevice::Kind;
  const auto read = [](const char* text) {
    const auto d = link_device(text).value_or(LinkDevice{Kind::serial, "none", 0});
    return std::tuple(d.kind, d.address, int{d.port});
  };
  EXPECT_EQ(read("/dev/ttyAMA0"), std::tuple(Kind::serial, "/dev/ttyAMA0", 0));
  EXPECT_EQ(read("udp:127.0.0.1:14580"), std::tuple(Kind::udp, "127.0.0.1", 14580));
  EXPECT_EQ(read("udpin:0.0.0.0:14540"), std::tuple(Kind::udpin, "0.0.0.0", 14540));
  EXPECT_EQ(read("tcp:192.168.1.255:65535"), std::tuple(Kind::tcp, "192.168.1.255", 65535));
  for (const char* bad :
       {"udp:", "udp:127.0.0.1", "udp:localhost:14580", "tcp:127.0.0.1:0", "tcp:127.0.0.1:65536", "tcp:127.0.0.1:5760x",
        "udp:127.0.0.256:1", "udp:1.2.3:1", "udp:1.2.3.4.5:1", "udp:1..2.3:1", "udp:127.0.0.1:-1"})
    EXPECT_FALSE(link_device(bad)) << bad;
}

TEST(DaemonFile, FramesAndMapMayBeLeftOut) {
  std::string text = shipped();
  text.resize(text.find("\n[frames]"));
  const auto d = loaded(text);
  ASSERT_TRUE(d) << d.error().message;
  EXPECT_EQ(d->frames.map, "map");
  EXPECT_FALSE(d->map.live);
}

TEST(DaemonFile, NamesTheLineAndKeyOfWhatIsWrong) {
  const struct {
    std::string right, wrong, key;
  } cases[] = {{"domain = 0", "domain = 231", "dds.domain"},
               {"domain = 0", "domain = 1.5", "dds.domain"},
               {"baud = 921600", "baud = \"fast\"", "link.baud"},
               {"\"/dev/ttyAMA0\"", "\"udp:there:14580\"", "link.device"},
               {"baud = 921600", "bauds = 921600", "link.bauds"},
               {"device = \"/dev/ttyAMA0\"", "device = \"\"", "link.device"},
               {"\nfile = ", "\npath = ", "log.path"},
               {"cpu = -1", "cpu = 0.5", "control.cpu"},
               {"battery_land = 0.15", "battery_land = 15", "control.battery_land"},
               {"[control]", "[controls]", "controls"},
               {"live = false", "live = 0", "map.live"},
               {"max_mib = 512", "max_mib = 0", "map.max_mib"},
               {"body = \"base_link\"", "body = \"map\"", "frames"}};
  const std::string text = shipped();
  for (const auto& c : cases) {
    const std::string at = c.key == "frames" ? "\n[frames]" : c.right;  // two names of one: their table's
    const std::string before = text.substr(0, text.find(at) + (at.front() == '\n' ? 1 : 0));
    const auto line = 1 + std::count(before.begin(), before.end(), '\n');
    EXPECT_THAT(error_after(c.right, c.wrong), HasSubstr(".toml:" + std::to_string(line) + ": key '" + c.key + "'"));
  }
}

/// What the shipped file says of itself with these lines as its [gpio] table.
std::string with_gpio(const std::string& lines) { return error_after("# [gpio] ", "[gpio]\n" + lines + "\n#"); }

TEST(DaemonFile, TakesAChipWithAnyOfItsLines) {
  const std::string chip = "chip = \"/dev/gpiochip0\"";
  for (const std::string line : {"stop_switch", "strobe", "led"})
    EXPECT_EQ(with_gpio(chip + "\n" + line + " = \"A\""), "no error") << line;
  EXPECT_EQ(with_gpio(chip + "\nstop_switch = \"A\"\nstrobe = \"B\"\nled = \"C\""), "no error");
}

TEST(DaemonFile, RefusesLinesWithoutAChipAndOneLineForTwoUses) {
  const auto says = [](const std::string& lines, const std::string& what) {
    const std::string message = with_gpio(lines);
    return message.find(what) != std::string::npos ? "" : message;
  };
  const std::string chip = "chip = \"/dev/gpiochip0\"\n";
  EXPECT_EQ(says(chip, "needs chip and at least one of"), "");
  EXPECT_EQ(says("strobe = \"A\"", "needs chip and at least one of"), "");
  EXPECT_EQ(says(chip + "strobe = \"A\"\nled = \"A\"", "key 'gpio.led' = 'A': needs another value than gpio.strobe"),
            "");
  EXPECT_EQ(says(chip + "strobe = \"\"", "key 'gpio.strobe'"), "");
  EXPECT_EQ(says(chip + "strobe = 3", "key 'gpio.strobe'"), "");
  EXPECT_EQ(says(chip + "horn = \"A\"", "key 'gpio.horn'"), "");
}

/// What the shipped file says of itself with this key file; "no error" if it is taken.
std::string with_key(const std::string& content, std::filesystem::perms mode) {
  const auto path = temporary("daemon_file_test.key");
  std::ofstream(path, std::ios::binary) << content;
  std::filesystem::permissions(path, mode);
  const std::string said =
      error_after("# signing_key_file = \"/etc/backwash/mavlink.key\"", "signing_key_file = \"" + path.string() + "\"");
  std::filesystem::remove(path);
  return said;
}

TEST(DaemonFile, TakesASigningKeyRawOrInHex) {
  using enum std::filesystem::perms;
  EXPECT_EQ(with_key(std::string(32, 'k'), owner_read | owner_write), "no error");
  EXPECT_EQ(with_key(std::string(64, 'a') + "\n", owner_read), "no error");
  const auto path = temporary("key_file_test.key");
  std::ofstream(path) << "000102030405060708090a0B0c0d0e0f101112131415161718191a1b1c1d1e1f\n";
  std::filesystem::permissions(path, owner_read | owner_write);
  const auto key = read_key_file(path);
  std::filesystem::remove(path);
  ASSERT_TRUE(key) << key.error();
  for (std::size_t i = 0; i < key->size(); ++i) EXPECT_EQ((*key)[i], i);
}

TEST(DaemonFile, RefusesASigningKeyThatOthersMayReadOrThatIsNone) {
  using enum std::filesystem::perms;
  const std::string good(64, 'a'), at = ".toml:19: key 'link.signing_key_file' = ";
  const auto refused = [&](const std::string& said, const std::string& why) {
    return said.find(at) != said.npos && said.find(why) != said.npos && said.find(good) == said.npos;
  };
  constexpr auto kOwner = owner_read | owner_write;
  for (const auto other : {group_read, others_read, group_write, others_write, owner_exec})
    EXPECT_TRUE(refused(with_key(good, kOwner | other), "needs 0600")) << static_cast<unsigned>(other);
  for (const std::string& bad : {std::string(), std::string(31, 'k'), std::string(33, 'k'), std::string(63, 'a'),
                                 std::string(65, 'a'), std::string(64, 'g'), std::string(200, 'a')})
    EXPECT_TRUE(refused(with_key(bad, kOwner), "32 bytes or 64 hexadecimal digits")) << bad.size();
  EXPECT_TRUE(refused(with_key(std::string(64, '0'), kOwner), "not all zero"));
  const auto with_path = [](const std::string& path) {
    return error_after("# signing_key_file = \"/etc/backwash/mavlink.key\"", "signing_key_file = \"" + path + "\"");
  };
  EXPECT_TRUE(refused(with_path("/nowhere/key"), "No such file"));
  EXPECT_TRUE(refused(with_path("/dev/null"), "regular file"));
  EXPECT_TRUE(refused(with_path("/"), "regular file"));
}

TEST(DaemonFile, ThePlainProtocolNeedsASerialPort) {
  const std::string was = "# protocol = \"plain\"";
  EXPECT_EQ(error_after(was, "protocol = \"plain\""), "no error");
  EXPECT_EQ(error_after(was, "protocol = \"mavlink\""), "no error");
  const auto unknown = error_after(was, "protocol = \"modbus\""), key = std::string("key 'link.protocol' = 'modbus'");
  EXPECT_NE(unknown.find(".toml:18: " + key), unknown.npos) << unknown;
  EXPECT_THAT(error_after("device = \"/dev/ttyAMA0\"", "device = \"tcp:1.2.3.4:5\"\nprotocol = \"plain\""),
              HasSubstr("needs a serial port"));
}

// They end up in the middleware's XML and in topic names.
TEST(DaemonFile, RefusesNamesThatRos2OrTheKernelWouldNotTake) {
  const std::string long_name(300, 'a');
  const auto error = [](const std::string& key, const std::string& was, const std::string& is) {
    return error_after(key + " = \"" + was + "\"", key + " = \"" + is + "\"");
  };
  for (const char* bad :
       {"back wash", "a\\\"/><b", "/abs", "a/", "a//b", "2fast", "a__b", "a-b", "caf\u00e9", "a\\u0000b"})
    EXPECT_THAT(error("namespace", "backwash", bad), HasSubstr(".toml:9: key 'dds.namespace' = ")) << bad;
  for (const std::string& bad : {std::string("rt/odom etry"), long_name, std::string("rt/7")})
    EXPECT_THAT(error("odometry_topic", "rt/backwash/odometry", bad),
                HasSubstr(".toml:10: key 'dds.odometry_topic' = "))
        << bad;
  for (const char* bad : {"lo\\\"/>", "a name", "sixteen_characte", "eth0&amp;"})
    EXPECT_THAT(error("interface", "lo", bad), HasSubstr(".toml:8: key 'dds.interface' = ")) << bad;
  EXPECT_EQ(error("namespace", "backwash", "fleet/uav_2"), "no error");
  EXPECT_EQ(error("interface", "lo", "enp0s31f6.100"), "no error");
  EXPECT_EQ(error("odometry_topic", "rt/backwash/odometry", "rt/ov_msckf/odomimu"), "no error");
}

TEST(DaemonFile, RefusesTextThatWouldSteerATerminalOrCutAPath) {
  for (const char* bad : {"/dev/tty\\u0000x", "/dev/\\u001b[2J"})
    EXPECT_THAT(error_after("/dev/ttyAMA0", bad),
                testing::AllOf(HasSubstr(".toml:15: key 'link.device'"), testing::Not(HasSubstr("\x1b"))));
}

/// The shipped file with these lines before its [link].
tl::expected<Daemon, ConfigError> with_lines(const std::string& lines) {
  std::string text = config::shipped("backwashd.daemon.toml");
  text.insert(text.find("[link]"), lines);
  return load_daemon(TemporaryFile(text).path);
}

TEST(DaemonFile, CredentialsMayBeLeftOutOrHaveAFolder) {
  EXPECT_EQ(with_lines("").value().dds.security, "");
  EXPECT_EQ(with_lines("security = \"/etc/backwash/security\"\n").value().dds.security, "/etc/backwash/security");
  for (const std::string bad : {"\"\"", "true", "7", "\"/etc\\u001b[2J\""}) {
    const auto refused = with_lines("security = " + bad + "\n");
    ASSERT_FALSE(refused) << bad;
    EXPECT_THAT(refused.error().message, testing::HasSubstr(".toml:14: key 'dds.security' = ")) << bad;
  }
}

// dds.tf of the daemon's configuration: which transforms it sends.

/// The shipped file with these texts replaced.
tl::expected<Daemon, ConfigError> changed(std::initializer_list<std::pair<std::string_view, std::string>> texts) {
  std::string text = config::shipped("backwashd.daemon.toml");
  for (const auto& [from, to] : texts) {
    EXPECT_NE(text.find(from), text.npos) << from;
    text.replace(text.find(from), from.size(), to);
  }
  return load_daemon(TemporaryFile(text).path);
}

TEST(DaemonTransforms, AreSentWhereTheyAreAskedForAndNobodyElseSendsThem) {
  EXPECT_EQ(load_daemon("builtin:backwashd")->dds.tf, Transforms::none);
  const std::pair<std::string, Transforms> all[] = {
      {"none", Transforms::none}, {"map", Transforms::map}, {"vehicle", Transforms::vehicle}};
  for (const auto& [text, tf] : all) {
    const std::pair<std::string_view, std::string> asked{"domain = 0", "domain = 0\ntf = \"" + text + "\""};
    const auto read = changed({asked});
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_EQ(read->dds.tf, tf);
    const auto heard = changed({asked, {"profile = \"ros\"", "profile = \"custom\"\nmessage = \"tf\""}});
    EXPECT_EQ(heard.has_value(), tf == Transforms::none) << text;
    if (heard) continue;
    EXPECT_THAT(heard.error().message, testing::HasSubstr("with odometry.message = \"tf\" others send them"));
  }
  const auto other = changed({{"domain = 0", "domain = 0\ntf = \"odom\""}});
  ASSERT_FALSE(other);
  EXPECT_THAT(other.error().message, testing::AllOf(testing::HasSubstr("'dds.tf'"), testing::HasSubstr("\"vehicle\"")));
}

}  // namespace
}  // namespace backwash::config
