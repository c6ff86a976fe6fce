// SPDX-License-Identifier: BSD-3-Clause
#include "core/log/autopilot/log_loss.hpp"

#include <algorithm>

#include "core/types/formatted.hpp"

namespace backwash::log {

void LogLoss::read(std::size_t bytes, std::optional<double> t_s) {
  read_ += bytes;
  damaged_ = false;
  if (!t_s) return;
  timed_bytes_ += bytes;
  timed_ += 1;
  constexpr double kPause_s = 1;  // more between two messages says nothing of how much a log writes
  const double step = newest_s_ ? *t_s - *newest_s_ : 0;
  if (step < 0 && -step > kPause_s) return;  // what was said long before, written down now
  if (open_bytes_ > 0 && newest_s_) {
    bridged_ += 1;
    bridged_bytes_ += open_bytes_;
    bridged_s_ += step;
  } else if (step > 0 && step < kPause_s) {
    sound_s_ += step;
  }
  open_bytes_ = 0;
  newest_s_ = std::max(newest_s_.value_or(*t_s), *t_s);
}

void LogLoss::skip(std::size_t bytes) {
  if (!damaged_) places_ += 1;
  damaged_ = true;
  skipped_ += bytes;
  open_bytes_ += bytes;
}

void LogLoss::misplace(std::size_t messages) {
  const std::size_t bytes = messages * timed_bytes_ / std::max<std::size_t>(timed_, 1);
  misplaced_ += messages;
  skipped_ += bytes;
  read_ -= bytes;
}

void LogLoss::cut(std::size_t bytes) {
  cut_ = true;
  skipped_ += bytes;
}

void LogLoss::dropout(double duration_s) {
  dropouts_ += 1;
  dropout_s_ += duration_s;
}

double LogLoss::missing() const {
  if (bridged_ == 0 || !(sound_s_ > 0)) return 0;
  const auto bytes = static_cast<double>(timed_bytes_), mean = bytes / static_cast<double>(timed_);
  // From one message to the next passes what one of them takes, whole or not.
  return std::max(
      0.0, bytes / sound_s_ * bridged_s_ - static_cast<double>(bridged_bytes_) - mean * static_cast<double>(bridged_));
}

double LogLoss::share() const {
  const double lost = static_cast<double>(skipped_) + missing(), all = static_cast<double>(read_) + lost;
  return all > 0 ? lost / all : 0;
}

std::vector<std::string> LogLoss::words() const {
  std::vector<std::string> words;
  if (misplaced_ > 0) words.push_back(formatted("%zu of its messages are left out: their times fall", misplaced_));
  if (places_ > 0)
    words.push_back(
        formatted("%.2g %% of it is lost, at %zu damaged place%s", 100 * share(), places_, places_ == 1 ? "" : "s"));
  if (cut_) words.push_back("it ends within a message: cut short");
  if (dropouts_ > 0)
    words.push_back(formatted("its logger dropped messages %zu times, for %.2g s together", dropouts_, dropout_s_));
  return words;
}

}  // namespace backwash::log
