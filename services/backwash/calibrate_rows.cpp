// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwash/calibrate_rows.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "services/backwash/json.hpp"
#include "services/backwash/sealed_row.hpp"
#include "services/backwash/sha256.hpp"
#include "services/backwash/verb.hpp"
#include "version.hpp"

namespace backwash::services {
namespace {

using namespace study::calibrate;

Json made_with(const CalibrateRowsOf& of) {
  return {{"version", kVersion}, {"vehicle", file_identity(of.vehicle)}, {"model", file_identity(of.model)}};
}

/// Every number of a hover but those of its windows, in one order for both ways.
template <typename H, typename F>
void each_number(H& hover, F take) {
  const auto three = [&](auto& v) {
    for (int k = 0; k < 3; ++k) take(v[k]);
  };
  auto& f = hover.features;
  three(hover.p_W);
  three(hover.push);
  three(hover.push_noise);
  take(hover.tau_w);
  take(f.ground_inverse);
  take(f.corner_xx);
  take(f.corner);
  take(f.wall_distance);
  take(f.height);
  for (auto* list : {&f.ground_decay, &f.wall_xx, &f.wall})
    for (auto& x : *list) take(x);
}

Json row_of(const Hover& hover) {
  Json numbers = Json::array();
  each_number(hover, [&](double x) { numbers.push_back(std::isfinite(x) ? Json(x) : Json()); });
  for (const auto& v : hover.ln_variance)
    for (int k = 0; k < 3; ++k) numbers.push_back(v[k]);
  return numbers;
}

Hover hover_of(const Json& numbers) {
  Hover hover{0, Vec3::Zero(), {}, {}, Vec3::Zero(), Vec3::Zero(), 0};
  std::size_t at = 0;
  // JSON has no infinity, which is the distance to what is not there.
  each_number(hover, [&](double& x) {
    const auto& number = numbers.at(at++);
    x = number.is_null() ? kFar : number.get<double>();
  });
  for (; at < numbers.size(); at += 3)
    hover.ln_variance.emplace_back(numbers.at(at).get<double>(), numbers.at(at + 1).get<double>(),
                                   numbers.at(at + 2).get<double>());
  return hover;
}

Json row_of(const HeightRow& row) {
  return {row.day, row.ln_variance_z, row.ln_speed, row.height, static_cast<int>(row.plate)};
}

HeightRow height_of(const Json& row) {
  const int plate = row.at(4);
  if (plate < static_cast<int>(Plate::none) || plate > static_cast<int>(Plate::not_said))
    throw std::out_of_range("plate");
  return {0, row.at(0), row.at(1), row.at(2), row.at(3), static_cast<Plate>(plate)};
}

/// Which of the maps a row names; the error names it.
std::size_t place_of(const Json& map, const CalibrateRowsOf& of, const std::vector<std::string>& known) {
  const std::string name = map.at("name");
  const auto found = std::ranges::find(of.maps, name);
  if (found == of.maps.end()) throw Failure(kBadData, "was flown in " + name + ", which is not given as --map");
  const auto place = static_cast<std::size_t>(found - of.maps.begin());
  if (map.at("is") != known[place]) throw Failure(kBadData, "was flown in another " + name);
  return place;
}

CalibratedLog log_of(const Json& row, const CalibrateRowsOf& of, const std::vector<std::string>& known) {
  CalibratedLog log;
  log.path = row.at("log");
  if (row.at("map").is_null() != of.maps.empty())
    throw Failure(kBadData, of.maps.empty() ? "was flown in a map: give it as --map" : "was flown without a map");
  if (!of.maps.empty()) log.map = place_of(row.at("map"), of, known);
  const int signal = row.at("signal");
  if (signal < 0 || signal > static_cast<int>(study::Signal::raw)) throw std::out_of_range("signal");
  log.signal = static_cast<study::Signal>(signal);
  log.gated = row.at("gated");
  log.not_tested = row.at("not_tested");
  log.windows = row.at("windows");
  for (const auto& hover : row.at("hovers")) log.hovers.push_back(hover_of(hover));
  for (const auto& height : row.at("heights")) log.heights.push_back(height_of(height));
  return log;
}

}  // namespace

std::string calibrate_row(const CalibratedLog& log, const CalibrateRowsOf& of) {
  Json row{{"log", log.path}, {"log_sha256", sha256_of_file(log.path)}};
  row["made"] = made_with(of);
  row["map"] = log.map ? Json{{"name", of.maps.at(*log.map)}, {"is", file_identity(of.maps.at(*log.map))}} : Json();
  row["signal"] = static_cast<int>(log.signal);
  row["gated"] = log.gated;
  row["not_tested"] = log.not_tested;
  row["windows"] = log.windows;
  row["hovers"] = Json::array();
  row["heights"] = Json::array();
  for (const auto& hover : log.hovers) row["hovers"].push_back(row_of(hover));
  for (const auto& height : log.heights) row["heights"].push_back(row_of(height));
  return sealed(row);
}

std::vector<CalibratedLog> read_calibrate_rows(const std::string& path, const CalibrateRowsOf& of) {
  std::vector<std::string> known;
  for (const auto& map : of.maps) known.push_back(file_identity(map));
  std::vector<CalibratedLog> logs;
  read_sealed(path, "backwash calibrate --rows", made_with(of),
              [&](const Json& row) { logs.push_back(log_of(row, of, known)); });
  return logs;
}

}  // namespace backwash::services
