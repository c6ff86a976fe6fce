// SPDX-License-Identifier: BSD-3-Clause
#include "firmware_bridge/line_loss.hpp"

#include <algorithm>
#include <cmath>

#include "firmware_bridge/mavlink/frame.hpp"
#include "firmware_bridge/mavlink/messages.hpp"

namespace backwash::firmware_bridge {

void LineLoss::heard(std::uint8_t sequence, std::uint64_t passed_over) noexcept {
  const int gap = last_ ? static_cast<std::uint8_t>(sequence - *last_ - 1) : 0;
  if (gap == 255) return;  // twice
  ++newest().frames;
  constexpr int kOvertaken = 240;  // and more: the count is of 8 bits
  if (gap >= kOvertaken) {
    newest().missing -= newest().missing > 0;
    return;
  }
  const auto known = static_cast<int>(std::min<std::uint64_t>(passed_over - passed_over_, 255));
  newest().missing += static_cast<std::uint32_t>(std::max(gap - known, 0));
  last_ = sequence;
  passed_over_ = passed_over;
}

void LineLoss::asked() noexcept {
  ++asked_;
  newest() = {};
}

void LineLoss::answered() noexcept { newest().answered = true; }

std::optional<LineLoss::Shares> LineLoss::shares(bool datagrams, bool authenticated) const noexcept {
  if (asked_ <= kQuestions) return std::nullopt;
  double frames = 0, missing = 0, answered = 0;
  for (std::size_t back = 1; back <= kQuestions; ++back) {
    const Question& question = questions_[(asked_ - back) % questions_.size()];
    frames += question.frames;
    missing += question.missing;
    answered += question.answered;
  }
  if (answered == 0 || frames == 0) return std::nullopt;
  const double in = missing / (frames + missing);
  const double arrives = std::min(1.0, answered / kQuestions / (1 - in));
  const double perhaps = std::min(1.0, arrives + 2 * std::sqrt(arrives * (1 - arrives) / kQuestions));
  const double frame = mavlink::kHeaderV2 + mavlink::kChecksum + (authenticated ? mavlink::kSignature : 0);
  const double longer = (frame + mavlink::info<mavlink::Odometry>().full_length) /
                        (frame + mavlink::info<mavlink::Timesync>().full_length);
  return Shares{in, 1 - arrives, 1 - std::pow(perhaps, datagrams ? 1 : longer)};
}

}  // namespace backwash::firmware_bridge
