// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashctl/station.hpp"

#include <algorithm>
#include <chrono>
#include <csignal>
#include <random>
#include <thread>

#include "services/command_line/exit_code.hpp"
#include "services/security/credentials.hpp"

namespace backwash::ctl {
namespace {

using Clock = std::chrono::steady_clock;

double since(Clock::time_point t) { return std::chrono::duration<double>(Clock::now() - t).count(); }

std::string text(const char* s) { return s ? s : ""; }

std::uint64_t draw_session() {
  std::random_device random;
  return std::uint64_t{random()} << 32 | random();
}

volatile std::sig_atomic_t signal_that_came = 0;

}  // namespace

const std::string& judged(const std::string& folder) {
  if (!folder.empty())
    if (const auto credentials = security::read_credentials(folder); !credentials)
      throw StartError(kConfiguration, "--security: " + credentials.error());
  return folder;
}

void end_waits_on_signals() {
  for (const int signal : {SIGINT, SIGTERM}) std::signal(signal, [](int which) { signal_that_came = which; });
}

int interrupted() noexcept { return signal_that_came; }

StatusCopy copy_of(const dds::Status& status) {
  StatusCopy copy;
  copy.said = status;
  auto texts = std::make_shared<std::deque<std::string>>();
  dds::each_status_member([&](const auto& member) {
    auto& said = copy.said.*member.at;
    if constexpr (std::is_same_v<decltype(said), char*&>) said = texts->emplace_back(text(said)).data();
  });
  copy.texts = std::move(texts);
  for (std::uint32_t n = 0; n < status.parameters._length; ++n)
    copy.parameters.emplace_back(text(status.parameters._buffer[n].name), status.parameters._buffer[n].value);
  for (std::uint32_t n = 0; n < status.advice._length; ++n)
    copy.advice.emplace_back(text(status.advice._buffer[n].name), text(status.advice._buffer[n].text));
  copy.said.parameters = {};
  copy.said.advice = {};
  return copy;
}

Station::Station(const Options& options, const std::vector<std::string>& more)
    : options_(options),
      session_(draw_session()),
      participant_(static_cast<std::uint32_t>(options.domain), options.interface,
                   {.topics = dds::topics(options.name_space, more)}, judged(options.security)),
      acks_(dds::make_reader<dds::Ack>(participant_, options.name_space)),
      statuses_(dds::make_reader<dds::Status>(participant_, options.name_space)),
      waitset_(participant_) {
  waitset_.add(acks_);
  waitset_.add(statuses_);
}

Station::~Station() {
  if (holds_ && !interrupted() && commands_->matched() > 0) release();
}

std::optional<Station::Result> Station::send(std::uint8_t verb, const Vec3& position, double yaw,
                                             const std::vector<Vec3>& waypoints,
                                             const std::function<bool()>& given_up) {
  try {
    if (!commands_) commands_.emplace(dds::make_writer<dds::Command>(participant_, options_.name_space));
  } catch (const dds::NotPermitted& e) {
    return Result{backwash_msgs_msg_dds__ACK_REFUSED, e.what()};
  }
  dds::Command command{};
  command.station = dds::c_string(options_.station);
  command.session = session_;
  command.sequence_number = ++sequence_;
  command.verb = verb;
  command.position = {position.x(), position.y(), position.z()};
  command.yaw = yaw;
  std::vector<geometry_msgs_msg_dds__Point_> points;
  points.reserve(waypoints.size());
  for (const Vec3& p : waypoints) points.push_back({p.x(), p.y(), p.z()});
  const auto count = static_cast<std::uint32_t>(points.size());
  command.waypoints = {count, count, points.data(), false};
  return ask(command, given_up);
}

std::optional<Station::Result> Station::ask(const dds::Command& command, const std::function<bool()>& given_up) {
  constexpr double kRepeat = 0.5;  // s
  const auto begun = Clock::now();
  const auto goes_on = [&] { return !interrupted() && !(given_up && given_up()) && since(begun) < options_.timeout_s; };
  while (goes_on() && commands_->matched() == 0) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  std::optional<Result> result;
  auto sent = Clock::time_point{};
  while (!result && goes_on()) {
    if (since(sent) > kRepeat) {
      commands_->write(command);
      sent = Clock::now();
    }
    waitset_.wait(0.05);
    statuses_.take([](const dds::Status&) {});  // or the next wait would return at once
    acks_.take([&](const dds::Ack& ack) {
      const bool ours = std::ranges::equal(ack.writer, commands_->guid());
      if (ours && ack.session == session_ && ack.sequence_number == sequence_)
        result = Result{ack.result, text(ack.reason)};
    });
  }
  holds_ = result && result->result != backwash_msgs_msg_dds__ACK_NOT_YOURS;
  return result;
}

void Station::release(const std::function<bool()>& given_up) {
  send(backwash_msgs_msg_dds__COMMAND_RELEASE, Vec3::Zero(), 0, {}, given_up);
  session_ = draw_session();
  sequence_ = 0;
  holds_ = false;
}

std::optional<StatusCopy> Station::status(double timeout_s) {
  const auto begun = Clock::now();
  std::optional<StatusCopy> newest;
  while (!interrupted() && !newest && since(begun) < timeout_s) {
    waitset_.wait(0.05);
    acks_.take([](const dds::Ack&) {});
    statuses_.take([&](const dds::Status& s) { newest = copy_of(s); });
  }
  return newest;
}

bool Station::wait(double timeout_s, const std::function<bool(const StatusCopy&)>& done,
                   const std::function<bool(const StatusCopy&)>& failed) {
  const auto begun = Clock::now();
  while (!interrupted() && since(begun) < timeout_s) {
    const auto now = status(1.0);
    if (!now) continue;
    if (done(*now)) return true;
    if (failed(*now)) return false;
  }
  return false;
}

}  // namespace backwash::ctl
