// SPDX-License-Identifier: BSD-3-Clause
#include "core/field/lateral/lateral_sweep.hpp"

#include <algorithm>
#include <bit>
#include <span>

#include "core/field/sight/sight.hpp"

namespace backwash::field {
namespace {

constexpr double kInPlane = 1e-9;  // m: a point in an element's own plane does not see it, whatever the rounding
constexpr int kFar = 1000;         // layers: farther than anything in a window

int lowest(std::uint64_t word) noexcept { return std::countr_zero(word); }
int highest(std::uint64_t word) noexcept { return 63 - std::countl_zero(word); }
int lowest_of(const Layers& word) noexcept {
  const auto low = static_cast<std::uint64_t>(word), high = static_cast<std::uint64_t>(word >> 64);
  return low ? lowest(low) : high ? 64 + lowest(high) : kFar;
}
int highest_of(const Layers& word) noexcept {
  const auto low = static_cast<std::uint64_t>(word), high = static_cast<std::uint64_t>(word >> 64);
  return high ? 64 + highest(high) : low ? highest(low) : -kFar;
}

}  // namespace

template <typename Word>
LateralSweep<Word>::LateralSweep(const LateralColumns& columns)
    : columns_(columns), totals_(columns.radius_, columns.step_) {
  ones_.fill(1);
}

template <typename Word>
void LateralSweep<Word>::open(int x, int y, int height, int first_z) {
  const int r = columns_.radius_, rows = height + 2 * r, pitch = columns_.pitch_;
  const Index3& size = columns_.grid_->size();
  first_x_ = x - r;
  first_y_ = y - r;
  first_z_ = first_z;
  window_.assign(static_cast<std::size_t>(rows) * static_cast<std::size_t>(pitch), 0);
  constexpr int kBits = 8 * sizeof(Word);
  for (int z = std::max(0, first_z - kBelow); z < std::min(size.z(), first_z + kBits - kBelow); ++z)
    for (int j = std::max(0, -first_y_); j < std::min(rows, size.y() - first_y_); ++j) {
      Word* row = window_.data() + static_cast<std::ptrdiff_t>(j) * pitch;
      const int begin = std::max(0, -first_x_), end = std::min(pitch, size.x() - first_x_);
      const std::size_t cells = columns_.grid_->linear(Index3(0, first_y_ + j, z));
      for (int i = begin; i < end; ++i)
        if (columns_.grid_->at(cells + static_cast<std::size_t>(first_x_ + i)) == map::Cell::occupied)
          row[i] |= Word{1} << (z - first_z + kBelow);
    }
}

template <typename Word>
const LateralColumns::Sums& LateralSweep<Word>::sum(int x, int y, std::uint64_t targets) {
  x_ = x;
  y_ = y;
  targets_ = targets;
  home_ = window_.data() + static_cast<std::ptrdiff_t>(y - first_y_) * columns_.pitch_ + (x - first_x_);
  const int radius = columns_.radius_;
  near_.find(columns_, x, y, first_z_ + lowest(targets) - radius, first_z_ + highest(targets) + radius);
  if (views_.size() < near_.number.size()) reserve_views(near_.number.size());
  line_ = nullptr;
  view_count_ = word_count_ = element_count_ = 0;
  for (std::uint32_t n = 0; n < near_.count; ++n) open_view(n);
  const Elements elements{z_.data(),         wall_range_.data(), reach_.data(), with_corner_.data(),
                          all_about_.data(), certain_.data(),    open_.data()};
  classify(elements, padded(element_count_), targets_);
  find_hiding();
  decide(elements, padded(element_count_), hidden_.data(), wall_.data(), corner_.data());
  add_walls();
  add_corners();
  totals_.close(targets_, sums_);
  return sums_;
}

template <typename Word>
void LateralSweep<Word>::reserve_views(std::size_t most) {
  views_.resize(most);
  lines_.resize(most);
  c_x_.resize(most);
  c_y_.resize(most);
  range_.resize(most);
}

/// What the gates leave of a segment.
template <typename Word>
void LateralSweep<Word>::open_view(std::uint32_t near) {
  if (-columns_.grid_->resolution() * near_.along[near] <= kInPlane) return;
  const LateralColumns::Reach reach = columns_.reach_of(near_.flat2[near]);
  const ElementSegment& segment = columns_.segments_[near_.number[near]];
  const int floor = segment.floor - first_z_;
  const std::uint64_t with_corner =
      segment.floor == LateralColumns::kNoFloor ? 0 : targets_ & bits(floor + reach.first_up, floor + reach.last_up);
  if (reach.wall_range < 0 && (reach.range < 0 || !with_corner)) return;
  const int low = segment.low - first_z_;
  if (!with_corner && !(targets_ & bits(low, segment.high - first_z_ + reach.wall_range))) return;
  const SightLines::Line& line = columns_.lines_.at(segment.bundle, near_.dx[near], near_.dy[near]);
  const Word all = look_along(line);
  const std::size_t number = view_count_++;
  View& view = views_[number];
  static_cast<LateralColumns::Reach&>(view) = reach;
  view.segment = &segment;
  view.near = near;
  view.with_corner = with_corner;
  view.words = static_cast<std::uint32_t>(word_count_ - line.count);
  view.crossings = line.first;
  view.crossed = line.count;
  view.must = line.must;
  view.element = static_cast<std::uint32_t>(element_count_);
  view.from = 0;
  view.to = -1;
  if (segment.low == segment.high)
    add_element(view, low, all);
  else
    add_stack(view, all);
  view.end = static_cast<std::uint32_t>(element_count_);
  c_x_[number] = near_.dx[near] + 0.5 * segment.m_x;
  c_y_[number] = near_.dy[near] + 0.5 * segment.m_y;
  range_[number] = reach.range;
}

/// Takes the columns in hand that the lines to a segment cross; those of the last segment often do. What is occupied
/// in any of them.
template <typename Word>
Word LateralSweep<Word>::look_along(const SightLines::Line& line) {
  if (line_ == &line) return all_;
  line_ = &line;
  const std::size_t count = line.count;
  if (words_.size() < word_count_ + count + kEight) words_.resize(2 * (word_count_ + count + kEight));
  const std::int32_t* place = columns_.places_.data() + line.first;
  Word* words = words_.data() + word_count_;
  Word all = 0;
  for (std::size_t n = 0; n < count; ++n) all |= words[n] = home_[place[n]];
  word_count_ += count;
  return all_ = all;
}

/// The 64 layers about layer z: bit kCentre is its own.
template <typename Word>
std::uint64_t LateralSweep<Word>::around(const Word& word, int z) const noexcept {
  // All layers are in a word of 64: what turns about lands where the map has none.
  if constexpr (sizeof(Word) == 8) return std::rotl(word, kCentre - z);
  const int down = z + kBelow - kCentre;
  return static_cast<std::uint64_t>(down >= 0 ? word >> down : word << -down);
}

/// Splits a segment of several elements into those that all targets see and others.
template <typename Word>
void LateralSweep<Word>::add_stack(View& view, const Word& all_layers) {
  const ElementSegment& s = *view.segment;
  const int up = view.with_corner ? view.range : 0, down = std::max<int>(view.wall_range, up);
  const int from = std::max(s.low - first_z_, lowest(targets_) - down),
            to = std::min(s.high - first_z_, highest(targets_) + up);
  if (from > to) return;
  std::uint64_t targets = targets_ & bits(from - up, to + down);
  if (view.wall_range < 0) targets &= view.with_corner;
  if (!targets) return;
  constexpr int kLift = 32;  // bit 0 of the wide words is layer −32
  const int low = std::min(lowest(targets), from) + kLift, high = std::max(highest(targets), to) + kLift;
  int first = to + 1, last = to;
  if (low >= 0 && high <= 127) {
    const Layers band = ~Layers{0} >> (127 - high + low) << low, all = Layers{all_layers} << (kLift - kBelow) & band;
    const int middle = std::clamp((lowest(targets) + highest(targets)) / 2, from, to) + kLift;
    const int below = highest_of(all & ((Layers{1} << middle) - 1)) - kLift;
    const int above = lowest_of(all >> middle << middle) - kLift;
    first = std::max(from, below + 1);
    last = std::min(to, above - 1);
    if (lowest(targets) <= below) first = std::max(first, below + 1 + up);
    if (highest(targets) >= above) last = std::min(last, above - 1 - down);
    if (first > last) {
      first = to + 1;
      last = to;
    }
  }
  for (int z = from; z < first; ++z) add_element(view, z, all_layers);
  view.from = static_cast<std::int16_t>(first);
  view.to = static_cast<std::int16_t>(last);
  for (int z = last + 1; z <= to; ++z) add_element(view, z, all_layers);
}

/// Adds an element to those about which is decided together.
template <typename Word>
void LateralSweep<Word>::add_element(const View& view, int z, const Word& all) {
  const std::size_t n = element_count_++;
  if (z_.size() < n + 2 * kEight) {
    const std::size_t most = 2 * (n + 2 * kEight);
    view_of_.resize(most);
    open_elements_.resize(most);
    z_.resize(most);
    wall_range_.resize(most);
    reach_.resize(most);
    for (auto* words : {&with_corner_, &all_about_, &certain_, &open_, &far_, &hidden_, &wall_, &corner_})
      words->resize(most);
  }
  view_of_[n] = static_cast<std::uint32_t>(view_count_ - 1);
  z_[n] = z;
  wall_range_[n] = view.wall_range;
  reach_[n] = view.range;
  with_corner_[n] = view.with_corner;
  all_about_[n] = around(all, z);
  far_[n] = 0;
  hidden_[n] = 0;
  if (view.range <= kCentre) return;
  const std::uint64_t targets =
      targets_ & (bits(z, z + view.wall_range) | (view.with_corner & bits(z - view.range, z + view.range)));
  if (const std::uint64_t far = targets & ~bits(z - kCentre, z + kCentre)) far_[n] = looked_at(view, z, far);
}

/// Who of those that may see an element is behind an occupied voxel.
template <typename Word>
void LateralSweep<Word>::find_hiding() {
  std::size_t count = 0;
  for (std::uint32_t n = 0; n < element_count_; ++n) {
    open_elements_[count] = n;
    count += open_[n] != 0 ? 1 : 0;
  }
  for (std::size_t n = 0; n < count; ++n) look_between(open_elements_[n]);
  if (hiding_.size() == 0) return;
  make_lines(c_x_.data(), c_y_.data(), range_.data(), padded(view_count_), lines_.data());
  hiding_.hide(lines_.data(), hidden_.data());
}

/// Lists what may hide an element from its open targets; all are hidden behind a column that fills the heights between.
template <typename Word>
void LateralSweep<Word>::look_between(std::uint32_t element) {
  constexpr std::size_t kMost = 64;
  const View& view = views_[view_of_[element]];
  const int z = z_[element], low = std::min(lowest(open_[element]), kCentre),
            high = std::max(highest(open_[element]), kCentre);
  const std::uint64_t band = bits(low, high), *words = about(view, z);
  const auto below = static_cast<std::size_t>(kCentre - low), above = static_cast<std::size_t>(high - kCentre);
  HidingRuns::Source source{element,
                            view_of_[element],
                            columns_.lines_.crossings().data() + view.crossings,
                            columns_.lines_.left().data() + view.crossings,
                            columns_.below_[below].data(),
                            columns_.above_[above].data()};
  const std::size_t before = hiding_.size(), padded_count = view.crossed + kEight;
  if (inside_.size() < padded_count) inside_.resize(padded_count);
  for (std::size_t first = 0; first < view.crossed; first += kMost) {
    const auto found = look_inside(words + first, std::min(kMost, view.crossed - first),
                                   sizeof(Word) == 8 ? kCentre - z : 0, band, inside_.data() + first);
    if (first < view.must && (found.full & bits(0, static_cast<int>(view.must - first) - 1))) {
      hiding_.cut(before);
      open_[element] = 0;
      return;
    }
    const std::uint64_t some = found.some & bits(0, static_cast<int>(view.crossed - first) - 1);
    hiding_.list(source, inside_.data() + first, some);
    source.crossings += kMost;
    source.left += kMost;
  }
}

/// Words of the columns before a segment, for Layers those about height z.
template <typename Word>
const std::uint64_t* LateralSweep<Word>::about(const View& view, int z) {
  if constexpr (sizeof(Word) == 8) return words_.data() + view.words;
  if (about_.size() < view.crossed + kEight) about_.resize(view.crossed + kEight);
  for (std::size_t n = 0; n < view.crossed; ++n) about_[n] = around(words_[view.words + n], z);
  return about_.data();
}

/// Those of `targets` that see the element at height z, line by line.
template <typename Word>
std::uint64_t LateralSweep<Word>::looked_at(const View& view, int z, std::uint64_t targets) const noexcept {
  const ElementSegment& s = *view.segment;
  const auto& grid = *columns_.grid_;
  const Vec3 c_W = grid.center(Index3(s.x, s.y, first_z_ + z)) + 0.5 * grid.resolution() * Vec3(s.m_x, s.m_y, 0);
  std::uint64_t seen = targets;
  for (; targets; targets &= targets - 1) {
    const Vec3 p_W = grid.center(Index3(x_, y_, first_z_ + lowest(targets)));
    if (!columns_.sight_->line_of_sight(columns_.sight_->viewpoint(p_W), c_W)) seen &= ~(targets & -targets);
  }
  return seen;
}

template <typename Word>
void LateralSweep<Word>::add_walls() {
  for (std::size_t n = 0; n < element_count_; ++n) {
    const View& view = views_[view_of_[n]];
    if (wall_[n]) totals_.add_wall(z_[n], wall_[n], near_.decay[view.near], view.segment->wall);
    if (!far_[n]) continue;
    for (std::uint64_t rest = far_[n] & bits(z_[n], z_[n] + view.wall_range); rest; rest &= rest - 1) {
      const int up = lowest(rest) - z_[n];
      totals_.add_wall(z_[n], z_[n], up, up + 1, near_.decay[view.near], view.segment->wall);
    }
    corner_[n] |= far_[n] & view.with_corner;
  }
  for (const View& view : std::span(views_).first(view_count_))
    if (view.from <= view.to && view.wall_range >= 0)
      totals_.add_wall(view.from, view.to, 0, view.wall_range + 1, near_.decay[view.near], view.segment->wall);
}

template <typename Word>
void LateralSweep<Word>::add_corners() {
  const double a = columns_.grid_->resolution();
  for (const View& view : std::span(views_).first(view_count_)) {
    if (!view.with_corner) continue;
    const bool one = view.end == view.element + 1 && view.from > view.to;
    const std::uint64_t heights = one ? corner_[view.element] : count_stack(view);
    if (!heights) continue;
    const auto& c = view.segment->corner;
    totals_.add_corner({c.xx, c.xy, c.yy, c.zz, a, a * a * near_.flat2[view.near], columns_.model_.corner.phi_max,
                        view.segment->floor - first_z_},
                       heights, one ? ones_.data() : count_.data());
  }
}

/// Number of elements of a segment that each target with a corner term sees; those targets.
template <typename Word>
std::uint64_t LateralSweep<Word>::count_stack(const View& view) noexcept {
  std::uint64_t heights = 0;
  for (std::uint64_t rest = view.with_corner; rest; rest &= rest - 1) {
    const int z = lowest(rest);
    int seen = std::max(0, std::min<int>(view.to, z + view.range) - std::max<int>(view.from, z - view.range) + 1);
    for (std::uint32_t n = view.element; n < view.end; ++n) seen += static_cast<int>(corner_[n] >> z & 1);
    count_[static_cast<std::size_t>(z)] = static_cast<float>(seen);
    heights |= seen ? rest & -rest : 0;
  }
  return heights;
}

template class LateralSweep<std::uint64_t>;
template class LateralSweep<Layers>;

}  // namespace backwash::field
