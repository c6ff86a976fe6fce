// SPDX-License-Identifier: BSD-3-Clause
#include "firmware_bridge/line_loss.hpp"

#include <algorithm>
#include <cmath>

#include "firmware_bridge/mavlink/frame.hpp"
#include "firmware_bridge/mavlink/messages.hpp"

namespace backwash::firmware_bridge {
namespace {

constexpr double kFrame = mavlink::kHeaderV2 + mavlink::kChecksum;
constexpr double kLonger = (kFrame + mavlink::info<mavlink::Odometry>().full_length) /
                           (kFrame + mavlink::info<mavlink::Timesync>().full_length);

}  // namespace

void LineLoss::heard(std::uint8_t sequence, std::uint64_t passed_over) noexcept {
  const int gap = last_ ? static_cast<std::uint8_t>(sequence - *last_ - 1) : 0;
  if (gap == 255) return;  // twice
  ++newest().frames;
  if (gap > 127) {  // the count is of 8 bits: one that was overtaken, or too long a silence to tell
    newest().missing -= newest().missing > 0;
    return;
  }
  const auto known = static_cast<int>(std::min<std::uint64_t>(passed_over - passed_over_, 255));
  newest().missing += static_cast<std::uint32_t>(std::max(gap - known, 0));
  last_ = sequence, passed_over_ = passed_over;
}

void LineLoss::asked() noexcept {
  ++asked_;
  newest() = {};
}

void LineLoss::answered() noexcept { newest().answered = true; }

std::optional<LineLoss::Shares> LineLoss::shares(bool datagrams) const noexcept {
  if (asked_ <= kQuestions) return std::nullopt;
  double frames = 0, missing = 0, answered = 0;
  for (std::size_t back = 1; back <= kQuestions; ++back) {
    const Question& question = questions_[(asked_ - back) % questions_.size()];
    frames += question.frames, missing += question.missing, answered += question.answered;
  }
  if (answered == 0 || frames == 0) return std::nullopt;
  const double in = missing / (frames + missing);
  const double arrives = std::min(1.0, answered / kQuestions / (1 - in));
  return Shares{in, 1 - arrives, 1 - std::pow(arrives, datagrams ? 1 : kLonger)};
}

}  // namespace backwash::firmware_bridge
