// SPDX-License-Identifier: BSD-3-Clause
// MAVLink 2 signing: against frames signed by the reference encoders, and what the link does with a key.
#include "firmware_bridge/mavlink/signing.hpp"

#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/bridge/emulated_controller.hpp"

namespace backwash::firmware_bridge::test {
namespace {

using mavlink::EncodedFrame;
using mavlink::kSigningSecond;
using mavlink::SignatureVerdict;
using mavlink::Signing;
using mavlink::SigningTime;
using mavlink::test::from_hex;
using mavlink::test::operator+;
using nlohmann::json;

constexpr mavlink::SigningKey kKey{1, 2, 3, 4, 5, 6, 7, 8};
constexpr SigningTime kNow = 3000 * 86'400 * kSigningSecond;  // in 2023

mavlink::SigningKey key_of(const std::string& hex) {
  mavlink::SigningKey key{};
  std::ranges::copy(from_hex(hex), key.begin());
  return key;
}

template <class Message>
Bytes signed_bytes(Signing& signing, const Message& message, std::uint8_t component = 1,
                   std::uint8_t system = kVehicle) {
  EncodedFrame f = mavlink::encode_frame({system, component, 0}, message, mavlink::kIncompatSigned);
  EXPECT_TRUE(signing.sign(f));
  return {f.view().begin(), f.view().end()};
}

/// The verdicts on the frames in these bytes.
std::vector<SignatureVerdict> judge(Signing& signing, const Bytes& bytes) {
  std::vector<SignatureVerdict> verdicts;
  mavlink::Parser parser;
  parser.feed(bytes, [&](const mavlink::Frame& f) { verdicts.push_back(signing.judge(f)); });
  return verdicts;
}

class SigningVectors : public testing::Test {
 protected:
  void SetUp() override { data_ = json::parse(std::ifstream(BACKWASH_SOURCE_DIR "/tests/data/mavlink_vectors.json")); }
  json data_;
};

TEST_F(SigningVectors, SignsToTheSameBytesAndTakesThem) {
  int checked = 0;
  for (const json& v : data_["vectors"]) {
    if (!v.contains("signing")) continue;
    SCOPED_TRACE(v["name"].get<std::string>());
    const Bytes expected = from_hex(v["frame_hex"]);
    const json& s = v["signing"];
    const auto time = s["timestamp"].get<SigningTime>();
    const auto key = key_of(s["secret_key_hex"]);
    EncodedFrame frame;
    frame.length = expected.size() - mavlink::kSignature;
    std::copy_n(expected.begin(), frame.length, frame.bytes.begin());
    Signing sender(key, s["link_id"], time - 1), receiver(key, 0, time);
    ASSERT_TRUE(sender.sign(frame));
    EXPECT_EQ(Bytes(frame.view().begin(), frame.view().end()), expected);
    EXPECT_EQ(judge(receiver, expected), std::vector{SignatureVerdict::good});
    ++checked;
  }
  EXPECT_EQ(checked, 4);
}

TEST_F(SigningVectors, RefusesWhatTheReferenceParserRefuses) {
  const auto bytes_of = [&](const char* name) {
    for (const json& c : data_["parser_cases"])
      if (c["name"] == name) return from_hex(c["frame_hex"]);
    return Bytes{};
  };
  const auto key = key_of("e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  Signing bad(key, 0, 0), replayed(key, 0, 0);
  EXPECT_EQ(judge(bad, bytes_of("signed_bad_signature")), std::vector{SignatureVerdict::wrong_signature});
  EXPECT_EQ(bad.time(), 0U) << "a bad signature teaches no time";
  EXPECT_EQ(judge(replayed, bytes_of("signed_replayed")),
            (std::vector{SignatureVerdict::good, SignatureVerdict::replayed}));
}

TEST(SigningTest, NoFlippedBitOfASignedFrameIsTaken) {
  Signing sender(kKey, 3, kNow), receiver(kKey, 0, kNow);
  const Bytes good = signed_bytes(sender, px4_heartbeat(true, 6));
  for (std::size_t bit = 0; bit < good.size() * 8; ++bit) {
    Bytes bad = good;
    bad[bit / 8] = static_cast<std::uint8_t>(bad[bit / 8] ^ 1U << bit % 8);
    for (const auto verdict : judge(receiver, bad)) EXPECT_NE(verdict, SignatureVerdict::good) << bit;
  }
  EXPECT_EQ(receiver.counters().wrong_signature, mavlink::kSignature * 8) << "all else fails by its checksum";
  EXPECT_EQ(judge(receiver, good), std::vector{SignatureVerdict::good});
}

TEST(SigningTest, TheTimeOfAStreamMustRise) {
  Signing sender(kKey, 3, kNow), receiver(kKey, 0, kNow);
  const Bytes first = signed_bytes(sender, mavlink::Heartbeat{}), second = signed_bytes(sender, mavlink::Heartbeat{});
  EXPECT_EQ(judge(receiver, second), std::vector{SignatureVerdict::good});
  EXPECT_EQ(judge(receiver, first), std::vector{SignatureVerdict::replayed});
  EXPECT_EQ(judge(receiver, second), std::vector{SignatureVerdict::replayed});
  EXPECT_EQ(receiver.counters().replayed, 2U);
}

TEST(SigningTest, EachSystemComponentAndLinkIsAStreamOfItsOwn) {
  Signing receiver(kKey, 0, kNow);
  for (const auto& [system, component, link] : {std::tuple{1, 1, 0}, {2, 1, 0}, {1, 2, 0}, {1, 1, 1}}) {
    Signing sender(kKey, static_cast<std::uint8_t>(link), kNow);
    const Bytes bytes = signed_bytes(sender, mavlink::Heartbeat{}, static_cast<std::uint8_t>(component),
                                     static_cast<std::uint8_t>(system));
    EXPECT_EQ(judge(receiver, bytes), std::vector{SignatureVerdict::good});
    EXPECT_EQ(judge(receiver, bytes), std::vector{SignatureVerdict::replayed});
  }
}

TEST(SigningTest, ANewStreamMayBeAMinuteBehindAndNoMore) {
  Signing minute(kKey, 0, kNow - mavlink::kOldestNewStream - 1), older(kKey, 1, kNow - mavlink::kOldestNewStream - 2);
  Signing receiver(kKey, 0, kNow);
  EXPECT_EQ(judge(receiver, signed_bytes(older, mavlink::Heartbeat{})), std::vector{SignatureVerdict::old});
  EXPECT_EQ(judge(receiver, signed_bytes(minute, mavlink::Heartbeat{})), std::vector{SignatureVerdict::good});
  EXPECT_EQ(receiver.counters().old, 1U);
}

TEST(SigningTest, OurTimeFollowsTheNewestGoodSignatureAndNeverGoesBack) {
  Signing ahead(kKey, 0, kNow + 500), receiver(kKey, 0, kNow), other_key({9}, 0, kNow + 10'000);
  EXPECT_EQ(judge(receiver, signed_bytes(other_key, mavlink::Heartbeat{})),
            std::vector{SignatureVerdict::wrong_signature});
  EXPECT_EQ(receiver.time(), kNow);
  judge(receiver, signed_bytes(ahead, mavlink::Heartbeat{}));
  EXPECT_EQ(receiver.time(), kNow + 501);
  receiver.advance_to(kNow);
  EXPECT_EQ(receiver.time(), kNow + 501);
  Signing last(kKey, 0, mavlink::kLastSigningTime);
  EncodedFrame f = mavlink::encode_frame({1, 1, 0}, mavlink::Heartbeat{}, mavlink::kIncompatSigned);
  EXPECT_FALSE(last.sign(f)) << "48 bits do not wrap";
}

TEST(SigningTest, KeepsABoundedNumberOfStreams) {
  Signing receiver(kKey, 0, kNow);
  std::vector<SignatureVerdict> verdicts;
  for (std::size_t i = 0; i <= Signing::kStreams; ++i) {
    Signing sender(kKey, static_cast<std::uint8_t>(i), kNow);
    verdicts.push_back(judge(receiver, signed_bytes(sender, mavlink::Heartbeat{})).at(0));
  }
  EXPECT_EQ(std::ranges::count(verdicts, SignatureVerdict::good), static_cast<long>(Signing::kStreams));
  EXPECT_EQ(verdicts.back(), SignatureVerdict::no_room);
}

/// The link with a key, and a controller that signs with the same one.
class SignedLinkTest : public LinkTest {
 protected:
  SignedLinkTest() { link_.require_signatures(Signing(kKey, 0, kNow), kStart); }
  void say_signed(const mavlink::Heartbeat& m, Signing& signing) { far_.write(signed_bytes(signing, m)); }
  /// Polls until so many frames have arrived, good or not.
  void poll_until_arrived(std::uint64_t frames, Time now = kStart) { poll_until(frames, now); }

  Signing controller_{kKey, 5, kNow};
};

TEST_F(SignedLinkTest, ActsUponNoFrameThatIsUnsignedWronglySignedOrReplayed) {
  Signing stranger({7}, 5, kNow);
  const Bytes old = signed_bytes(controller_, px4_heartbeat(false, 1));
  introduce_vehicle();  // unsigned
  say_signed(px4_heartbeat(false, 1), stranger);
  poll_until_arrived(2);
  EXPECT_FALSE(link_.vehicle());
  EXPECT_FALSE(link_.send_setpoint({}, kStart));
  EXPECT_EQ(link_.fault(kStart + 2s), LinkFault::none_signed_rightly);

  say_signed(px4_heartbeat(false, 1), controller_);
  poll_until_arrived(3);
  EXPECT_EQ(link_.vehicle(), kVehicle);
  EXPECT_FALSE(link_.telemetry().status.at(kStart)->value.armed);
  say(px4_heartbeat(true, 6));
  say_signed(px4_heartbeat(true, 6), stranger);
  far_.write(old);
  poll_until_arrived(6, kStart + 1s);
  EXPECT_FALSE(link_.telemetry().status.at(kStart)->value.armed);
  EXPECT_EQ(link_.heartbeat_age(kStart + 1s), 1s) << "a replayed heartbeat is no sign of life";
  const auto& counted = link_.signing()->counters();
  EXPECT_EQ(std::tuple(counted.good, counted.unsigned_frames, counted.wrong_signature, counted.replayed),
            std::tuple(1U, 2U, 2U, 1U));
  EXPECT_EQ(counted.refused(), 5U);
}

TEST_F(SignedLinkTest, SignsEachFrameWithATimeThatRisesWithTheMonotonicClock) {
  say_signed(px4_heartbeat(false, 1), controller_);
  poll_until_arrived(1);
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(link_.send_heartbeat() && link_.send_arm(true));
  ASSERT_TRUE(link_.poll(kStart + 10s));
  ASSERT_TRUE(link_.send_setpoint({}, kStart + 10s));
  ::usleep(20'000);
  Signing receiver(kKey, 0, kNow);
  const auto verdicts = judge(receiver, far_.read());
  EXPECT_EQ(verdicts, std::vector<SignatureVerdict>(7, SignatureVerdict::good));
  EXPECT_EQ(receiver.time(), kNow + 10 * kSigningSecond + 1);
}

TEST_F(SignedLinkTest, TheTapSeesWholeFramesAndNoRefusedOne) {
  Bytes in;
  link_.tap(
      [](void* bytes, bool outgoing, std::span<const std::uint8_t> frame) noexcept {
        if (!outgoing)
          static_cast<Bytes*>(bytes)->insert(static_cast<Bytes*>(bytes)->end(), frame.begin(), frame.end());
      },
      &in);
  const Bytes good = signed_bytes(controller_, px4_heartbeat(false, 1));
  introduce_vehicle();
  far_.write(good);
  poll_until_arrived(2);
  EXPECT_EQ(in, good);
}

TEST_F(SignedLinkTest, TellsAnAutopilotWithAnOldClockTheTime) {
  Signing behind(kKey, 5, kNow - 3600 * kSigningSecond);
  for (int i = 0; i < 5; ++i) say_signed(px4_heartbeat(false, 1), behind);
  poll_until_arrived(5);
  EXPECT_FALSE(link_.vehicle());
  const Bytes told = far_.await();
  EXPECT_EQ(judge(behind, told), std::vector{SignatureVerdict::good}) << "once a second, and not at each frame";
  say_signed(px4_heartbeat(false, 1), behind);
  poll_until_arrived(6);
  EXPECT_EQ(link_.vehicle(), kVehicle) << "an autopilot that goes by what it hears is now heard";
}

TEST_F(SignedLinkTest, AReplayToAnotherLinkObjectStaysRefusedAfterAReconnect) {
  const Bytes heartbeat = signed_bytes(controller_, px4_heartbeat(true, 6));
  far_.write(heartbeat);
  poll_until_arrived(1);
  PseudoTerminal replacement;
  link_.reconnect(open(replacement.path()), kStart + 1s);
  replacement.write(heartbeat);
  poll_until_arrived(1, kStart + 1s);
  EXPECT_FALSE(link_.vehicle());
}

TEST_F(LinkTest, WithoutAKeyASignedFrameIsTakenAsItIs) {
  Signing controller(kKey, 5, kNow);
  far_.write(signed_bytes(controller, px4_heartbeat(false, 1)));
  poll_until(1);
  EXPECT_EQ(link_.vehicle(), kVehicle);
  ASSERT_TRUE(link_.send_heartbeat());
  EXPECT_EQ(mavlink::test::parse(far_.await()).at(0).frame.incompat_flags, 0);
}

}  // namespace
}  // namespace backwash::firmware_bridge::test
