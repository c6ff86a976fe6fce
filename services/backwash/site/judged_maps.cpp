// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwash/site/judged_maps.hpp"

#include <algorithm>
#include <cstdio>

#include "core/map/voxel_box.hpp"
#include "core/plan/planner.hpp"
#include "core/reach/clearance.hpp"
#include "core/report/recorded_map.hpp"

namespace backwash::services {
namespace {

std::string others_than_maps(const JudgedMaps& maps) {
  return maps.window_clouds > 0 ? "the mapper's window" : "scans";
}

}  // namespace

std::string unless_freed(const JudgedMaps& maps) {
  if (maps.contradicted == 0) return "";
  return ", unless " + others_than_maps(maps) + " had freed what map " + std::to_string(maps.contradicted) +
         " holds there: the log does not say";
}

MapJudge::MapJudge(const log::RawLog& log, std::int64_t zero_ns, const Vehicle& vehicle)
    : zero_ns_(zero_ns), vehicle_(vehicle) {
  for (const auto& record : log.records) count(record);
  std::ranges::stable_sort(records_, {}, [](const auto* r) { return r->header.t_ns; });
  for (const auto* record : records_)
    maps_.accepted_s.push_back(1e-9 * static_cast<double>(record->header.t_ns - zero_ns_));
}

void MapJudge::count(const log::RawRecord& record) {
  const std::string text(record.bytes.begin(), record.bytes.end());
  const auto kind = record.header.kind;
  if (kind == log::RecordKind::map && report::accepted_map(record)) records_.push_back(&record);
  if (kind == log::RecordKind::scan) {
    ++(text.find(" window of ") != text.npos ? maps_.window_clouds : maps_.scans);
    seen_ns_ = std::min(seen_ns_.value_or(record.header.t_ns), record.header.t_ns);
  }
  std::size_t gone = 0, occupied = 0;
  if (kind == log::RecordKind::world &&
      std::sscanf(text.c_str(), "window: %zu voxels far from it are let go, %zu of them", &gone, &occupied) == 2) {
    maps_.let_go += gone;
    maps_.let_go_occupied += occupied;
  }
}

/// Which map was the newest, 0: none had come. One at a time is kept: a mapper may send hundreds.
std::size_t MapJudge::use_newest(std::int64_t t_ns) {
  const auto later = std::ranges::upper_bound(records_, t_ns, {}, [](const auto* r) { return r->header.t_ns; });
  const auto n = static_cast<std::size_t>(later - records_.begin());
  if (n == used_) return n;
  used_ = n;
  grid_.reset();
  distance_.reset();
  unreadable_.clear();
  if (n == 0) return n;
  auto grid = report::recorded_map(*records_[n - 1]);
  if (!grid) {
    unreadable_ = grid.error().message;
    return n;
  }
  grid_.emplace(std::move(*grid));
  distance_.emplace(*grid_);
  return n;
}

/// Whether the body meets what the map says is occupied, not only what it does not know.
bool MapJudge::meets_occupied(const Vec3& p_W) const {
  const Vec3 reach = Vec3::Constant(vehicle_.body.radius), half = Vec3::Constant(grid_->resolution() / 2);
  bool meets = false;
  map::for_each_voxel(map::common({grid_->index(p_W - reach), grid_->index(p_W + reach)}, map::all_of(grid_->size())),
                      [&](const Index3& v) {
                        const Vec3 away = ((p_W - grid_->center(v)).cwiseAbs() - half).cwiseMax(0);
                        meets = meets || (grid_->occupied(v) && away.norm() <= vehicle_.body.radius);
                      });
  return meets;
}

void MapJudge::note(double t_s, std::size_t map, std::optional<double> clearance_m, const std::string& why) {
  auto& all = maps_.stretches;
  if (all.empty() || all.back().map != map || all.back().why != why) all.push_back({t_s, t_s, 0, map, {}, why});
  auto& stretch = all.back();
  stretch.until_s = t_s;
  ++stretch.ticks;
  if (clearance_m) stretch.clearance_m = std::min(stretch.clearance_m.value_or(*clearance_m), *clearance_m);
  ++(clearance_m ? maps_.judged : maps_.not_judged);
}

std::optional<double> MapJudge::clearance(std::int64_t t_ns, const Vec3& p_W) {
  const double t_s = 1e-9 * static_cast<double>(t_ns - zero_ns_);
  const std::size_t n = use_newest(t_ns);
  const bool seen = seen_ns_ && *seen_ns_ <= t_ns;
  const std::string others = others_than_maps(maps_);
  const auto unknown = [&](const std::string& why) {
    note(t_s, 0, {}, why);
    return std::nullopt;
  };
  if (n == 0)
    return unknown(seen ? "no whole map had come, and what " + others + " showed is not in the log"
                        : "no map had come");
  const std::string name = "map " + std::to_string(n);
  if (!grid_) return unknown(name + " cannot be read: " + unreadable_);
  const double clearance_m = distance_->exact(*grid_, p_W) - vehicle_.body.radius;
  if (clearance_m <= 0 && seen) {
    if (!meets_occupied(p_W))
      return unknown(name + " does not know this place, and what " + others + " showed of it is not in the log");
    maps_.contradicted = n;
  }
  note(t_s, n, clearance_m, "");
  return clearance_m;
}

void MapJudge::judge_rising(std::int64_t t_ns, const Vec3& p_W) {
  reach::TubeStep point{};
  point.center.p_W = p_W;
  point.shape.setZero();
  const bool known = use_newest(t_ns) > 0 && grid_ && grid_->free(grid_->index(p_W));
  const double beside_m =
      known ? plan::lateral_clearance(*grid_, vehicle_, {}, {point}) + vehicle_.estimation.position : 0;
  // As on a route: what others than maps have shown since may have freed it.
  if (!known || (beside_m <= 0 && seen_ns_ && *seen_ns_ <= t_ns)) {
    ++maps_.not_judged_rising;
    return;
  }
  maps_.beside_m = std::min(maps_.beside_m.value_or(beside_m), beside_m);
}

void MapJudge::judge_set(std::int64_t t_ns, const log::TickRecord& tick) {
  constexpr double kMost = 2;  // m: farther is not looked
  if (use_newest(t_ns) == 0 || !grid_) return;
  PerDirection half_widths;
  std::copy_n(tick.half_widths, kDirections, half_widths.begin());
  const double taken = reach::body_and_estimation(vehicle_), most = maps_.left_over_m.value_or(kMost);
  maps_.left_over_m =
      reach::prism_distance(*grid_, Vec3(tick.center[0], tick.center[1], tick.center[2]), half_widths, most + taken) -
      taken;
}

}  // namespace backwash::services
