// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwash/fly/flight_story.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "core/log/raw/tick_log.hpp"
#include "core/report/recorded_parts.hpp"
#include "core/types/text.hpp"
#include "services/backwash/asked.hpp"

namespace backwash::services {
namespace {

constexpr double kGap = 0.1;  // s without odometry that is worth telling

Vec3 vec(const double* v) { return {v[0], v[1], v[2]}; }

/// Changes of the mode that are part of a flight that goes as it was asked for.
bool as_asked(Reason reason) {
  using enum Reason;
  constexpr std::array kAsked{started, enabled,   operator_request, autopilot_follows, segment_accepted, disarmed,
                              landed,  land_sent, land_requested,   stop_requested,    takeoff_accepted, lifted_off};
  return std::ranges::find(kAsked, reason) != kAsked.end();
}

bool airborne(const track::AutopilotFacts& facts) {
  if (!facts.armed) return false;
  return facts.landed ? !*facts.landed : facts.in_air.value_or(false);
}

/// Goes through the records in their order.
class Teller {
 public:
  Teller(FlightStory& story, const log::RawLog& log, const Vehicle& vehicle, const log::FlightLog* truth)
      : story_(story),
        segments_(report::recorded_segments(log.records)),
        maps_(log, story.zero_ns, vehicle),
        truth_error_(truth ? vehicle.estimation.position : 0) {
    if (truth) truth_.emplace(*truth);
  }

  void take(const log::RawRecord& record) {
    now_s_ = 1e-9 * static_cast<double>(record.header.t_ns - story_.zero_ns);
    using enum log::RecordKind;
    const auto kind = record.header.kind;
    const std::string text(record.bytes.begin(), record.bytes.end());
    if (kind == odometry) take_odometry(record.header.t_ns);
    if (kind == tick_input)
      if (const auto* input = log::payload<log::TickInputRecord>(record)) take_input(*input);
    if (kind == tick)
      if (const auto* row = log::payload<log::TickRecord>(record)) take_tick(*row, record.header.t_ns);
    for (const auto& news : air_.take(record)) say("air", news);
    if (kind == command) take_command(text);
    if (kind == ack) take_answer(text);
    if (kind == failure) {
      failure_ = text;
      say("fault", "the daemon ended itself: " + text);
    }
    if (kind == lost)
      if (const auto* lost_records = log::payload<log::LostRecord>(record)) {
        story_.records_lost = lost_records->records;
        say("fault", std::to_string(lost_records->records) + " records were lost by now: the disk did not take them");
      }
    if (kind == world && text.starts_with("window: ") && text.ends_with("nothing beyond")) say("map", text);
    if (kind == log::RecordKind::map)
      if (const auto* head = log::payload<log::MapRecord>(record))
        say("map", head->accepted ? "a map was accepted" : "a map was refused");
  }

  void finish(bool cut, const std::string& because) {
    open_ = false;
    close_mode();
    story_.maps = maps_.maps();
    std::ranges::stable_sort(story_.timeline.events, {}, &report::TimelineEvent::t_s);  // of several threads
    story_.time_s = story_.samples.empty() ? std::max(now_s_, 0.0) : last_tick_s_.value();
    if (!last_tick_s_)
      story_.ended = "no control tick was recorded";
    else if (in_air_)
      story_.ended = "in the air, in mode " + mode() + " (" + reason() + ")";
    else
      story_.ended = "on the ground, in mode " + mode() + " (" + reason() + ")";
    if (cut) story_.ended += "; the last record is cut short: the process or the power was gone";
    judge(because);
  }

 private:
  std::string mode() const { return kModeNames[std::min<std::size_t>(mode_, kModeNames.size() - 1)]; }
  std::string reason() const { return kReasonNames[std::min<std::size_t>(reason_, kReasonNames.size() - 1)]; }
  void say(const char* kind, const std::string& text) { story_.timeline.events.push_back({now_s_, kind, text}); }

  void take_odometry(std::int64_t t_ns) {
    const double gap_s = odometry_ns_ ? 1e-9 * static_cast<double>(t_ns - *odometry_ns_) : 0;
    if (gap_s > kGap) say("vio", "the first odometry after " + to_text(gap_s, 2) + " s");
    odometry_ns_ = t_ns;
  }

  void take_input(const log::TickInputRecord& record) {
    const auto input = log::decode(record, nullptr);
    in_air_ = airborne(input.autopilot);
    if (input.odometry && input.odometry->closures != closures_) {
      closures_ = input.odometry->closures;
      say("vio", "loop closure " + std::to_string(closures_));
    }
    const auto resets = input.autopilot.reset_counter;
    if (resets && resets_ && *resets != *resets_) say("vio", "the autopilot's estimator was reset");
    if (resets) resets_ = resets;
  }

  void take_command(const std::string& text) {
    const auto asked = asked_for(text);
    if (!asked || asked->session) return;
    if (asked->what != asked_) say("command", asked->what);  // a station repeats itself until it is answered
    asked_ = asked->what;
    if (!asked->beside) ordered_ = asked->ends;
  }

