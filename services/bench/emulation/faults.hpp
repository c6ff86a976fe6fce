// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <deque>
#include <limits>
#include <optional>
#include <random>
#include <string>
#include <tl/expected.hpp>
#include <utility>
#include <vector>

#include "core/config/config.hpp"
#include "core/map/occupancy_grid.hpp"
#include "core/types/state.hpp"

namespace backwash::bench {

/// What is done to a channel from `from` until `until`, s. README.md has the file and what each kind does to each
/// channel.
struct Fault {
  enum class Channel { odometry, up, down, map };  ///< up: to the autopilot
  enum class Kind { off, stuck, garbage, wrong, slow, delayed, intermittent };
  Channel channel = Channel::odometry;
  Kind kind = Kind::off;
  double from = 0, until = 0;
  Vec3 offset = Vec3::Zero();  ///< wrong: of the odometry, of the map, m
  double yaw = 0;              ///< wrong: of the odometry, rad
  double rate = 0;             ///< slow: messages/s; bytes/s on a link
  double delay = 0;            ///< delayed, s
  double on = 0, off = 0;      ///< intermittent: passes for `on`, then nothing for `off`, s
};

/// What the flight shall have kept.
struct Expectation {
  enum class What { landed, airborne, moved, speed, clearance };
  What what = What::landed;
  double at = 0;     ///< landed, airborne: when, s
  double limit = 0;  ///< moved (m from where the first fault began), speed (m/s): at most; clearance (m): at least
};

/// A timeline file. Its times count from arming, or from the bench's start.
struct Timeline {
  bool after_arming = true;
  std::vector<Fault> faults;
  std::vector<Expectation> expectations;
  std::vector<Fault> of(Fault::Channel channel) const;
};
/// Error: one line that names file, line, key, value and what would be right.
tl::expected<Timeline, config::ConfigError> load_timeline(const std::string& path);
const char* name_of(Fault::Channel channel);
const char* name_of(Fault::Kind kind);

using Bytes = std::vector<std::uint8_t>;
struct VioSample {
  State estimate{};
  Eigen::Quaterniond q{1, 0, 0, 0};
  double stamp = 0;  ///< s
};
struct MapMessage {
  map::OccupancyGrid grid;
  bool garbage = false;  ///< to be sent as random bytes
};

/// One channel with its faults. It has no clock: the same in lockstep and in real time.
template <class Item>
class FaultyChannel {
 public:
  explicit FaultyChannel(std::vector<Fault> faults, std::uint64_t seed = 1)
      : faults_(std::move(faults)), random_(seed) {}
  /// What comes out at t (s), when this goes in.
  std::vector<Item> pass(std::optional<Item> in, double t);
  /// Items that did not come out as they went in.
  long spoilt() const noexcept { return spoilt_; }

 private:
  const Fault* active(double t) const;
  void slow(Item in, const Fault& fault, double t);

  std::vector<Fault> faults_;
  std::mt19937_64 random_;
  std::optional<Item> last_;  // that came through unharmed
  std::deque<std::pair<double, Item>> held_;
  std::optional<double> free_at_;  // slow: when the next may leave
  long spoilt_ = 0;
};

/// Keeps watch over the expectations; times as in the timeline.
class Judge {
 public:
  Judge(std::vector<Expectation> expectations, double first_fault)
      : expectations_(std::move(expectations)), first_fault_(first_fault) {}
  struct Sample {
    State truth;
    bool landed;
    double clearance;  ///< m, of the vehicle's ball
  };
  void take(const Sample& s, double t);
  struct Judgement {
    std::string what, limit, measured;
    bool passed;
  };
  std::vector<Judgement> judgements() const;

 private:
  std::vector<Expectation> expectations_;
  double first_fault_;
  std::optional<Vec3> place_;
  double moved_ = 0, speed_ = 0, clearance_ = std::numeric_limits<double>::infinity();  // of what was seen
  std::optional<double> last_;                                                          // s, when something was
  std::vector<std::pair<double, bool>> changes_;                                        // of landed
};

}  // namespace backwash::bench
