// SPDX-License-Identifier: BSD-3-Clause
#include "core/plan/kinodynamic_astar.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <queue>
#include <tuple>
#include <unordered_map>

namespace backwash::plan {

namespace {

// Measured on a thin wall with a far gap, v_max 0.3 to 3 m/s: deepest-first or plain f order give up at 400,000 states,
// these values find the way with 30 to 700. A small ρ makes the energy of turning dominate what H cannot see.
constexpr double kBand = 1.0;             ///< width of a band of f, of H(start)
constexpr double kHaste = 2.0;            ///< inside a band the order is G + kHaste·H
constexpr double kTimeWeight = 20;        ///< ρ in units of (input)²
constexpr double kSpeedsPerKey = 2;       ///< velocity cells of the state key from 0 to v_max
constexpr double kVoxelsPerKey = 2;       ///< edge of a position cell of the state key, voxels
constexpr double kLimitTolerance = 1e-9;  ///< rounding of sums of primitives

struct Node {
  State state;
  double g;
  int parent;     ///< −1: the start
  Motion motion;  ///< from the parent
  std::uint64_t key;
  bool at_goal;
};

struct Open {
  std::int64_t band;  ///< floor((f − H(start)) / width)
  double order;       ///< G + kHaste·H
  int node;
  bool operator>(const Open& o) const noexcept {
    return std::tie(band, order, node) > std::tie(o.band, o.order, o.node);
  }
};

class Search {
 public:
  Search(const SafeSpace& space, const State& start, const Vec3& goal_W, const SearchOptions& options)
      : space_(space), goal_W_(goal_W), options_(options), hops_(space.hops_to(space.grid().index(goal_W))) {
    // The short duration covers 1.5 voxels at full speed and changes the speed by v_max/4 at the full input: slow
    // flight gets gentler inputs instead of primitives that stay inside their voxel.
    tau_ = std::max(options.v_max / (4 * options.a_max), 1.5 * space.grid().resolution() / options.v_max);
    a_ = std::min(options.a_max, options.v_max / (4 * tau_));
    rho_ = kTimeWeight * a_ * a_;
    start_h_ = heuristic(start).value_or(0);
    band_ = std::max(kBand * start_h_, 1e-12);
  }

  tl::expected<SearchResult, SearchFailure> run(const State& start) {
    if (!heuristic(start))
      return tl::unexpected(
          SearchFailure{SearchFailure::Kind::no_path, "no way through hover-safe space joins start and goal"});
    push({start, 0, -1, {}, key(start), false}, start_h_);
    std::size_t expanded = 0;
    while (!open_.empty()) {
      const int current = open_.top().node;
      open_.pop();
      if (nodes_[at(current)].at_goal) return path(current, expanded);
      if (best_[nodes_[at(current)].key] < nodes_[at(current)].g) continue;  // stale: reached cheaper since
      if (nodes_.size() > options_.max_nodes)
        return tl::unexpected(SearchFailure{SearchFailure::Kind::no_path,
                                            "search gave up at " + std::to_string(options_.max_nodes) + " states"});
      if (expanded++ % 32 == 0 && Clock::now() > options_.deadline)
        return tl::unexpected(SearchFailure{SearchFailure::Kind::deadline,
                                            "search ran out of time after " + std::to_string(expanded) + " states"});
      shoot(current);
      expand(current);
    }
    return tl::unexpected(
        SearchFailure{SearchFailure::Kind::no_path, "start and goal are joined, but by no motion within the limits"});
  }

 private:
  static std::size_t at(int node) { return static_cast<std::size_t>(node); }

  /// Lower bound of the cost from a state to the goal at rest; nothing where no way exists.
  std::optional<double> heuristic(const State& s) const {
    const Index3 v = space_.grid().index(s.p_W);
    if (!space_.passable(v)) return std::nullopt;
    const std::uint32_t hops = hops_[space_.grid().linear(v)];
    if (hops == SafeSpace::kUnreached) return std::nullopt;
    const double way = std::max((goal_W_ - s.p_W).cwiseAbs().maxCoeff(), (hops - 1.0) * space_.grid().resolution());
    const double least = least_stopping_time(way, s.v_W.cwiseAbs().maxCoeff(), options_.v_max, options_.a_max);
    return cost_to_go(s, goal_W_, rho_, least).cost;
  }

