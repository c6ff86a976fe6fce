// SPDX-License-Identifier: BSD-3-Clause
#include "tests/bench/trace.hpp"

#include <algorithm>
#include <sstream>
#include <stdexcept>

namespace backwash::autopilots {

Trace::Trace(std::istream& csv) {
  std::string line, field;
  std::getline(csv, line);
  while (std::getline(csv, line)) {
    std::istringstream in(line);
    Row row;
    std::getline(in, field, ',');
    row.t = std::stod(field);
    std::getline(in, row.who, ',');
    std::getline(in, row.what, ',');
    while (row.who != "note" && std::getline(in, field, ',')) row.values.push_back(std::stod(field));
    if (row.who == "truth") truth_.push_back(rows_.size());
    rows_.push_back(std::move(row));
  }
  if (truth_.empty()) throw std::runtime_error("a trace without truth");
}

Trace::Maybe Trace::at(const std::string& who, const std::string& what, const std::vector<double>& values, double after,
                       int n) const {
  for (const Row& r : rows_) {
    if (r.t < after || r.who != who || r.what != what || r.values.size() < values.size()) continue;
    if (std::equal(values.begin(), values.end(), r.values.begin()) && n-- == 0) return r.t;
  }
  return std::nullopt;
}

double Trace::truth(double t, std::size_t column) const {
  const auto next = std::ranges::find_if(truth_, [&](std::size_t i) { return rows_[i].t >= t; });
  if (next == truth_.begin()) return rows_[truth_.front()].values[column];
  if (next == truth_.end()) return rows_[truth_.back()].values[column];
  const Row &a = rows_[*(next - 1)], &b = rows_[*next];
  return a.values[column] + (t - a.t) / (b.t - a.t) * (b.values[column] - a.values[column]);
}

Trace::Maybe Trace::crosses(std::size_t column, double value, double after, bool falling) const {
  const double sign = falling ? -1 : 1;
  double t = after, x = sign * (truth(after, column) - value);
  for (const std::size_t i : truth_) {
    if (rows_[i].t <= after) continue;
    const double next = sign * (rows_[i].values[column] - value);
    if (x < 0 && next >= 0) return t - x / (next - x) * (rows_[i].t - t);
    t = rows_[i].t;
    x = next;
  }
  return std::nullopt;
}

double Trace::most(double from, double to, const std::function<double(double)>& f) const {
  double largest = std::max(f(from), f(to));
  for (const std::size_t i : truth_)
    if (rows_[i].t > from && rows_[i].t < to) largest = std::max(largest, f(rows_[i].t));
  return largest;
}

Trace::RunOut Trace::run_out(double t, double until, double slow) const {
  Vec3 way = velocity(t);
  way.z() = 0;
  way.normalize();
  const Vec3 from = position(t);
  RunOut r{most(t, until, [&](double s) { return way.dot(position(s) - from); }), until - t};
  for (double s = t; s < until; s += 0.01)
    if (way.dot(velocity(s)) < slow) return {r.distance, s - t};
  return r;
}

std::vector<std::string> Trace::said(const std::string& who, const std::string& what, double from) const {
  std::vector<std::string> all;
  for (const Row& r : rows_) {
    if (r.t < from || r.who != who || !r.what.starts_with(what)) continue;
    std::ostringstream text;
    text << r.what;
    for (const double v : r.values) text << ' ' << v;
    if (all.empty() || all.back() != text.str()) all.push_back(text.str());
  }
  return all;
}

}  // namespace backwash::autopilots
