// SPDX-License-Identifier: BSD-3-Clause
// Real flights: how often the error leaves the levels that are promised, each vehicle calibrated on its other flights.
#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <limits>

#include "core/log/columns/flight_log.hpp"
#include "core/log/columns/import_airgarage.hpp"
#include "core/log/columns/import_crazypad.hpp"
#include "core/reach/response/coloured_error.hpp"
#include "tests/race/race.hpp"

namespace backwash::race {
namespace {

constexpr std::array kPromised{1e-1, 1e-2, 1e-3};  ///< exits a second
constexpr std::size_t kWindow = 100;               ///< samples of 10 ms on either side: the hover's own place
constexpr double kTravel = 0.5;                    ///< m: an axis of more was flown along

/// Samples of one axis, 10 ms apart.
using Samples = std::vector<double>;

/// A flight of whose set-points the log tells.
struct Tracked {
  std::string name;
  std::array<Samples, 3> p, v, to;  ///< m, m/s, set-point in m
  std::size_t size() const { return p[0].size(); }
};
/// How an axis of a vehicle follows: a = kp (to − p) + kf ṫo − kd v + b, `lag` later, and what is left.
struct Followed {
  Eigen::Vector4d gains = Eigen::Vector4d::Zero();
  double lag = 0, variance = 0, mean = 0, tau_w = 0.1;
};

std::vector<std::string> files_of(const std::string& folder, const std::string& ending) {
  std::vector<std::string> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    if (entry.path().string().ends_with(ending)) files.push_back(entry.path());
  std::ranges::sort(files);
  return files;
}

/// Rate of change over ± 40 ms.
double slope(const Samples& x, std::size_t k) { return (x[k + 4] - x[k - 4]) / 0.08; }

/// In the air and led by set-points, until an accident ends it; nothing of what is too short or told twice.
std::vector<Tracked> nanobench(const std::string& folder) {
  std::vector<Tracked> all;
  for (const auto& file : files_of(folder, ".csv.gz")) {
    const auto log = log::read_csv(file, "t", {}, true);
    if (!log) continue;
    Tracked flight{std::filesystem::path(file).stem().stem(), {}, {}, {}};
    const auto& up = log->column("sp_ctrltarget_z");
    std::size_t led = 0;
    for (std::size_t k = 0; k < up.size(); ++k) {
      led = up[k] > 0.3 ? led + 1 : 0;
      if (led == 0 && flight.size() > 0) break;
      if (led < 300) continue;  // rising
      double off = 0;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const std::string name(1, "xyz"[axis]);
        flight.p[axis].push_back(log->column("p" + name)[k]);
        flight.v[axis].push_back(log->column("v" + name)[k]);
        flight.to[axis].push_back(log->column("sp_ctrltarget_" + name)[k]);
        off = std::max(off, std::abs(flight.p[axis].back() - flight.to[axis].back()));
      }
      if (off > 1) break;
    }
    const auto same = [&](const Tracked& o) { return o.size() == flight.size() && o.p[0] == flight.p[0]; };
    if (flight.size() > 800 && std::ranges::none_of(all, same)) all.push_back(std::move(flight));
  }
  return all;
}

Eigen::Vector4d causes(const Tracked& f, std::size_t axis, std::size_t k) {
  return {f.to[axis][k] - f.p[axis][k], slope(f.to[axis], k), -f.v[axis][k], 1};
}

/// The loop of an axis by least squares over the other flights, at the lag that leaves least; of what is left its
/// variance, correlation time and largest mean of a flight.
Followed followed(const std::vector<Tracked>& all, std::size_t without, std::size_t axis) {
  Followed best;
  best.variance = std::numeric_limits<double>::infinity();
  for (std::size_t late = 0; late <= 30; late += 2) {
    Eigen::Matrix4d A = Eigen::Matrix4d::Zero();
    Eigen::Vector4d b = Eigen::Vector4d::Zero();
    const auto each = [&](const auto& take) {
      for (std::size_t n = 0; n < all.size(); ++n)
        for (std::size_t k = 30; n != without && k + 10 < all[n].size(); ++k)
          take(n, causes(all[n], axis, k - late), slope(all[n].v[axis], k));
    };
    each([&](std::size_t, const Eigen::Vector4d& x, double a) {
      A += x * x.transpose();
      b += a * x;
    });
    Followed now;
    now.gains = A.ldlt().solve(b);
    now.lag = 0.01 * static_cast<double>(late);
    std::vector<Samples> left(all.size());
    each([&](std::size_t n, const Eigen::Vector4d& x, double a) { left[n].push_back(a - now.gains.dot(x)); });
    double squares = 0, later = 0, count = 0;
    for (const Samples& w : left) {
      double mean = 0;
      for (const double x : w) mean += x / static_cast<double>(w.size());
      now.mean = std::max(now.mean, std::abs(mean));
      for (std::size_t k = 0; k + 10 < w.size(); ++k) {
        squares += std::pow(w[k] - mean, 2);
        later += (w[k] - mean) * (w[k + 10] - mean);
        ++count;
      }
    }
    now.variance = squares / count;
    now.tau_w = 0.1 / std::max(0.2, -std::log(std::max(1e-3, later / squares)));
    if (now.variance < best.variance) best = now;
  }
  return best;
}

/// The error about the motion that the loop predicts from the flight's start.
Samples error_of(const Tracked& f, const Followed& loop, std::size_t axis) {
  double p = f.p[axis][4], v = f.v[axis][4], a = slope(f.v[axis], 4);
  const double kept = loop.lag > 0 ? std::exp(-0.01 / loop.lag) : 0;
  Samples e;
  for (std::size_t k = 4; k + 4 < f.size(); ++k) {
    e.push_back(f.p[axis][k] - p);
    const double u = loop.gains.dot(Eigen::Vector4d(f.to[axis][k] - p, slope(f.to[axis], k), -v, 1));
    a = u + kept * (a - u);
    p += 0.01 * v + 0.5e-4 * a;
    v += 0.01 * a;
  }
  e.erase(e.begin(), e.begin() + 100);  // the lag's own start
  return e;
}

/// Levels of an error of this deviation and turn rate beside `steady`, and how often it leaves them.
void print_exits(const char* data, const std::string& flight, char axis, const std::vector<Samples>& pieces,
                 double sigma, double turn, double steady) {
  double seconds = 0, squares = 0;
  std::array<int, kPromised.size()> exits{}, spent{};
  for (const Samples& e : pieces) {
    seconds += 0.01 * static_cast<double>(e.size());
    for (const double x : e) squares += 0.01 * x * x;
    for (std::size_t n = 0; n < kPromised.size(); ++n) {
      const double level =
          steady + sigma * reach::exit_level(turn, std::numeric_limits<double>::infinity(), kPromised[n]);
      for (std::size_t k = 0; k < e.size(); ++k) {
        const bool out = std::abs(e[k]) > level;
        spent[n] += out;
        exits[n] += out && (k == 0 || std::abs(e[k - 1]) <= level);
      }
    }
  }
  if (seconds < 4) return;
  std::printf("%s,%s,%c,%.1f,%.4f,%.4f,%.2f,%.4f", data, flight.c_str(), axis, seconds, std::sqrt(squares / seconds),
              sigma, turn, steady);
  for (std::size_t n = 0; n < kPromised.size(); ++n) std::printf(",%d,%.2f", exits[n], 0.01 * spent[n]);
  std::printf("\n");
}

void judge_tracked(const std::vector<Tracked>& all) {
  for (std::size_t n = 0; n < all.size(); ++n)
    for (std::size_t axis = 0; axis < 2; ++axis) {  // the height is hardly led: its gains cannot be told
      const Followed loop = followed(all, n, axis);
      const double kp = loop.gains[0], kd = loop.gains[2];
      if (!(kp > 0 && kd > 0)) continue;
      const reach::AxisLoop closed{kp, kd, 0, loop.lag};
      const reach::ColouredStep step(closed, loop.tau_w, kControlPeriod);
      reach::ErrorCovariance error(step);
      for (int k = 0; k < 4000; ++k) error.advance(std::sqrt(loop.variance));
      if (!std::isfinite(error.position_deviation())) continue;
      std::fprintf(stderr, "%s %c: kp %.2f kf %.2f kd %.2f lag %.2f s, w: sd %.2f m/s², tau %.2f s, mean %.2f\n",
                   all[n].name.c_str(), "xyz"[axis], kp, loop.gains[1], kd, loop.lag, std::sqrt(loop.variance),
                   loop.tau_w, loop.mean);
      print_exits(
          "nanobench", all[n].name, "xyz" [axis], { error_of(all[n], loop, axis) }, error.position_deviation(),
          error.turn_rate(), loop.mean / kp);
    }
}

/// An axis that no set-point moves, of a flight that tells none: pieces about the mean of the two seconds around.
struct Hover {
  std::string name, vehicle;
  std::array<std::vector<Samples>, 3> pieces;
};

void add_piece(std::vector<Samples>& pieces, const Samples& p) {
  if (p.size() < 4 * kWindow) return;
  std::vector<double> sum{0};
  for (const double x : p) sum.push_back(sum.back() + x);
  Samples e;
  for (std::size_t k = kWindow; k + kWindow < p.size(); ++k)
    e.push_back(p[k] - (sum[k + kWindow] - sum[k - kWindow]) / (2.0 * kWindow));
  pieces.push_back(e);
}

/// In the air: `above` where it stood. Rows are put on a grid of 10 ms; a gap of 0.1 s ends a piece. Axes that travel
/// are left out.
Hover hover_of(const std::string& name, const std::string& vehicle, const log::FlightLog& log, double above) {
  Hover hover{name, vehicle, {}};
  const auto &t = log.t_s, &z = log.column("z_m");
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const auto& p = log.column(axis == 0 ? "x_m" : "y_m");
    const auto [least, most] = std::ranges::minmax(p);
    if (most - least > kTravel) continue;
    Samples piece;
    double next = t[0];
    for (std::size_t k = 1; k < t.size(); ++k) {
      if (z[k] < z[0] + above || t[k] - t[k - 1] > 0.1) {
        add_piece(hover.pieces[axis], piece);
        piece.clear();
        next = t[k];
      }
      for (; next < t[k]; next += 0.01)
        piece.push_back(p[k - 1] + (p[k] - p[k - 1]) * (next - t[k - 1]) / (t[k] - t[k - 1]));
    }
    add_piece(hover.pieces[axis], piece);
  }
  return hover;
}

