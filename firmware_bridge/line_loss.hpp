// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace backwash::firmware_bridge {

/// What a line to an autopilot loses, from the count that each of its frames carries and from the TIMESYNC questions
/// that it answers. Real-time: fixed size, no allocation.
class LineLoss {
 public:
  static constexpr std::size_t kQuestions = 64;  ///< that are looked at: 32 s of them

  struct Shares {
    double in;        ///< of the autopilot's frames that do not arrive here
    double out;       ///< of our short frames (TIMESYNC) that do not arrive there
    double odometry;  ///< of ODOMETRY, at least: two standard errors of so many questions below what they say
  };

  /// A frame of the autopilot's arrived; `sequence`: its number, `passed_over`: frames of messages that we do not know
  /// so far (ParserCounters::unknown_id), which arrived too.
  void heard(std::uint8_t sequence, std::uint64_t passed_over) noexcept;
  /// A TIMESYNC question was sent: one more is looked at.
  void asked() noexcept;
  /// A question was answered; late ones count for the newest.
  void answered() noexcept;
  /// Absent: not kQuestions yet, or one that answers none. `datagrams`: a frame is lost whole, whatever its length;
  /// otherwise byte by byte. `authenticated`: frames bear signatures.
  std::optional<Shares> shares(bool datagrams, bool authenticated) const noexcept;

 private:
  struct Question {
    std::uint32_t frames = 0, missing = 0;  // until the next question
    bool answered = false;
  };
  Question& newest() noexcept { return questions_[asked_ % questions_.size()]; }

  std::array<Question, kQuestions + 1> questions_{};  // and the one that may still be answered
  std::size_t asked_ = 0;
  std::optional<std::uint8_t> last_;
  std::uint64_t passed_over_ = 0;
};

}  // namespace backwash::firmware_bridge
