// SPDX-License-Identifier: BSD-3-Clause
#include "services/bench/emulation/faults.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>

namespace backwash::bench {
namespace {

// What a kind does to an item of each channel.

// Bytes: the same again, noise, and in every chunk one wrong bit.
Bytes again(const Bytes& last, const Bytes&) { return last; }
Bytes garbled(const Bytes& in, std::mt19937_64& random) {
  Bytes out(in.size());
  std::ranges::generate(out, [&] { return static_cast<std::uint8_t>(random()); });
  return out;
}
Bytes shifted(Bytes in, const Fault&, std::mt19937_64& random) {
  in[random() % in.size()] ^= static_cast<std::uint8_t>(1U << random() % 8);
  return in;
}
double cost(const Bytes& in) { return static_cast<double>(in.size()); }
constexpr bool queues(const Bytes&) { return true; }

// Odometry: the old pose with a new stamp, NaN and nonsense, another place.
VioSample again(const VioSample& last, const VioSample& in) { return {last.estimate, last.q, in.stamp}; }
VioSample garbled(VioSample in, std::mt19937_64& random) {
  std::normal_distribution<double> wild(0, 1e3);
  for (Vec3* v : {&in.estimate.p_W, &in.estimate.v_W}) *v = Vec3(wild(random), wild(random), wild(random));
  if (random() % 4 == 0) in.estimate.p_W.x() = std::nan("");
  in.q.coeffs() *= wild(random);
  return in;
}
VioSample shifted(const VioSample& in, const Fault& fault, std::mt19937_64&) {
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(fault.yaw, Vec3::UnitZ()));
  return {{turn * in.estimate.p_W + fault.offset, turn * in.estimate.v_W}, turn * in.q, in.stamp};
}
double cost(const VioSample&) { return 1; }
constexpr bool queues(const VioSample&) { return false; }

// The map: sent again, bytes that are none, everything elsewhere.
MapMessage again(const MapMessage& last, const MapMessage&) { return last; }
MapMessage garbled(MapMessage in, std::mt19937_64&) {
  in.garbage = true;
  return in;
}
MapMessage shifted(const MapMessage& in, const Fault& fault, std::mt19937_64&) {
  // By whole voxels: only such a grid can be an OctoMap.
  const Vec3 voxels = (fault.offset / in.grid.resolution()).array().round();
  map::OccupancyGrid moved(in.grid.origin() + in.grid.resolution() * voxels, in.grid.resolution(), in.grid.size());
  for (std::size_t n = 0; n < in.grid.cell_count(); ++n) moved.set(in.grid.voxel(n), in.grid.at(n));
  return {std::move(moved), false};
}
double cost(const MapMessage&) { return 1; }
constexpr bool queues(const MapMessage&) { return false; }

std::string number(double v, const char* unit) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2f %s", v, unit);
  return text;
}

}  // namespace

std::vector<Fault> Timeline::of(Fault::Channel channel) const {
  std::vector<Fault> all;
  std::ranges::copy_if(faults, std::back_inserter(all), [&](const Fault& f) { return f.channel == channel; });
  return all;
}

template <class Item>
const Fault* FaultyChannel<Item>::active(double t) const {
  const auto found = std::ranges::find_if(faults_, [&](const Fault& f) { return t >= f.from && t < f.until; });
  return found == faults_.end() ? nullptr : &*found;
}

// A link keeps what it cannot send yet; of samples only those are sent for which there is time.
template <class Item>
void FaultyChannel<Item>::slow(Item in, const Fault& fault, double t) {
  const double free_at = std::max(t, free_at_.value_or(t));
  if (!queues(in) && t < free_at) return;
  free_at_ = free_at + cost(in) / fault.rate;
  held_.emplace_back(queues(in) ? *free_at_ : t, std::move(in));
}

template <class Item>
std::vector<Item> FaultyChannel<Item>::pass(std::optional<Item> in, double t) {
  const Fault* fault = active(t);
  if (in && fault) {
    using enum Fault::Kind;
    ++spoilt_;
    switch (fault->kind) {
      case off:
        break;
      case stuck:
        if (last_) held_.emplace_back(t, again(*last_, *in));
        break;
      case garbage:
        held_.emplace_back(t, garbled(std::move(*in), random_));
        break;
      case wrong:
        held_.emplace_back(t, shifted(std::move(*in), *fault, random_));
        break;
      case slow:
        this->slow(std::move(*in), *fault, t);
        break;
      case delayed:
        held_.emplace_back(t + fault->delay, std::move(*in));
        break;
      case intermittent:
        if (std::fmod(t - fault->from, fault->on + fault->off) < fault->on) {
          held_.emplace_back(t, std::move(*in));
          --spoilt_;
        }
    }
  } else if (in) {
    last_ = in;
    held_.emplace_back(t, std::move(*in));
  }
  // In order: what was delayed leaves before what came after it.
  std::vector<Item> out;
  for (; !held_.empty() && held_.front().first <= t; held_.pop_front()) out.push_back(std::move(held_.front().second));
  return out;
}

template class FaultyChannel<Bytes>;
template class FaultyChannel<VioSample>;
template class FaultyChannel<MapMessage>;

void Judge::take(const Sample& s, double t) {
  last_ = t;
  speed_ = std::max(speed_, s.truth.v_W.norm());
  clearance_ = std::min(clearance_, s.clearance);
  if (changes_.empty() || changes_.back().second != s.landed) changes_.emplace_back(t, s.landed);
  if (t < first_fault_) return;
  if (!place_) place_ = s.truth.p_W;
  moved_ = std::max(moved_, (s.truth.p_W - *place_).head<2>().norm());
}

std::vector<Judge::Judgement> Judge::judgements() const {
  const auto landed_at = [&](double t) {
    bool landed = true;
    for (const auto& [since, is] : changes_)
      if (since <= t) landed = is;
    return landed;
  };
  std::vector<Judgement> all;
  for (const Expectation& e : expectations_) {
    using enum Expectation::What;
    const bool seen = e.at <= last_;
    const std::string state = !seen ? "not reached" : landed_at(e.at) ? "landed" : "airborne";
    switch (e.what) {
      case landed:
        all.push_back({"landed", "at " + number(e.at, "s"), state, seen && landed_at(e.at)});
        break;
      case airborne:
        all.push_back({"airborne", "at " + number(e.at, "s"), state, seen && !landed_at(e.at)});
        break;
      case moved:
        all.push_back({"moved", "at most " + number(e.limit, "m"), number(moved_, "m"), place_ && moved_ <= e.limit});
        break;
      case speed:
        all.push_back(
            {"speed", "at most " + number(e.limit, "m/s"), number(speed_, "m/s"), last_ && speed_ <= e.limit});
        break;
      case clearance:
        all.push_back(
            {"clearance", "at least " + number(e.limit, "m"), number(clearance_, "m"), last_ && clearance_ >= e.limit});
    }
  }
  return all;
}

}  // namespace backwash::bench