void judge_hovers(const char* data, const std::vector<Hover>& all) {
  for (std::size_t n = 0; n < all.size(); ++n)
    for (std::size_t axis = 0; axis < 2; ++axis) {
      std::vector<double> variances, rates;
      for (std::size_t m = 0; m < all.size(); ++m) {
        if (m == n || all[m].vehicle != all[n].vehicle || all[m].pieces[axis].empty()) continue;
        double variance = 0, rate = 0, count = 0;
        for (const Samples& e : all[m].pieces[axis])
          for (std::size_t k = 4; k + 4 < e.size(); ++k) {
            variance += e[k] * e[k];
            rate += std::pow(slope(e, k), 2);
            ++count;
          }
        if (count > 0) {
          variances.push_back(variance / count);
          rates.push_back(rate / variance);
        }
      }
      const auto flights = static_cast<double>(variances.size());
      if (flights == 0) continue;
      double mean = 0, turn = 0, log_mean = 0, scatter = 0;
      for (const double v : variances) {
        mean += v / flights;
        log_mean += std::log(v) / flights;
      }
      for (const double v : variances) scatter += std::pow(std::log(v) - log_mean, 2) / std::max(1.0, flights - 1);
      for (const double r : rates) turn += r / flights;
      const auto& pieces = all[n].pieces[axis];
      print_exits(data, all[n].name, "xyz"[axis], pieces, std::sqrt(mean), std::sqrt(turn), 0);
      if (flights < 5) continue;  // 19 of 20 flights are calmer than this, as far as these tell
      const double most = std::exp(log_mean + 1.64 * std::sqrt(scatter * (1 + 1 / flights)));
      print_exits((std::string(data) + " 95 %").c_str(), all[n].name, "xyz"[axis], pieces, std::sqrt(most),
                  std::sqrt(turn), 0);
    }
}

}  // namespace

int judge_real_flights(const std::string& folder) {
  std::printf(
      "data,flight,axis,seconds,rms_m,sigma_m,turn_rate,steady_m,exits_1e-1,out_1e-1_s,exits_1e-2,out_1e-2_s,"
      "exits_1e-3,out_1e-3_s\n");
  judge_tracked(nanobench(folder + "/nanobench"));
  std::vector<Hover> hovers;
  for (const auto& file : files_of(folder + "/airgarage", ".csv"))
    if (const auto log = log::import_airgarage(file); log)
      hovers.push_back(hover_of(std::filesystem::path(file).stem(), "one", *log, 0.03));
  judge_hovers("airgarage", hovers);
  hovers.clear();
  for (const auto& file : files_of(folder + "/crazypad", ".csv"))
    if (const auto log = log::import_crazypad(file); log) {
      const std::string name = std::filesystem::path(file).stem();
      hovers.push_back(hover_of(name, name.substr(0, name.find("__")), *log, 0.3));
    }
  judge_hovers("crazypad", hovers);
  return 0;
}

}  // namespace backwash::race
