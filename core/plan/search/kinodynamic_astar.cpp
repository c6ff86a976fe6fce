// SPDX-License-Identifier: BSD-3-Clause
#include "core/plan/search/kinodynamic_astar.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <queue>
#include <span>
#include <tuple>
#include <unordered_map>
#include <utility>

#include "core/plan/search/shortened_way.hpp"

namespace backwash::plan {

namespace {

// Measured on a thin wall with a far gap, v_max 0.3 to 3 m/s: deepest-first or plain f order give up at 400,000 states,
// these values find the way with 30 to 700. A small ρ makes the energy of turning dominate what H cannot see.
constexpr double kBand = 1.0;             ///< width of a band of f, of H(start)
constexpr double kTimeWeight = 20;        ///< ρ in units of (input)²
constexpr double kSpeedsPerKey = 2;       ///< velocity cells of the state key from 0 to v_max
constexpr double kVoxelsPerKey = 2;       ///< edge of a position cell of the state key, voxels
constexpr double kLimitTolerance = 1e-9;  ///< rounding of sums of primitives

/// What an attempt tries from each state, and how much it may spend.
struct Attempt {
  double speed_change;     ///< by the full input over the short duration, of v_max
  bool half_inputs;        ///< half the input as well, horizontally
  double haste;            ///< inside a band the order is G + haste·H
  std::size_t max_states;  ///< kept
};
// Coarse where the way is nearly straight: bench_plan's forest takes 0.24 ms at p95 with it, 4.4 ms with the fine one.
// What it has not found in 1,000 states, 1.2 ms, the shortened way costs less to find, and less to fly (README).
constexpr Attempt kStraight{0.375, false, 3, 1'000};
constexpr Attempt kGuided{0.25, true, 2, 200'000};

struct Node {
  State state;
  double g;
  int parent;       ///< −1: the start
  bool at_goal;     ///< reached by the optimal cubic, otherwise by constant acceleration
  Vec3 u;           ///< that acceleration
  double duration;  ///< of the motion from the parent
  std::uint64_t key;
};

struct Open {
  std::int64_t band;  ///< floor((f − H(start)) / width)
  double order;       ///< G + haste·H
  int node;
  bool operator>(const Open& o) const noexcept {
    return std::tie(band, order, node) > std::tie(o.band, o.order, o.node);
  }
};

class Search {
 public:
  /// `hops`: to the goal, or nothing for the straight way's heuristic.
  Search(const SafeView& space, const Vec3& goal_W, const SearchOptions& options, const Attempt& attempt,
         const Hops* hops)
      : space_(space), goal_W_(goal_W), options_(options), attempt_(attempt), hops_(hops) {
    // The short duration covers 1.5 voxels at full speed at least: slow flight gets gentler inputs instead of
    // primitives that stay inside their voxel.
    const double change = attempt.speed_change * options.v_max;
    tau_ = std::max(change / options.a_max, 1.5 * space.space().resolution() / options.v_max);
    a_ = std::min(options.a_max, change / tau_);
    rho_ = kTimeWeight * a_ * a_;
  }

  tl::expected<SearchResult, SearchFailure::Kind> run(const State& start) {
    const std::size_t max_nodes = std::min(attempt_.max_states, options_.max_nodes);
    start_h_ = heuristic(start).value_or(0);
    band_ = std::max(kBand * start_h_, 1e-12);
    push({start, 0, -1, false, Vec3::Zero(), 0, key(start)}, start_h_);
    while (!open_.empty()) {
      const int current = open_.top().node;
      open_.pop();
      if (nodes_[at(current)].at_goal) return path(current);
      if (best_[nodes_[at(current)].key] < nodes_[at(current)].g) continue;  // stale: reached cheaper since
      if (nodes_.size() > max_nodes) return tl::unexpected(SearchFailure::Kind::exhausted);
      if (expanded_++ % 32 == 0 && Clock::now() > options_.deadline)
        return tl::unexpected(SearchFailure::Kind::deadline);
      shoot(current);
      expand(current);
    }
    return tl::unexpected(SearchFailure::Kind::infeasible);
  }
  std::size_t expanded() const noexcept { return expanded_; }
  double rho() const noexcept { return rho_; }
  double lower_bound() const noexcept { return start_h_; }

 private:
  static std::size_t at(int node) { return static_cast<std::size_t>(node); }

  /// Lower bound of the cost from a state to the goal at rest; nothing where no way exists.
  std::optional<double> heuristic(const State& s) const {
    double way = (goal_W_ - s.p_W).cwiseAbs().maxCoeff();
    if (hops_) {
      const Index3 v = space_.space().index(s.p_W);
      if (!space_.space().inside(v)) return std::nullopt;
      const std::uint32_t hops = hops_->at(space_.space().linear(v));
      if (hops == Hops::kUnreached) return std::nullopt;
      way = std::max(way, (hops - 1.0) * space_.space().resolution());
    }
    const double least = least_stopping_time(way, s.v_W.cwiseAbs().maxCoeff(), options_.v_max, options_.a_max);
    return cost_to_go(s, goal_W_, rho_, least).cost;
  }

  std::uint64_t key(int axis, double p, double v) const {
    const auto pack = [](double cell, double offset, int bits) {
      const double limit = static_cast<double>(1 << bits) - 1;
      return static_cast<std::uint64_t>(std::clamp(std::floor(cell) + offset, 0.0, limit));
    };
    const double cell = (p - space_.space().origin()[axis]) / (kVoxelsPerKey * space_.space().resolution());
    return (pack(cell, 0, 14) << 7 | pack(v / (options_.v_max / kSpeedsPerKey) + 0.5, 64, 7)) << (21 * axis);
  }
  std::uint64_t key(const State& s) const {
    return key(0, s.p_W.x(), s.v_W.x()) | key(1, s.p_W.y(), s.v_W.y()) | key(2, s.p_W.z(), s.v_W.z());
  }

  void push(const Node& node, double h) {
    if (!node.at_goal) {
      const auto [entry, fresh] = best_.try_emplace(node.key, node.g);
      if (!fresh && entry->second <= node.g) return;
      entry->second = node.g;
    }
    const double band = std::floor((node.g + h - start_h_) / band_ + 1e-9);
    const double order = node.g + attempt_.haste * h;
    nodes_.push_back(node);
    open_.push({static_cast<std::int64_t>(band), order, static_cast<int>(nodes_.size()) - 1});
  }

  /// The optimal cubic to the goal, slowed until it keeps the limits; pushed if its swept set is clear.
  void shoot(int from) {
    const State state = nodes_[at(from)].state;
    double T = cost_to_go(state, goal_W_, rho_, kControlPeriod).duration;
    for (int slower = 0; slower < 12; ++slower, T *= 1.12) {
      const Motion motion = optimal_cubic(state, goal_W_, T);
      if (!within_limits(motion)) continue;
      if (space_.clear(motion))
        push({motion.end(), nodes_[at(from)].g + motion.effort() + rho_ * T, from, true, Vec3::Zero(), T, 0}, 0);
      return;
    }
  }

  bool within_limits(const Motion& motion) const {
    const Vec3 v_limit = motion.c[1].cwiseAbs().cwiseMax(options_.v_max);
    return (motion.peak_velocity().array() <= v_limit.array() + kLimitTolerance).all() &&
           (motion.peak_acceleration().array() <= options_.a_max + kLimitTolerance).all();
  }

  /// Where an acceleration on one axis leads.
  struct AxisEnd {
    double u, p, v;
    std::uint64_t key;
  };
  struct AxisEnds {
    std::array<AxisEnd, 5> end;
    std::size_t count = 0;
  };
  /// Those of an axis that keep the speed limit; above it only those that slow down.
  AxisEnds axis_ends(const State& state, int axis, double a, double duration) const {
    static constexpr std::array<double, 5> kFine{-1, -0.5, 0, 0.5, 1};
    static constexpr std::array<double, 3> kCoarse{-1, 0, 1}, kVertical{-0.5, 0, 0.5};
    const std::span<const double> levels = axis == 2              ? std::span<const double>(kVertical)
                                           : attempt_.half_inputs ? std::span<const double>(kFine)
                                                                  : std::span<const double>(kCoarse);
    const double p = state.p_W[axis], v = state.v_W[axis];
    const bool too_fast = std::abs(v) > options_.v_max + kLimitTolerance;
    AxisEnds ends;
    for (const double level : levels) {
      const double u = level * a, v_end = v + u * duration;
      if (too_fast ? std::abs(v_end) >= std::abs(v) : std::abs(v_end) > options_.v_max + kLimitTolerance) continue;
      const double p_end = p + duration * (v + u * duration / 2);
      ends.end[ends.count++] = {u, p_end, v_end, key(axis, p_end, v_end)};
    }
    return ends;
  }

  void expand(int from) {
    const State state = nodes_[at(from)].state;
    const bool too_fast = state.v_W.cwiseAbs().maxCoeff() > options_.v_max + kLimitTolerance;
    const double a = too_fast ? options_.a_max : a_;
    for (const double duration : {tau_, 2 * tau_}) {
      const AxisEnds xs = axis_ends(state, 0, a, duration), ys = axis_ends(state, 1, a, duration),
                     zs = axis_ends(state, 2, a, duration);
      for (std::size_t i = 0; i < xs.count; ++i)
        for (std::size_t j = 0; j < ys.count; ++j)
          for (std::size_t k = 0; k < zs.count; ++k) consider(from, xs.end[i], ys.end[j], zs.end[k], duration);
    }
  }

  void consider(int from, const AxisEnd& x, const AxisEnd& y, const AxisEnd& z, double duration) {
    const Vec3 u(x.u, y.u, z.u);
    const double g = nodes_[at(from)].g + (u.squaredNorm() + rho_) * duration;
    const std::uint64_t end_key = x.key | y.key | z.key;
    const auto known = best_.find(end_key);
    if (known != best_.end() && known->second <= g) return;
    const State end{{x.p, y.p, z.p}, {x.v, y.v, z.v}};
    if (!space_.clear(primitive(nodes_[at(from)].state, u, duration))) return;
    if (const auto h = heuristic(end)) push({end, g, from, false, u, duration, end_key}, *h);
  }

  SearchResult path(int last) const {
    SearchResult result{{}, nodes_[at(last)].g, start_h_, expanded_};
    for (int node = last; nodes_[at(node)].parent >= 0; node = nodes_[at(node)].parent) {
      const Node& n = nodes_[at(node)];
      const State& from = nodes_[at(n.parent)].state;
      result.motions.push_back(n.at_goal ? optimal_cubic(from, goal_W_, n.duration) : primitive(from, n.u, n.duration));
    }
    std::ranges::reverse(result.motions);
    return result;
  }

  const SafeView& space_;
  Vec3 goal_W_;
  SearchOptions options_;
  Attempt attempt_;
  const Hops* hops_;
  double tau_, a_, rho_, start_h_ = 0, band_ = 1;
  std::size_t expanded_ = 0;
  std::vector<Node> nodes_;
  std::priority_queue<Open, std::vector<Open>, std::greater<>> open_;
  std::unordered_map<std::uint64_t, double> best_;
};

SearchFailure failure(SearchFailure::Kind kind, std::size_t expanded, std::size_t max_nodes) {
  switch (kind) {
    case SearchFailure::Kind::no_path:
      return {kind, "no way through hover-safe space joins start and goal"};
    case SearchFailure::Kind::infeasible:
      return {kind, "start and goal are joined, but by no motion within the limits"};
    case SearchFailure::Kind::exhausted:
      return {kind, "search gave up at the cap of " + std::to_string(max_nodes) + " states"};
    default:
      return {kind, "search ran out of time after " + std::to_string(expanded) + " states"};
  }
}

}  // namespace

tl::expected<SearchResult, SearchFailure> search(const SafeView& space, const State& start, const Vec3& goal_W,
                                                 const SearchOptions& options) {
  using Kind = SearchFailure::Kind;
  const Index3 from = space.space().index(start.p_W), to = space.space().index(goal_W);
  std::size_t expanded = 0;
  const auto failed = [&](Kind kind) { return tl::unexpected(failure(kind, expanded, options.max_nodes)); };
  if (!space.passable(from) || !space.passable(to) || !space.may_join(from, to)) return failed(Kind::no_path);

  Search straight(space, goal_W, options, kStraight, nullptr);
  auto found = straight.run(start);
  expanded = straight.expanded();
  if (found) return *found;
  if (found.error() == Kind::deadline || options.max_nodes <= kStraight.max_states) return failed(found.error());

  auto by_way = shortened_way(space, start, goal_W, {options.v_max, options.a_max}, straight.rho(), options.deadline);
  expanded += by_way.expanded;
  if (!by_way.motions.empty())
    return SearchResult{std::move(by_way.motions), by_way.cost, straight.lower_bound(), expanded};
  if (by_way.status == Way::Status::none) return failed(Kind::no_path);
  if (by_way.status == Way::Status::given_up) return failed(Kind::deadline);

  // The start is too fast to stop on its way.
  const Hops hops = space.hops_to(to, from);
  Search guided(space, goal_W, options, kGuided, &hops);
  found = guided.run(start);
  expanded += guided.expanded();
  if (!found) return failed(found.error());
  found->expanded = expanded;
  return *found;
}

PathSamples sample(const std::vector<Motion>& motions, double step) {
  double total = 0;
  for (const Motion& m : motions) total += m.duration;
  const auto count = std::max<std::size_t>(static_cast<std::size_t>(std::ceil(total / step)), 3);
  PathSamples result{{}, total / static_cast<double>(count)};
  std::size_t motion = 0;
  double begun = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const double t = static_cast<double>(i) * result.step;
    while (motion + 1 < motions.size() && t >= begun + motions[motion].duration) begun += motions[motion++].duration;
    result.positions.push_back(motions[motion].position(t - begun));
  }
  result.positions.push_back(motions.back().end().p_W);
  return result;
}

}  // namespace backwash::plan
