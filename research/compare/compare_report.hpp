// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/report/page/page_data.hpp"
#include "research/compare/compare_statistics.hpp"

namespace backwash::report {

/// Everything `backwash compare` found.
struct Comparison {
  std::vector<sim::CompareMethod> methods;
  std::vector<sim::SceneComparison> scenes;
  sim::Table table;
  std::vector<sim::Demand> demands;
  std::vector<sim::GapCampaign> gaps;  ///< one a vehicle; empty where the scene was not asked for
  std::uint64_t seed;
  std::size_t flights;  ///< pairs a scene and vehicle
  std::string version;
  bool timed = true;  ///< planning times were taken, and are shown
};

/// Jerk² of the proposed method over a margin in the paper's Table I; nothing for margins that it does not have.
std::optional<double> paper_jerk2_ratio(const sim::CompareMethod& method);

/// First method over each of the others on the pairs that all solve: jerk², length, time and energy with their
/// intervals, the paper's ratios beside.
std::string ratio_figure(const Comparison& comparison);
/// Errors between their bounds on three axes through the narrow gap; their table and plots come into `data`.
std::string gap_figure(const sim::GapCampaign& gap, PageData& data);

/// One self-contained HTML page: what was demanded, Table I, the ratios, the narrow gap, each scene.
std::string comparison_report(const Comparison& comparison);

}  // namespace backwash::report