  void take_answer(const std::string& text) {
    const auto at = text.find(" result ");
    unsigned result = 0;
    asked_.clear();
    if (at == text.npos || std::sscanf(text.c_str() + at, " result %u:", &result) != 1 || result == 0) return;
    ordered_ = false;
    ++story_.refusals;
    const auto why = text.find(": ", at);
    last_refusal_ = why == text.npos ? text : text.substr(why + 2);
    say("command", "refused: " + last_refusal_);
  }

  void take_tick(const log::TickRecord& tick, std::int64_t t_ns) {
    if (!last_tick_s_ || tick.mode != mode_ || tick.reason != reason_) take_mode(tick);
    last_tick_s_ = now_s_;
    const bool flying = tick.segment != 0 && (tick.judged || in_air_);
    StorySample s{now_s_, vec(tick.p), vec(tick.cmd_p), tick.judged != 0, tick.inside != 0, in_air_, Vec3::Zero(), {}};
    const auto true_W =
        truth_ ? truth_->at(1e-9 * static_cast<double>(t_ns), "x_m", "y_m", "z_m") : std::optional<Vec3>();
    s.p_W = true_W.value_or(s.p_W);
    story_.beyond_truth += truth_ && !true_W;
    if (s.judged) take_verdict(tick, s);
    if (in_air_ && !was_in_air_) {
      ++story_.take_offs;
      say("flight", "in the air");
    }
    if (!in_air_ && was_in_air_) {
      ++story_.landings;
      say("flight", "on the ground");
    }
    if (in_air_ && was_in_air_ && !story_.samples.empty())
      story_.length_m += (s.p_W - story_.samples.back().p_W).norm();
    was_in_air_ = in_air_;
    flown_ &= in_air_;
    if (flying) take_piece(tick, s);
    if (in_air_ && open_) measure(tick, t_ns, s);
    story_.samples.push_back(s);
  }

  // On its way up and down a vehicle comes as near to the floor as it will.
  void measure(const log::TickRecord& tick, std::int64_t t_ns, StorySample& s) {
    const auto m = static_cast<Mode>(tick.mode);
    const bool steered = m == Mode::tracking || m == Mode::hold;
    if (story_.pieces.back().take_off) {
      if (steered || m == Mode::lifting) maps_.judge_rising(t_ns, s.p_W);
    } else if (steered) {
      if (s.judged) maps_.judge_set(t_ns, tick);
      s.clearance_m = maps_.clearance(t_ns, s.p_W);
      if (s.clearance_m) story_.clearance_m = std::min(story_.clearance_m.value_or(*s.clearance_m), *s.clearance_m);
    }
  }

  void take_mode(const log::TickRecord& tick) {
    const auto said = static_cast<Reason>(tick.reason);
    close_mode();
    if (open_ && ordered_) end_by_order(story_.pieces.back());
    if (!last_tick_s_ || tick.mode != mode_) {
      const std::string from = !last_tick_s_ ? "" : mode() + " → ";
      mode_ = tick.mode;
      reason_ = tick.reason;
      say("mode", from + mode() + ": " + reason());
      story_.holds += static_cast<Mode>(tick.mode) == Mode::hold;
      if (in_air_ && static_cast<Mode>(tick.mode) != Mode::passive) fault_ = as_asked(said) ? "" : reason();
    }
    mode_ = tick.mode;
    reason_ = tick.reason;
    story_.timeline.modes.push_back({now_s_, now_s_, mode(), reason()});
    if (as_asked(said) || static_cast<Mode>(tick.mode) == Mode::tracking) return;
    last_fault_ = reason();
    if (open_ && story_.pieces.back().fault.empty()) story_.pieces.back().fault = reason();
  }

  void close_mode() {  // the newest one lasts until now
    if (!story_.timeline.modes.empty()) story_.timeline.modes.back().until_s = now_s_;
  }

  // What a fault has ended no order ends.
  static void end_by_order(StoryPiece& piece) { piece.by_order |= !piece.to_its_end && piece.fault.empty(); }

  void take_verdict(const log::TickRecord& tick, StorySample& s) {
    ++story_.judged;
    story_.inside += s.inside;
    const Vec3 error = vec(tick.p) - vec(tick.center);
    for (int axis = 0; axis < 3; ++axis) {
      const double h = tick.half_widths[axis];
      s.error_over_bound[axis] = h > 0 ? std::abs(error[axis]) / h : 0;
      story_.largest_ratio[axis] = std::max(story_.largest_ratio[axis], s.error_over_bound[axis]);
    }
  }