  std::uint64_t key(const State& s) const {
    const auto pack = [](double cell, double offset, int bits) {
      const double limit = static_cast<double>(1 << bits) - 1;
      return static_cast<std::uint64_t>(std::clamp(std::floor(cell) + offset, 0.0, limit));
    };
    std::uint64_t key = 0;
    for (int axis = 0; axis < 3; ++axis)
      key = key << 14 |
            pack((s.p_W - space_.grid().origin())[axis] / (kVoxelsPerKey * space_.grid().resolution()), 0, 14);
    for (int axis = 0; axis < 3; ++axis)
      key = key << 7 | pack(s.v_W[axis] / (options_.v_max / kSpeedsPerKey) + 0.5, 64, 7);
    return key;
  }

  void push(Node node, double h) {
    if (!node.at_goal) {
      const auto [entry, fresh] = best_.try_emplace(node.key, node.g);
      if (!fresh && entry->second <= node.g) return;
      entry->second = node.g;
    }
    const double band = std::floor((node.g + h - start_h_) / band_ + 1e-9);
    const double order = node.g + kHaste * h;
    nodes_.push_back(std::move(node));
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
        push({motion.end(), nodes_[at(from)].g + motion.effort() + rho_ * T, from, motion, 0, true}, 0);
      return;
    }
  }

  bool within_limits(const Motion& motion) const {
    const Vec3 v_limit = motion.c[1].cwiseAbs().cwiseMax(options_.v_max);
    return (motion.peak_velocity().array() <= v_limit.array() + kLimitTolerance).all() &&
           (motion.peak_acceleration().array() <= options_.a_max + kLimitTolerance).all();
  }

  void expand(int from) {
    const State state = nodes_[at(from)].state;
    const double g = nodes_[at(from)].g;
    const auto too_fast = state.v_W.array().abs() > options_.v_max + kLimitTolerance;
    const double a = too_fast.any() ? options_.a_max : a_;
    for (const double duration : {tau_, 2 * tau_})
      for (const double ux : {-a, -a / 2, 0.0, a / 2, a})
        for (const double uy : {-a, -a / 2, 0.0, a / 2, a})
          for (const double uz : {-a / 2, 0.0, a / 2}) {
            const Motion motion = primitive(state, {ux, uy, uz}, duration);
            if (!within_limits(motion)) continue;
            const State end = motion.end();
            if ((too_fast && end.v_W.array().abs() >= state.v_W.array().abs()).any()) continue;
            const double g_end = g + motion.effort() + rho_ * duration;
            const std::uint64_t end_key = key(end);
            const auto known = best_.find(end_key);
            if (known != best_.end() && known->second <= g_end) continue;
            const auto h = heuristic(end);
            if (!h || !space_.clear(motion)) continue;
            push({end, g_end, from, motion, end_key, false}, *h);
          }
  }

  SearchResult path(int last, std::size_t expanded) const {
    SearchResult result{{}, nodes_[at(last)].g, start_h_, expanded};
    for (int node = last; nodes_[at(node)].parent >= 0; node = nodes_[at(node)].parent)
      result.motions.push_back(nodes_[at(node)].motion);
    std::ranges::reverse(result.motions);
    return result;
  }

  const SafeSpace& space_;
  Vec3 goal_W_;
  SearchOptions options_;
  std::vector<std::uint32_t> hops_;
  double tau_, a_, rho_, start_h_, band_;
  std::vector<Node> nodes_;
  std::priority_queue<Open, std::vector<Open>, std::greater<>> open_;
  std::unordered_map<std::uint64_t, double> best_;
};

}  // namespace

tl::expected<SearchResult, SearchFailure> search(const SafeSpace& space, const State& start, const Vec3& goal_W,
                                                 const SearchOptions& options) {
  return Search(space, start, goal_W, options).run(start);
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
