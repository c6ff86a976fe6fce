// SPDX-License-Identifier: BSD-3-Clause
// What the plain link makes up of a controller's state: nothing that it does not know, no answer to another request.
#include "firmware_bridge/plain/plain.h"
#include "tests/bridge/emulated_controller.hpp"

namespace backwash::firmware_bridge::test {
namespace {

/// The link on a plain line, whose other end the test holds.
class PlainAnswers : public testing::Test {
 protected:
  /// Says a state and polls until the link has taken its frames; the next state has the next number.
  void say(plain_state_t s) {
    s.sequence = ++sequence_;
    Bytes wire(PLAIN_STATE_SIZE);
    plain_write_state(&s, wire.data());
    const std::uint64_t before = link_.received().frames;
    far_.write(wire);
    for (int i = 0; i < 2000 && link_.received().frames == before; ++i) {
      ASSERT_TRUE(link_.poll(kStart));
      ::usleep(500);
    }
    ASSERT_TRUE(link_.poll(kStart));
    ASSERT_GT(link_.received().frames, before);
  }
  /// Number of the last request that the controller got.
  std::uint16_t asked() {
    plain_receiver_t receiver{};
    plain_command_t c{};
    for (const auto byte : far_.await())
      if (plain_receive(&receiver, byte) == PLAIN_COMMAND) plain_read_command(&receiver, &c);
    return c.sequence;
  }
  static Port open(const std::string& path) { return PlainPort(SerialPort::open(path, 57600).value(), kVehicle); }

  PseudoTerminal far_;
  AutopilotLink link_{open(far_.path()), kVehicle, kStart};
  std::uint16_t sequence_ = 0;
};

TEST_F(PlainAnswers, AControllerThatDoesNotKnowTheGroundIsNeitherOnItNorInTheAir) {
  plain_state_t s{};
  say(s);
  EXPECT_EQ(link_.vehicle(), kVehicle);
  EXPECT_FALSE(link_.telemetry().landed_state.at(kStart));
  s.ground_known = true;
  say(s);
  ASSERT_TRUE(link_.telemetry().landed_state.at(kStart));
  EXPECT_EQ(link_.telemetry().landed_state.at(kStart)->value, LandedState::kInAir);
}

TEST_F(PlainAnswers, AnAnswerToAnEarlierRequestIsNoneToThisOne) {
  constexpr std::uint16_t kArm = 400;
  plain_state_t s{};
  say(s);
  ASSERT_TRUE(link_.send_arm(true));
  const std::uint16_t first = asked();
  ASSERT_TRUE(link_.send_arm(false));
  const std::uint16_t second = asked();
  ASSERT_NE(first, second);
  s.answered = first;
  s.answer = PLAIN_ANSWER_DONE;
  say(s);
  EXPECT_FALSE(link_.telemetry().result_of(kArm));
  s.answered = second;
  say(s);
  EXPECT_TRUE(link_.telemetry().result_of(kArm));
}

}  // namespace
}  // namespace backwash::firmware_bridge::test