  void take_piece(const log::TickRecord& tick, const StorySample& s) {
    if (!open_ || tick.segment != segment_) {
      const auto known = std::ranges::find(segments_, tick.segment, [](auto& known_one) { return known_one.head.id; });
      // A lift-off alone is no segment: the rise that follows is the same take-off.
      const bool goes_on = open_ && known != segments_.end() &&
                           (known->head.continues != 0 || (commands_ == 0 && report::vertical(*known)));
      if (!goes_on) {
        if (open_ && ordered_) end_by_order(story_.pieces.back());
        story_.pieces.push_back({});
        auto& piece = story_.pieces.back();
        piece.take_off = known == segments_.end() || (report::vertical(*known) && !flown_);
        piece.from_s = now_s_;
      }
      open_ = true;
      ordered_ = false;
      segment_ = tick.segment;
      commands_ = known != segments_.end() ? known->commands.size() : 0;
      story_.pieces.back().goal_W = commands_ > 0 ? known->commands.back().p_W : s.command_W;
    }
    auto& piece = story_.pieces.back();
    piece.until_s = now_s_;
    flown_ |= in_air_;
    piece.samples += s.judged;
    piece.inside += s.judged && s.inside;
    const auto m = static_cast<Mode>(tick.mode);
    if (m == Mode::tracking && commands_ > 0 && tick.index + 1 >= commands_) {
      piece.to_its_end = true;
      piece.goal_error_m = (s.p_W - piece.goal_W).norm();
      const Vec3 h(tick.half_widths[kX], tick.half_widths[kY], tick.half_widths[kZ]);
      piece.reached = piece.goal_error_m <= h.norm() + truth_error_ || !tick.judged;
    } else if (!piece.to_its_end) {
      piece.goal_error_m = (s.p_W - piece.goal_W).norm();
    }
    if (m == Mode::tracking) piece.fault.clear();
    if (ordered_) end_by_order(piece);
    piece.by_order &= !piece.to_its_end;
  }

  void judge(const std::string& because) {
    auto& wrong = story_.wrong;
    if (!because.empty()) wrong.push_back(because);
    if (!failure_.empty()) wrong.push_back("the daemon ended itself: " + failure_);
    if (story_.take_offs == 0) {
      const std::string fault = last_fault_.empty() ? "nothing asked it to" : last_fault_;
      wrong.push_back("the vehicle never took off: " + (last_refusal_.empty() ? fault : "refused: " + last_refusal_));
    }
    if (in_air_) wrong.push_back("the log ends " + story_.ended);
    if (story_.touched())
      wrong.push_back("an obstacle was touched (clearance " +
                      to_text(std::min(story_.clearance_m.value_or(1), story_.maps.beside_m.value_or(1)), 3) + " m)" +
                      unless_freed(story_.maps));
    if (story_.inside != story_.judged)
      wrong.push_back(std::to_string(story_.judged - story_.inside) + " of " + std::to_string(story_.judged) +
                      " samples lay outside the set predicted for them; all must lie inside");
    for (const auto& piece : story_.pieces)
      if (!piece.take_off && !piece.reached && !piece.by_order)
        wrong.push_back("the goal " + to_text(piece.goal_W) + " was missed by " + to_text(piece.goal_error_m, 2) +
                        " m" + (piece.fault.empty() ? "" : ": " + piece.fault));
    if (!fault_.empty()) wrong.push_back("the flight did not end as it was asked to: " + fault_);
  }

  FlightStory& story_;
  const std::vector<report::RecordedSegment> segments_;
  MapJudge maps_;
  double truth_error_;  ///< m, of what the vehicle measures against the truth
  std::optional<report::TruthRows> truth_;
  double now_s_ = 0;
  std::optional<double> last_tick_s_;
  std::uint32_t mode_ = 0, reason_ = 0, closures_ = 0;
  std::optional<std::int64_t> odometry_ns_;                   ///< of the newest sample
  std::optional<std::uint8_t> resets_;                        ///< as the autopilot counts its estimator's
  bool in_air_ = false, was_in_air_ = false, flown_ = false;  ///< `flown_`: a piece was, since it left the ground
  bool open_ = false;                                         ///< a piece is being flown
  bool ordered_ = false;  ///< an operator has asked for something since the piece began
  std::uint64_t segment_ = 0;
  std::size_t commands_ = 0;  ///< of the segment
  report::AirNews air_;
  std::string asked_, last_refusal_, failure_;
  std::string fault_;       ///< why the last change of the mode in the air was none that was asked for
  std::string last_fault_;  ///< the newest of them at all
};

}  // namespace

bool FlightStory::goal_reached() const noexcept {
  const auto route = [](const StoryPiece& p) { return !p.take_off; };
  return std::ranges::any_of(pieces, route) &&
         std::ranges::all_of(pieces, [&](const StoryPiece& p) { return p.take_off || p.reached || p.by_order; });
}

FlightStory flight_story(const log::RawLog& log, const Vehicle& vehicle, const log::FlightLog* truth,
                         const std::string& because) {
  FlightStory story;
  story.zero_ns = report::first_tick_ns(log.records);
  story.by_truth = truth != nullptr;
  story.cut_at = log.cut_at;
  story.replay = log::replay(log, "the log");
  Teller teller(story, log, vehicle, truth);
  for (const auto& record : log.records) teller.take(record);
  teller.finish(log.cut_at.has_value(), because);
  return story;
}

}  // namespace backwash::services
