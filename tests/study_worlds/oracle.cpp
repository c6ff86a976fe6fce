// SPDX-License-Identifier: BSD-3-Clause
#include "tests/study_worlds/oracle.hpp"

#include <algorithm>
#include <cmath>
#include <functional>

#include "core/study/effects/columns.hpp"
#include "tests/study_worlds/effects.hpp"

namespace study_worlds {

namespace study = backwash::study;

namespace {

/// Mean over each window, and `beyond` seconds on both sides, of what is hidden at its flight's rows.
std::vector<double> window_means(const study::Observations& seen, const std::vector<Table>& flights,
                                 const std::function<double(const Hidden&)>& value, double beyond) {
  std::vector<double> means;
  for (const auto& w : seen.windows) {
    const Table& flight = flights[w.flight];
    double sum = 0, n = 0;
    for (std::size_t i = 0; i < flight.rows.size(); ++i) {
      const double t = flight.rows[i][0] - flight.rows[0][0];
      if (std::abs(t - w.t) <= 0.5 * w.duration + beyond + 1e-9) {
        sum += value(flight.hidden[i]);
        n += 1;
      }
    }
    means.push_back(n > 0 ? sum / n : 0);
  }
  return means;
}

/// ln of what the bursts did to the kurtosis of the gusts: E m⁴/(E m²)² of the factor m that was flown. The table's
/// size sets the bursts' height, and would be this only if they filled another share of the time.
double flown_tail(const std::vector<Table>& flights) {
  double square = 0, fourth = 0, n = 0;
  for (const auto& flight : flights)
    for (const Hidden& h : flight.hidden) {
      square += std::pow(h.burst, 2);
      fourth += std::pow(h.burst, 4);
      n += 1;
    }
  return std::log(n * fourth / (square * square));
}

}  // namespace

std::vector<Compared> compare(const HiddenWorld& world, const std::vector<Table>& flights,
                              const study::Accepted& found) {
  const std::string& cause = found.form->cause();
  std::vector<Compared> all;
  for (const auto& p : found.parameters) {
    const auto& known = causes().at(cause).truth;
    const auto at = known.find(p.name);
    if (at == known.end()) continue;
    if (const auto truth = at->second(world.effects.of(cause), world.effects.shape_of(cause)))
      all.push_back({p.name, p.value, p.low, p.high, *truth, {}});
  }
  if (cause == "heavy_tails")
    for (const auto& p : found.parameters) all.push_back({p.name, p.value, p.low, p.high, flown_tail(flights), {}});
  return all;
}

std::optional<double> parameter_error(const std::vector<Compared>& compared) {
  double off = 0, size = 0;
  for (const auto& c : compared) {
    off += std::pow(c.value - c.truth, 2);
    size += c.truth * c.truth;
  }
  if (compared.empty()) return std::nullopt;
  return std::sqrt(off / size);
}

namespace {

/// What a sagging battery takes goes with the thrust and the current, and both answer the gusts that the residual
/// holds: the part of its hidden push that varies within seconds fits the residual with 14 to 19 times its size. So its
/// column is a mean over 18 s.
constexpr double kBeyondOfBattery = 8;  // s

study::DesignColumn oracle_column(const study::Observations& seen, const std::vector<Table>& flights, double beyond) {
  study::DesignColumn column;
  const auto add = [&](study::Channel channel, const std::function<double(const Hidden&)>& value) {
    auto x = window_means(seen, flights, value, beyond);
    if (std::any_of(x.begin(), x.end(), [](double v) { return std::abs(v) > 1e-9; }))
      column.parts.push_back({channel, std::move(x)});
  };
  for (int i = 0; i < 3; ++i)
    add(static_cast<study::Channel>(study::kMeanX + i), [i](const Hidden& h) { return h.push[i]; });
  for (const auto c : {study::kVarX, study::kVarY, study::kVarZ}) add(c, [](const Hidden& h) { return h.ln_variance; });
  return column;
}

/// The columns in those channels alone that the oracle moves.
std::vector<study::DesignColumn> seen_by(const study::DesignColumn& oracle, std::vector<study::DesignColumn> columns) {
  for (auto& column : columns)
    std::erase_if(column.parts, [&](const auto& part) {
      return std::none_of(oracle.parts.begin(), oracle.parts.end(), [&](auto& o) { return o.channel == part.channel; });
    });
  return columns;
}

}  // namespace

double explained(const study::Observations& seen, const std::vector<Table>& flights) {
  double most = 0;
  for (const auto& [channel, x, aside] : oracle_column(seen, flights, 0).parts) {
    double n = 0, sx = 0, sy = 0, xx = 0, xy = 0, yy = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
      if (!(seen.weight[channel][i] > 0)) continue;
      const double y = seen.y[channel][i];
      n += 1;
      sx += x[i];
      sy += y;
      xx += x[i] * x[i];
      xy += x[i] * y;
      yy += y * y;
    }
    const double vx = xx - sx * sx / n, vy = yy - sy * sy / n, both = xy - sx * sy / n;
    if (n > 2 && vx > 0 && vy > 0) most = std::max(most, both * both / (vx * vy));
  }
  return most;
}

void compare_with_oracle(WorldOutcome& outcome, const study::Accepted& found, const study::Observations& seen,
                         const std::vector<Table>& flights) {
  const double beyond = found.form->cause() == "battery_sag" ? kBeyondOfBattery : 0;
  const study::DesignColumn column = oracle_column(seen, flights, beyond);
  if (column.parts.empty()) return;
  study::Evidence evidence(seen);
  evidence.whiten({column});
  std::vector<study::DesignColumn> both = found.columns, free;
  both.push_back(column);
  if (!found.form->constant) free = study::offsets(both, seen);
  const auto gain = [&](const std::vector<study::DesignColumn>& columns) {
    const auto normal = evidence.normal(columns, free);
    return normal.solvable ? normal.gain() : 0.0;
  };
  const double oracle = gain({column});
  if (oracle > 0) outcome.gain_share = gain(found.columns) / oracle;

  // An interval that is averaged over several shapes is about the size and not about one form's nearest value.
  if (!found.form->shapes.empty()) return;
  auto comparable = seen_by(column, found.columns);
  comparable.push_back(column);
  const auto A = evidence.normal(comparable, free).total;
  const auto p = A.rows() - 1;
  const Eigen::VectorXd best = A.topLeftCorner(p, p).ldlt().solve(A.topRightCorner(p, 1));
  for (auto& c : outcome.compared)
    for (Eigen::Index k = 0; k < p; ++k)
      if (found.form->parameters[static_cast<std::size_t>(k)] == c.name) c.best = best[k];
}

}  // namespace study_worlds
