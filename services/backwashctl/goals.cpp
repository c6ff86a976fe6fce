// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashctl/goals.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <cstdio>

#include "services/backwashctl/answer.hpp"

namespace backwash::ctl {
namespace {

constexpr double kOldest_s = 5;  // of a stamp, either way
constexpr double kLevel = 0.1;   // rad by which a heading may be tilted
constexpr double kPlan_s = 2;    // a plan that is refused is refused within

std::string number(double value) {
  char said[32];
  std::snprintf(said, sizeof said, "%.2f", value);
  return said;
}

std::string words(const Goal& goal) {
  const Vec3& p = goal.p_W;
  return number(p.x()) + "," + number(p.y()) + "," + number(p.z()) +
         (goal.yaw ? " facing " + number(*goal.yaw) + " rad" : "");
}

/// What became of a goal that was sent.
Outcome go(Station& station, const Goal& goal) {
  Outcome outcome{"goals", false, std::nullopt, ""};
  const auto verb = goal.yaw ? backwash_msgs_msg_dds__COMMAND_GOTO_FACING : backwash_msgs_msg_dds__COMMAND_GOTO;
  const auto answer = station.send(verb, goal.p_W, goal.yaw.value_or(0));
  if (!answer) {
    outcome.why = interrupted() ? "interrupted" : "no daemon answered; is backwashd running?";
  } else if (answer->result != backwash_msgs_msg_dds__ACK_ACCEPTED) {
    outcome.why = "refused: " + answer->reason;
  } else {
    outcome.accepted = true;
    station.status(1.0);  // the first may still be from before the acknowledgement
    station.status(1.0);
    station.wait(
        kPlan_s, [](const StatusCopy& s) { return s.said.moving; },
        [&](const StatusCopy& s) {
          if (!station.superseded(s) && s.text(&dds::Status::task).starts_with(kRefusedTask))
            outcome.why = s.text(&dds::Status::task);
          return station.superseded(s) || !outcome.why.empty();
        });
  }
  return outcome;
}

}  // namespace

tl::expected<Goal, std::string> goal_of(const dds::PoseStamped& message, const GoalRules& rules, std::int64_t now_ns) {
  const std::string frame = message.header.frame_id ? message.header.frame_id : "";
  if (frame != rules.frame)
    return tl::make_unexpected("header.frame_id is '" + frame + "', expected '" + rules.frame +
                               "': set RViz's fixed frame to it, or give --frame");
  const std::int64_t stamp = dds::nanoseconds(message.header.stamp);
  const double age_s = static_cast<double>(now_ns - stamp) * 1e-9;
  if (stamp != 0 && std::abs(age_s) > kOldest_s)
    return tl::make_unexpected("header.stamp is " + number(age_s) + " s old, expected at most " + number(kOldest_s) +
                               " s: it was held back, or its sender's clock differs from this machine's");
  const auto& [p, q] = message.pose;
  Goal goal{{p.x, p.y, p.z}, std::nullopt};
  if (rules.height) goal.p_W.z() = *rules.height;
  if (!goal.p_W.allFinite()) return tl::make_unexpected("pose.position is not finite");
  if (!rules.height && p.z == 0)
    return tl::make_unexpected("pose.position.z is 0, as RViz's goal on the ground plane has it: give --height");
  const Eigen::Quaterniond heading(q.w, q.x, q.y, q.z);
  if (!rules.facing || heading.coeffs().isZero(0)) return goal;
  if (!(std::abs(heading.norm() - 1) < 0.01))
    return tl::make_unexpected("pose.orientation has length " + number(heading.norm()) +
                               ", expected 1, or 0 for no heading");
  const Eigen::Matrix3d rotation = heading.normalized().toRotationMatrix();
  if (!(rotation(2, 2) > std::cos(kLevel)))
    return tl::make_unexpected("pose.orientation is tilted by " + number(std::acos(rotation(2, 2))) +
                               " rad: a vehicle hovers level, at most " + number(kLevel) +
                               " rad; or give --heading path");
  goal.yaw = std::atan2(rotation(1, 0), rotation(0, 0));
  return goal;
}

int serve_goals(Station& station, const std::string& topic, const GoalRules& rules, bool json) {
  dds::Reader<dds::PoseStamped> goals(station.participant(), geometry_msgs_msg_dds__PoseStamped__desc, topic,
                                      dds::Delivery::reliable);
  dds::WaitSet waitset(station.participant());
  waitset.add(goals);
  if (!json)
    std::printf("goals of %s in frame %s are flown to until this is interrupted\n", topic.c_str(), rules.frame.c_str());
  std::fflush(stdout);
  while (!interrupted()) {
    std::optional<tl::expected<Goal, std::string>> newest;
    waitset.wait(0.1);
    goals.take([&](const dds::PoseStamped& message) {
      newest = goal_of(message, rules, dds::nanoseconds(dds::wall_clock()));
    });
    if (!newest || interrupted()) continue;
    const Outcome outcome =
        *newest ? go(station, **newest) : Outcome{"goals", false, std::nullopt, "refused: " + newest->error()};
    if (*newest) station.release();
    if (!json && outcome.good()) std::printf("%s: accepted\n", words(**newest).c_str());
    say(outcome, json);
    std::fflush(stdout);
  }
  return 0;
}

}  // namespace backwash::ctl
