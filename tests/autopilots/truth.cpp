// SPDX-License-Identifier: BSD-3-Clause
#include "tests/autopilots/truth.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cmath>
#include <map>
#include <sstream>
#include <vector>

#include "firmware_bridge/mavlink/frames.hpp"
#include "services/backwashd/channels.hpp"
#include "tests/autopilots/peer.hpp"

namespace backwash::autopilots {
namespace {

constexpr double kMetresPerStep = 0.011131884502145034;  // of 1e-7 degrees of latitude
constexpr double kHalfStep = 0.0056;                     // m: half a step of the position, horizontal or vertical

class ArduPilotTruth : public TruthSource {
 public:
  explicit ArduPilotTruth(const std::string& device) : peer_(device, 254, 190) { ask(); }

  std::optional<Truth> newest() override {
    std::optional<Truth> last;
    peer_.poll([&](const mavlink::Sender&, const auto& m) {
      if constexpr (std::is_same_v<std::decay_t<decltype(m)>, mavlink::SimState>) last = take(m);
    });
    if (!last && daemon::now_ns() - asked_ns_ > 1'000'000'000) ask();
    return last;
  }

 private:
  void ask() {  // SET_MESSAGE_INTERVAL, again until the first comes
    asked_ns_ = daemon::now_ns();
    peer_.send(mavlink::CommandLong{mavlink::SimState::kId, 10'000, 0, 0, 0, 0, 0, 511, 1, 1, 0});
  }

  Truth take(const mavlink::SimState& m) {
    asked_ns_ = daemon::now_ns();
    Truth t;
    t.at_ns = daemon::now_ns();
    t.v_E = mavlink::swap_ned({m.vn, m.ve, m.vd});
    t.q_EB = mavlink::swap_ned_frd(Eigen::Quaterniond(m.q1, m.q2, m.q3, m.q4).normalized());
    t.omega_B = mavlink::swap_frd({m.xgyro, m.ygyro, m.zgyro});
    if (!first_) first_ = m, last_ = t;
    const double north = (m.lat_int - first_->lat_int) * kMetresPerStep;
    const double east =
        (m.lon_int - first_->lon_int) * kMetresPerStep * std::cos(first_->lat_int * 1e-7 * 3.14159265358979 / 180);
    const Vec3 step(east, north, static_cast<double>(m.alt) - static_cast<double>(first_->alt));
    const double dt = static_cast<double>(t.at_ns - last_.at_ns) * 1e-9;
    const Vec3 p = last_.p_E + dt / 2 * (last_.v_E + t.v_E);
    t.p_E = p.cwiseMax(step - Vec3::Constant(kHalfStep)).cwiseMin(step + Vec3::Constant(kHalfStep));
    return last_ = t;
  }

  Peer peer_;
  std::int64_t asked_ns_ = 0;
  std::optional<mavlink::SimState> first_;
  Truth last_;
};

/// The fields of what `listener` prints, sample by sample: "name: value", lists in brackets.
class ListenerFile {
 public:
  explicit ListenerFile(const std::string& path) : fd_(::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC)) {
    if (fd_.get() < 0) throw std::runtime_error(path + ": cannot be read");
  }
  using Sample = std::map<std::string, std::vector<double>>;

  /// Calls take(sample) for each that is complete, which a line of its next one shows.
  template <class Take>
  void poll(Take&& take) {
    std::array<char, 8192> bytes;
    for (ssize_t n; (n = ::read(fd_.get(), bytes.data(), bytes.size())) > 0;) text_.append(bytes.data(), n);
    for (std::size_t end; (end = text_.find('\n')) != text_.npos; text_.erase(0, end + 1)) {
      const std::string line = text_.substr(0, end);
      if (line.find("TOPIC:") != line.npos) {
        if (!sample_.empty()) take(sample_);
        sample_.clear();
      } else if (const auto colon = line.find(": "); colon != line.npos) {
        std::string values = line.substr(colon + 2);
        if (const auto remark = values.find(" ("); remark != values.npos) values.resize(remark);
        for (char& c : values)
          if (c == '[' || c == ']' || c == ',') c = ' ';
        std::istringstream in(values);
        auto& into = sample_[line.substr(line.find_first_not_of(" \t"), colon - line.find_first_not_of(" \t"))];
        for (double v; in >> v;) into.push_back(v);
      }
    }
  }

 private:
  firmware_bridge::FileDescriptor fd_;
  std::string text_;
  Sample sample_;
};

class Px4Truth : public TruthSource {
 public:
  Px4Truth(const std::string& position, const std::string& attitude) : position_(position), attitude_(attitude) {}

  std::optional<Truth> newest() override {
    std::optional<Truth> last;
    attitude_.poll([&](ListenerFile::Sample& s) {
      if (const auto& q = s["q"]; q.size() == 4)
        q_EB_ = mavlink::swap_ned_frd(Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized());
    });
    position_.poll([&](ListenerFile::Sample& s) {
      for (const char* key : {"timestamp_sample", "x", "y", "z", "vx", "vy", "vz"})
        if (s[key].size() != 1) return;
      Truth t;
      // PX4's clock is ours but for a constant: what arrives soonest after its stamp tells it.
      const std::int64_t stamp_ns = static_cast<std::int64_t>(s["timestamp_sample"][0]) * 1000;
      behind_ns_ = std::min(behind_ns_, daemon::now_ns() - stamp_ns);
      t.at_ns = stamp_ns + behind_ns_;
      t.p_E = mavlink::swap_ned({s["x"][0], s["y"][0], s["z"][0]});
      if (!first_) first_ = t.p_E;
      t.p_E -= *first_;
      t.v_E = mavlink::swap_ned({s["vx"][0], s["vy"][0], s["vz"][0]});
      t.q_EB = q_EB_;
      last = t;
    });
    return last;
  }

 private:
  ListenerFile position_, attitude_;
  Eigen::Quaterniond q_EB_ = Eigen::Quaterniond::Identity();
  std::optional<Vec3> first_;
  std::int64_t behind_ns_ = std::numeric_limits<std::int64_t>::max();
};

}  // namespace

std::unique_ptr<TruthSource> ardupilot_truth(const std::string& device) {
  return std::make_unique<ArduPilotTruth>(device);
}

std::unique_ptr<TruthSource> px4_truth(const std::string& position_file, const std::string& attitude_file) {
  return std::make_unique<Px4Truth>(position_file, attitude_file);
}

}  // namespace backwash::autopilots
