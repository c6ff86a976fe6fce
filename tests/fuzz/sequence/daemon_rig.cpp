// SPDX-License-Identifier: BSD-3-Clause
#include "tests/fuzz/sequence/daemon_rig.hpp"

#include <gtest/gtest-spi.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>

#include "core/log/raw/tick_log.hpp"
#include "core/map/load_map.hpp"
#include "core/map/octomap/octomap_message.hpp"
#include "services/backwashd/channels.hpp"
#include "services/backwashd/control/switch_reaction.hpp"

namespace backwash::fuzz {
namespace {

using daemon::test::vehicle_5in;
using Kind = Event::Kind;

constexpr double kLeap = 0.06;   // m in a tick: faster than it flies
constexpr int kDrainEvery = 50;  // ticks: the recorder's memory is bounded

const map::OccupancyGrid& room() {
  static const auto grid = map::builtin_scene("parallel-walls-4m", 0.2).value();
  return grid;
}

std::shared_ptr<const plan::World> world() {
  static const auto built = plan::build_world(room(), Model{}, vehicle_5in());
  return built;
}

}  // namespace

DaemonRig::Threads::Threads(DaemonRig& rig, daemon::Channels& channels)
    : recorder(rig.log_),
      map(channels, recorder, Model{}, vehicle_5in(), settings),
      planner(
          channels, recorder, [&rig](const auto&) { ++rig.plans_; }, [&rig] { rig.advance(); }) {}

DaemonRig::DaemonRig(const std::vector<Event>& events, daemon::test::Medium medium, MakeAutopilot* make)
    : events_(events),
      lock_({0.7, Vec3(5, -3, 0.2)}, medium, world()),
      watch_(vehicle_5in().limits.v_max),
      log_(std::filesystem::temp_directory_path() / ("backwash_sequence." + std::to_string(getpid()))) {
  for (const Event& e : events_) {
    with_maps_ = with_maps_ || (e.kind >= Kind::map_same && e.kind <= Kind::scan_box);
    with_switch_ = with_switch_ || e.kind == Kind::switch_pressed || e.kind == Kind::switch_broken;
  }
  if (make) fly(*make);
  lock_.reader = [this](const auto& sample) { return read(sample); };
  lock_.noise = [this](auto& bytes) { spoil_bytes(bytes); };
  start();
}

// With the parameters that the daemon asks for.
void DaemonRig::fly(MakeAutopilot& make) {
  const Vehicle vehicle = vehicle_5in();
  const Vec3 ground(-2, 0, vehicle.body.radius);
  constexpr double kUptime = 60;  // s: its gyros have settled
  lock_.autopilot = make({.grid = lock_.world().grid,
                          .vehicle = vehicle,
                          .ground_W = ground,
                          .frame = lock_.local_frame,
                          .uptime = kUptime});
  const std::map<std::string, double> asked{{"GUID_TIMEOUT", 0.3}, {"WPNAV_ACCEL_Z", 250}, {"PSC_JERK_XY", 20},
                                            {"PSC_JERK_Z", 20},    {"COM_OF_LOSS_T", 0.3}, {"COM_OBL_RC_ACT", 4}};
  for (const auto* autopilot : firmware_bridge::autopilots())
    bench::take_gains(*autopilot, vehicle, lock_.autopilot->parameters);
  for (auto& [name, value] : lock_.autopilot->parameters)
    if (const auto set = asked.find(name); set != asked.end()) value = set->second;
}

DaemonRig::~DaemonRig() {
  threads_.reset();
  std::filesystem::remove(log_);
}

void DaemonRig::start() {
  threads_.reset();
  late_.reset();
  std::filesystem::remove(log_);
  clock_.emplace_back(daemon::now_ns(), lock_.now_ns());
  threads_ = std::make_unique<Threads>(*this, *lock_.channels);
  if (with_maps_) offer_map(room(), map::encode_octomap(room()));
  watch_.restarted();
}

std::optional<Violation> DaemonRig::run(int ticks) try {
  while (tick_ < ticks && !violation_) {
    advance();
    if (restarts_) {
      restarts_ = false;
      lock_.channels->stop = false;
      threads_.reset();
      lock_.restart();
      start();
    }
    if (!lasting(Kind::slow_planner)) threads_->planner.step();
  }
  return violation_;
} catch (const std::exception& e) {  // a thread that ends so ends the daemon
  return Violation{tick_, std::string("exception: ") + e.what()};
}

// One tick, also while the planner waits for an answer.
void DaemonRig::advance() {
  if (violation_ || restarts_) return;
  testing::TestPartResultArray failures;
  testing::ScopedFakeTestPartResultReporter reporter(
      testing::ScopedFakeTestPartResultReporter::INTERCEPT_ONLY_CURRENT_THREAD, &failures);
  missed_ = 0;
  while (next_ < events_.size() && events_[next_].tick <= tick_) apply(events_[next_++]);
  lock_.autopilot->mute = lasting(Kind::mute) != nullptr;
  delay_segments();
  read_switch();
  const std::uint64_t segment = lock_.view().segment;
  const auto& wire = lock_.tick(missed_);
  clock_.emplace_back(daemon::now_ns(), lock_.now_ns());
  truth_.emplace_back(lock_.now_ns(), lock_.autopilot->truth().p_W);
  const auto& view = lock_.view();
  ++spent_[static_cast<std::size_t>(view.mode)];
  Seen seen{tick_, view.mode, view.armed, view.offboard, wire.silent() ? 0 : wire.bytes};
  seen.setpoints = static_cast<int>(wire.setpoints.size());
  if (seen.setpoints > 0) {
    const auto& sent = wire.setpoints.back();
    seen.setpoint = {sent.x, sent.y, sent.z};
    seen.velocity = {sent.vx, sent.vy, sent.vz};
  }
  for (const auto& c : wire.commands) {
    const bool arming = c.command == daemon::test::kCommandArm;
    seen.arms = seen.arms || (arming && c.param1 == 1);
    seen.disarms = seen.disarms || (arming && c.param1 == 0);
    seen.commands += !(arming && c.param1 == 0);
  }
  seen.switched_off = !daemon::may_fly(view.stop_switch);
  seen.accepted = view.segment != segment && view.segment != 0;
  hear_autopilot();
  if (tick_ % kDrainEvery == 0) threads_->recorder.drain(*lock_.channels);
  look();
  const auto& grid = threads_->known ? threads_->known->grid : room();
  seen.inside = grid.inside(grid.index(view.command.p_W));
  const auto broken = watch_.check(seen);
  if (broken) violation_ = {tick_, *broken};
  if (failures.size() > 0) violation_ = {tick_, failures.GetTestPartResult(0).message()};
  if (!lasting(Kind::slow_mission)) run_mission();  // what it acknowledges holds from the next tick on
  if (violation_) lock_.channels->stop = true;      // the planner returns
  ++tick_;
}

// As the GPIO thread leaves it for the control thread.
void DaemonRig::read_switch() {
  using firmware_bridge::SwitchState;
  constexpr std::array kBroken{SwitchState::lost, SwitchState::untested, SwitchState::chattering};
  if (!with_switch_) return;
  SwitchState state = SwitchState::released;
  if (const auto* e = lasting(Kind::switch_broken)) state = kBroken[static_cast<std::size_t>(e->b) % kBroken.size()];
  if (lasting(Kind::switch_pressed)) state = SwitchState::pressed;
  lock_.channels->stop_switch.state = state;
  lock_.channels->stop_switch.at_ns = INT64_MAX;
}

// An estimator that follows the VIO leaps with it, as soon as it is told: the same place then has another number.
void DaemonRig::hear_autopilot() {
  const auto said =
      lock_.link().telemetry().local_state.at(firmware_bridge::Time(std::chrono::nanoseconds(lock_.now_ns())));
  if (!said) return;
  if (autopilot_at_ && (said->value.p_W - *autopilot_at_).norm() > kLeap) watch_.frame_moved(tick_);
  autopilot_at_ = said->value.p_W;
}

void DaemonRig::look() {
  auto& from = lock_.channels->worlds.reader;
  if (const auto* newest = from.take()) {
    threads_->known = newest->world;
    from.give_back(newest);
  }
}

// As services/backwashd/plan/run_mission.cpp's thread.
void DaemonRig::run_mission() {
  auto& channels = *lock_.channels;
  daemon::MissionInput in;
  in.now_s = static_cast<double>(lock_.now_ns()) * 1e-9;
  in.view = channels.view_mission.read_new();
  if (const auto* newest = channels.worlds.mission.take()) {
    in.world = newest->world;
    channels.worlds.mission.give_back(newest);
  }
  std::vector<daemon::PlanOutcome> outcomes;
  while (const auto outcome = channels.outcomes.pop()) outcomes.push_back(*outcome);
  in.outcomes = outcomes;
  carry_out(threads_->mission.observe(in));
  while (const auto command = channels.commands.pop()) {
    const auto decision = threads_->mission.handle(*command, in.now_s);
    const bool done = carry_out(decision);
    if (decision.answer) record(*command, *decision.answer);
    const bool decided = decision.order || decision.job;  // else it is an answer given once more
    if (done && decided && command->verb == backwash_msgs_msg_dds__COMMAND_STOP) watch_.stop_given(tick_);
    if (done && decided && decision.answer->result == backwash_msgs_msg_dds__ACK_ACCEPTED)
      watch_.acknowledged(command->verb, tick_);
  }
}

bool DaemonRig::carry_out(const daemon::Decision& decision) {
  auto& channels = *lock_.channels;
  channels.jobs.collect();
  if (decision.order && !channels.orders.push(*decision.order)) return false;
  if (decision.job) channels.jobs.offer(std::make_unique<const daemon::PlanJob>(*decision.job));
  return true;
}

// A segment on its way is one that took longer to plan.
void DaemonRig::delay_segments() {
  if (!lasting(Kind::late_segment)) {
    if (late_) lock_.channels->segments.offer(std::move(late_));
    return;
  }
  if (const auto* offered = lock_.channels->segments.take()) late_.reset(offered);
}

const Event* DaemonRig::lasting(Kind kind) const {
  const auto found = lasting_.find(kind);
  return found != lasting_.end() && tick_ < found->second.tick + found->second.n ? &found->second : nullptr;
}

// As services/backwashd's dds_front.cpp and daemon.cpp do.
void DaemonRig::record(const daemon::CommandMessage& c, const daemon::Answer& a) {
  char line[160];
  std::snprintf(line, sizeof line, "%s %llu %u verb %u (%.3f, %.3f, %.3f) yaw %.3f writer 1", c.station.data(),
                static_cast<unsigned long long>(c.session), c.sequence, c.verb, c.position.x(), c.position.y(),
                c.position.z(), c.yaw);
  threads_->recorder.append(log::RecordKind::command, line);
  threads_->recorder.append(log::RecordKind::ack, std::string(c.station.data()) + " " + std::to_string(c.sequence) +
                                                      " result " + std::to_string(a.result) + ": " + a.reason);
}

log::RawLog DaemonRig::logged() {
  threads_->recorder.drain(*lock_.channels);
  auto log = log::read_raw_log(log_).value();
  for (auto& record : log.records) {
    const auto then = std::ranges::upper_bound(clock_, record.header.t_ns, {}, &decltype(clock_)::value_type::first);
    record.header.t_ns = (then == clock_.begin() ? then : then - 1)->second;
  }
  const std::size_t others = log.records.size();
  log.records.insert(log.records.end(), lock_.log.begin(), lock_.log.end());
  std::vector<std::pair<std::int64_t, const log::RawRecord*>> order;  // the first two kinds are written at the start
  for (std::size_t n = 0; n < log.records.size(); ++n) {
    const auto& header = log.records[n].header;
    const std::int64_t turn = 2 * (header.t_ns / 1'000'000'000) + (n < others);
    order.emplace_back(header.kind == log::RecordKind::part        ? 0
                       : header.kind == log::RecordKind::constants ? 1
                                                                   : turn,
                       &log.records[n]);
  }
  std::ranges::stable_sort(order, {}, &decltype(order)::value_type::first);
  log::RawLog sorted;
  for (const auto& [turn, record] : order) sorted.records.push_back(*record);
  return sorted;
}

std::optional<std::string> DaemonRig::replayed() {
  const auto replay = log::replay(logged(), "log");
  if (!replay) return replay.error().message;
  if (replay->ticks_missing > 0) return std::to_string(replay->ticks_missing) + " ticks are missing in the log";
  if (!replay->first) return std::nullopt;
  return "replay differs in " + replay->first->field + " of tick " + std::to_string(replay->first->tick);
}

}  // namespace backwash::fuzz
