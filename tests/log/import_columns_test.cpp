// SPDX-License-Identifier: BSD-3-Clause
// Tables of others by a column map: units, frames, rates, and what physics says of them.
#include <gtest/gtest.h>

#include <unistd.h>

#include <Eigen/Geometry>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <numbers>

#include "core/log/autopilot/same_flight.hpp"
#include "core/log/columns/import_columns.hpp"
#include "core/log/columns/labels.hpp"
#include "core/types/geometry.hpp"

namespace backwash::log {
namespace {

/// A craft on a rounded path that tilts as it accelerates: what a table says of it, in our frames.
struct Truth {
  Vec3 p, v, a;
  Eigen::Quaterniond q;  ///< body to world
};
Truth truth(double t) {
  const Vec3 size(1.0, 0.7, 0.2), rate(1.9, 1.3, 2.3);
  Truth s;
  for (int i = 0; i < 3; ++i) {
    s.p[i] = size[i] * std::sin(rate[i] * t);
    s.v[i] = size[i] * rate[i] * std::cos(rate[i] * t);
    s.a[i] = -size[i] * rate[i] * rate[i] * std::sin(rate[i] * t);
  }
  const Vec3 up = (s.a + Vec3(0, 0, kGravity)).normalized();
  s.q = Eigen::Quaterniond::FromTwoVectors(Vec3::UnitZ(), up) * Eigen::AngleAxisd(0.4, Vec3::UnitZ());
  return s;
}
const Eigen::Quaterniond kEnuOfNed(0, std::sqrt(0.5), std::sqrt(0.5), 0), kFluOfFrd(0, 1, 0, 0);

/// A row of a table.
std::string line(std::initializer_list<double> cells) {
  std::string text;
  char number[32];
  for (const double v : cells) {
    std::snprintf(number, sizeof number, text.empty() ? "%.16g" : ",%.12g", v);
    text += number;
  }
  return text;
}

class ImportColumns : public testing::Test {
 protected:
  std::string path_ =
      std::filesystem::temp_directory_path() / ("backwash_columns." + std::to_string(getpid()) + ".csv");
  ~ImportColumns() override { std::filesystem::remove(path_); }

  /// A table of `rows` rows at 100 Hz whose cells `row` writes for a time.
  void table(const std::string& header, const std::function<std::string(double)>& row, int rows = 800) {
    std::ofstream file(path_);
    file << header << "\n";
    for (int k = 0; k < rows; ++k) file << row(0.01 * k) << "\n";
  }
  /// The path with velocity and acceleration as a wrong map would have them: each multiplied by a matrix.
  void motion(const Mat3& of_v, const Mat3& of_a) {
    table("t,x,y,z,vx,vy,vz,ax,ay,az", [&](double t) {
      const Truth s = truth(t);
      const Vec3 v = of_v * s.v, a = of_a * s.a;
      return line({t, s.p.x(), s.p.y(), s.p.z(), v.x(), v.y(), v.z(), a.x(), a.y(), a.z()});
    });
  }
  static ColumnMap motion_map() {
    ColumnMap map;
    map.world = Turn::Identity();
    for (const auto& [ours, theirs] : std::map<std::string, std::string>{{"t_s", "t"},
                                                                         {"x_m", "x"},
                                                                         {"y_m", "y"},
                                                                         {"z_m", "z"},
                                                                         {"vx_mps", "vx"},
                                                                         {"vy_mps", "vy"},
                                                                         {"vz_mps", "vz"},
                                                                         {"ax_mps2", "ax"},
                                                                         {"ay_mps2", "ay"},
                                                                         {"az_mps2", "az"}})
      map.columns[ours] = {theirs, ""};
    return map;
  }
  std::string refusal(const ColumnMap& map) const {
    const auto log = import_columns(path_, map);
    return log ? "" : log.error().message;
  }
  /// Why it is refused, or what is left out of it.
  std::string told(const ColumnMap& map) const {
    const auto log = import_columns(path_, map);
    if (!log) return log.error().message;
    std::string all;
    for (const auto& note : log->notes) all += note + "\n";
    return all;
  }
};

TEST_F(ImportColumns, ATableInNedWithBodyForcesInGAndStampsInMicrosecondsIsTheFlightItWas) {
  table("stamp,n,e,d,qa,qb,qc,qd,fx,fy,fz,bat", [](double t) {
    const Truth s = truth(t);
    const Vec3 p = kEnuOfNed * s.p * 1000;
    const Eigen::Quaterniond q = kEnuOfNed * s.q * kFluOfFrd;
    const Vec3 f = q.conjugate() * (kEnuOfNed * (s.a + Vec3(0, 0, kGravity))) / kGravity;
    std::string cells =
        line({1.7e15 + std::round(t * 1e6), p.x(), p.y(), p.z(), q.w(), q.x(), q.y(), q.z(), f.x(), f.y(), f.z()});
    return cells += std::llround(t * 100) % 10 == 0 ? ",4012" : ",";  // ten times as rare
  });
  ColumnMap map;
  map.world = turn_of("y, x, -z");
  map.body = turn_of("x, -y, -z");
  map.columns = {{"t_s", {"stamp", "us"}},
                 {"x_m", {"n", "mm"}},
                 {"y_m", {"e", "mm"}},
                 {"z_m", {"d", "mm"}},
                 {"qw", {"qa", ""}},
                 {"qx", {"qb", ""}},
                 {"qy", {"qc", ""}},
                 {"qz", {"qd", ""}},
                 {"specific_force_x", {"fx", "g"}},
                 {"specific_force_y", {"fy", "g"}},
                 {"specific_force_z", {"fz", "g"}},
                 {"battery_v", {"bat", "mV"}}};
  const auto log = import_columns(path_, map);
  ASSERT_TRUE(log) << log.error().message;
  ASSERT_GT(log->t_s.size(), 760u);
  EXPECT_FALSE(log->has("specific_force_x"));
  for (std::size_t k = 0; k < log->t_s.size(); k += 37) {
    const Truth s = truth(log->t_s[k]);
    EXPECT_NEAR(log->column("x_m")[k], s.p.x(), 1e-5);
    EXPECT_NEAR(log->column("z_m")[k], s.p.z(), 1e-5);
    EXPECT_NEAR(log->column("vy_mps")[k], s.v.y(), 0.02);
    EXPECT_NEAR(log->column("ax_mps2")[k], s.a.x(), 1e-4);
    EXPECT_NEAR(log->column("az_mps2")[k], s.a.z(), 1e-4);
    const Eigen::Quaterniond q(log->column("qw")[k], log->column("qx")[k], log->column("qy")[k], log->column("qz")[k]);
    EXPECT_NEAR(std::abs(q.dot(s.q)), 1, 1e-6);
    EXPECT_NEAR(log->column("battery_v")[k], 4.012, 1e-12);
  }
}

TEST_F(ImportColumns, AnglesAreRollPitchYaw) {
  table("t,x,y,z,roll,pitch,yaw", [](double t) {
    const Truth s = truth(t);
    const Mat3 R = s.q.toRotationMatrix();
    const double to_degree = 180 / std::numbers::pi;
    return line({t, s.p.x(), s.p.y(), s.p.z(), to_degree * std::atan2(R(2, 1), R(2, 2)),
                 -to_degree * std::asin(R(2, 0)), to_degree * std::atan2(R(1, 0), R(0, 0))});
  });
  ColumnMap map;
  map.columns = {{"t_s", {"t", ""}},        {"x_m", {"x", ""}},          {"y_m", {"y", ""}},     {"z_m", {"z", ""}},
                 {"roll", {"roll", "deg"}}, {"pitch", {"pitch", "deg"}}, {"yaw", {"yaw", "deg"}}};
  const auto log = import_columns(path_, map);
  ASSERT_TRUE(log) << log.error().message;
  for (std::size_t k = 0; k < log->t_s.size(); k += 53) {
    const Eigen::Quaterniond q(log->column("qw")[k], log->column("qx")[k], log->column("qy")[k], log->column("qz")[k]);
    EXPECT_NEAR(std::abs(q.dot(truth(log->t_s[k]).q)), 1, 1e-6);
  }
  map.world = Turn::Identity();
  map.columns["roll"].unit = map.columns["pitch"].unit = "rad";
  EXPECT_NE(told(map).find("tilt along"), std::string::npos) << told(map);
  EXPECT_NE(told(map).find("left out: qw, qx, qy, qz"), std::string::npos) << told(map);
}

TEST_F(ImportColumns, WhatPhysicsContradictsIsToldWithTheUnitSignOrAxisThatWouldFit) {
  const Mat3 one = Mat3::Identity();
  Mat3 flipped = one, swapped = Mat3::Zero();
  flipped(2, 2) = -1;
  swapped(0, 1) = swapped(1, 0) = swapped(2, 2) = 1;
  motion(one, one);
  EXPECT_EQ(refusal(motion_map()), "");
  struct Wrong {
    Mat3 of_v, of_a;
    const char* words;
  };
  for (const auto& w :
       {Wrong{1000 * one, one, "vx_mps is in mm/s"}, Wrong{flipped, one, "turn the sign of vz_mps or of z_m; left out"},
        Wrong{swapped, one, "are vx_mps and vy_mps exchanged, or the world turned?; left out"},
        Wrong{one, one / kGravity, "ax_mps2 is in g"}, Wrong{one, -one, "turn the sign of ax_mps2"},
        Wrong{one, flipped, "turn the sign of az_mps2 or of z_m; left out"}}) {
    motion(w.of_v, w.of_a);
    EXPECT_NE(told(motion_map()).find(w.words), std::string::npos) << w.words << ": " << told(motion_map());
  }
  // Two thirds of a moved craft's noise is no contradiction, and neither is one that stands still.
  table("t,x,y,z,vx,vy,vz,ax,ay,az", [](double t) {
    return line({t, 0.001, 0, 0, 0.03 * std::sin(40 * t), 0, 0, 0.1, 0, 0});
  });
  EXPECT_EQ(refusal(motion_map()), "");
}

TEST_F(ImportColumns, EveryRefusalSaysWhat) {
  const auto with = [&](const std::string& ours, const ColumnMap::Source& theirs) {
    ColumnMap map = motion_map();
    map.columns[ours] = theirs;
    return refusal(map);
  };
  motion(Mat3::Identity(), Mat3::Identity());
  EXPECT_NE(with("vx_mps", {"speed", ""}).find("no column 'speed', which the column map takes for vx_mps"),
            std::string::npos);
  EXPECT_NE(with("t_s", {"t", "ms"}).find("is the unit of the time right?"), std::string::npos);
  EXPECT_NE(with("thrust", {"x", "1"}).find("thrust goes from -1"), std::string::npos) << "negative";
  table("t,x,y,z,vx,vy,vz,ax,ay,az", [](double t) { return line({t > 3 ? t - 1 : t, 0, 0, 0, 0, 0, 0, 0, 0, 0}); });
  EXPECT_NE(refusal(motion_map()).find("'t' goes back"), std::string::npos);
  table(
      "t,x,y,z,vx,vy,vz,ax,ay,az",
      [](double t) {
        return line({t, 0, 0, 0, 0, 0, 0, 0, 0, 0});
      },
      90);
  EXPECT_NE(refusal(motion_map()).find("fewer than 100 rows"), std::string::npos);
  table("t,x,y,z,vx,vy,vz,ax,ay,az", [](double t) { return line({t, 0, 0}) += ",zero,0,0,0,0,0,0"; });
  EXPECT_NE(refusal(motion_map()).find(":2: column 'z' holds 'zero'"), std::string::npos);
  ColumnMap force = motion_map();
  for (const char* a : {"ax_mps2", "ay_mps2", "az_mps2"}) force.columns.erase(a);
  force.columns["specific_force_x"].name = "ax";
  force.columns["specific_force_y"].name = "ay";
  force.columns["specific_force_z"].name = "az";
  motion(Mat3::Identity(), Mat3::Identity());
  EXPECT_NE(refusal(force).find("give an attitude as well"), std::string::npos);
  ColumnMap quaternion = motion_map();
  for (const char* q : {"qw", "qx", "qy", "qz"}) quaternion.columns[q].name = "x";
  EXPECT_NE(refusal(quaternion).find("no unit quaternion"), std::string::npos);
}

TEST_F(ImportColumns, TablesThatAreNoFlightAreRefusedAndCrashNothing) {
  ColumnMap map;
  map.world = Turn::Identity();
  map.columns = {{"t_s", {"t", ""}}, {"x_m", {"x", ""}}, {"y_m", {"y", ""}}, {"z_m", {"z", ""}}};
  table("t,x,y,z", [](double) { return std::string("nan,0,0,0"); });
  EXPECT_NE(refusal(map).find("fewer than 100 rows"), std::string::npos) << refusal(map);
  table("t,x,y,z", [](double) { return std::string(); });
  EXPECT_NE(refusal(map).find("no rows of numbers"), std::string::npos) << refusal(map);
  table("t,x,y,z", [](double t) { return line({5 * t, std::sin(t), 0, 1}); });  // 20 Hz
  EXPECT_NE(refusal(map).find("too few rows around each position"), std::string::npos) << refusal(map);
  map.columns["y_m"].name = "t";
  EXPECT_NE(refusal(map).find("is the time, and y_m as well"), std::string::npos) << refusal(map);
}

TEST_F(ImportColumns, HeightsOfANedTableAreTurnedToo) {
  table("t,x,y,z,floor", [](double t) {
    const Vec3 p = kEnuOfNed * truth(t).p;
    return line({t, p.x(), p.y(), p.z(), 1.5});
  });
  ColumnMap map;
  map.world = turn_of("y, x, -z");
  map.columns = {
      {"t_s", {"t", ""}}, {"x_m", {"x", ""}}, {"y_m", {"y", ""}}, {"z_m", {"z", ""}}, {"surface_z_m", {"floor", ""}}};
  const auto log = import_columns(path_, map);
  ASSERT_TRUE(log) << log.error().message;
  EXPECT_EQ(log->column("surface_z_m").front(), -1.5);
}

TEST_F(ImportColumns, RowsWithoutAPositionOrWithTheLastStampAreLeftOutAndTold) {
  table("t,x,y,z", [](double t) {
    const Truth s = truth(t);
    const long k = std::lround(t * 100);
    if (k % 50 == 7) return line({t}) += ",nan,,0";
    return line({k % 50 == 9 ? t - 0.01 : t, s.p.x(), s.p.y(), s.p.z()});
  });
  ColumnMap map;
  map.world = Turn::Identity();
  map.columns = {{"t_s", {"t", "s"}}, {"x_m", {"x", "m"}}, {"y_m", {"y", "m"}}, {"z_m", {"z", "m"}}};
  const auto log = import_columns(path_, map);
  ASSERT_TRUE(log) << log.error().message;
  EXPECT_NE(told(map).find("16 of 800 rows (2 %) hold no place"), std::string::npos) << told(map);
  EXPECT_NE(told(map).find("16 of 800 rows (2 %) repeat the stamp before"), std::string::npos) << told(map);
  for (std::size_t k = 1; k < log->t_s.size(); ++k) EXPECT_GT(log->t_s[k], log->t_s[k - 1]);
  EXPECT_LT(log->t_s.size(), 800u - 2 * 16 - 10);
  EXPECT_GT(log->t_s.size(), 800u - 2 * 16 - 20);
}

TEST_F(ImportColumns, ABodyThatWasLostIsAGapToldByItsShare) {
  // As programs for motion capture write it: a pose of zeros, the pose before again, nothing.
  for (const int way : {0, 1, 2, 3}) {
    table(way == 3 ? "t,x,y,z" : "t,x,y,z,qw,qx,qy,qz", [&](double t) {
      const bool gone = t > 3.005 && t < 3.505;
      const Truth s = truth(way == 1 && gone ? 3 : t);
      if (gone && way != 1) return line({t}) += way == 0 ? ",0,0,0,0,0,0,0" : way == 2 ? ",,,,,,," : ",0,0,0";
      std::string cells = line({t, s.p.x() + 5, s.p.y(), s.p.z()});
      if (way < 3) cells += line({0, s.q.w(), s.q.x(), s.q.y(), s.q.z()}).substr(1);
      return cells;
    });
    ColumnMap map;
    map.world = Turn::Identity();
    for (const auto& [ours, theirs] : std::map<std::string, std::string>{{"t_s", "t"},
                                                                         {"x_m", "x"},
                                                                         {"y_m", "y"},
                                                                         {"z_m", "z"},
                                                                         {"qw", "qw"},
                                                                         {"qx", "qx"},
                                                                         {"qy", "qy"},
                                                                         {"qz", "qz"}})
      if (way < 3 || ours[0] != 'q') map.columns[ours] = {theirs, ""};
    const auto log = import_columns(path_, map);
    ASSERT_TRUE(log) << way << log.error().message;
    EXPECT_NE(
        told(map).find(way == 1 ? "51 of 800 rows (6.4 %) hold one place" : "50 of 800 rows (6.2 %) hold no place"),
        std::string::npos)
        << way << told(map);
    for (std::size_t k = 0; k < log->t_s.size(); ++k) {
      EXPECT_FALSE(log->t_s[k] > 3.03 && log->t_s[k] < 3.47) << way;
      EXPECT_NEAR(log->column("ax_mps2")[k], truth(log->t_s[k]).a.x(), 0.3) << way << " " << log->t_s[k];
    }
  }
}

TEST_F(ImportColumns, PositionsThatMoveAsNoMultirotorDoesAskForTheirUnit) {
  const auto flown = [&](double unit, bool turned) {
    table(turned ? "t,x,y,z,qw,qx,qy,qz" : "t,x,y,z", [&](double t) {
      const Truth s = truth(t);
      return turned ? line({t, s.p.x() / unit, s.p.y() / unit, s.p.z() / unit, s.q.w(), s.q.x(), s.q.y(), s.q.z()})
                    : line({t, s.p.x() / unit, s.p.y() / unit, s.p.z() / unit});
    });
    ColumnMap map;
    map.world = Turn::Identity();
    for (const char* name : {"x", "y", "z"}) map.columns[std::string(name) + "_m"] = {name, ""};
    map.columns["t_s"] = {"t", ""};
    if (turned)
      for (const char* name : {"qw", "qx", "qy", "qz"}) map.columns[name] = {name, ""};
    return told(map);
  };
  for (const bool turned : {false, true}) EXPECT_EQ(flown(1, turned), "");
  EXPECT_NE(flown(1e-3, false).find("give their unit, which fits if it is cm (15"), std::string::npos)
      << flown(1e-3, false);
  EXPECT_NE(flown(1e-2, false).find("give their unit"), std::string::npos) << flown(1e-2, false);
  EXPECT_NE(flown(0.1, true).find("left out: qw"), std::string::npos) << "no unit: " << flown(0.1, true);
}

TEST_F(ImportColumns, TheUnitThatTheTableStatesHoldsUnlessTheMapKnowsBetter) {
  table("t [ms],x [mm],y [mm],z_mm", [](double t) {
    const Vec3 p = 1000 * truth(t).p;
    return line({1000 * t, p.x(), p.y(), p.z()});
  });
  ColumnMap map;
  map.world = Turn::Identity();
  map.columns = {{"t_s", {"t", ""}}, {"x_m", {"x", ""}}, {"y_m", {"y", ""}}, {"z_m", {"z_mm", ""}}};
  const auto log = import_columns(path_, map);
  ASSERT_TRUE(log) << log.error().message;
  for (std::size_t k = 0; k < log->t_s.size(); k += 37)
    for (const auto& [name, axis] : {std::pair{"x_m", 0}, {"z_m", 2}})
      EXPECT_NEAR(log->column(name)[k], truth(log->t_s[k]).p[axis], 1e-6);
  map.columns["x_m"].unit = "cm";
  EXPECT_EQ(import_columns(path_, map)->column("x_m").back(), 10 * log->column("x_m").back());
  map.columns["qw"] = map.columns["qx"] = map.columns["qy"] = map.columns["qz"] = {"x", ""};
  EXPECT_NE(refusal(map).find("column 'x' is in mm, which is no unit of qw"), std::string::npos) << refusal(map);
}

TEST_F(ImportColumns, AnAttitudeReadWronglyIsToldByTheFlight) {
  ColumnMap map;
  map.columns = {{"t_s", {"t", ""}}, {"x_m", {"x", ""}}, {"y_m", {"y", ""}}, {"z_m", {"z", ""}}};
  for (const char* name : {"qw", "qx", "qy", "qz"}) map.columns[name] = {name, ""};
  const auto flown = [&](const char* header, bool inverse) {
    table(header, [&](double t) {
      const Truth s = truth(t);
      const Eigen::Quaterniond q = inverse ? s.q.conjugate() : s.q;
      return line({t, s.p.x(), s.p.y(), s.p.z() + 1, q.w(), q.x(), q.y(), q.z()});
    });
    return refusal(map);
  };
  EXPECT_EQ(flown("t,x,y,z,qw,qx,qy,qz", false), "");
  const auto order = flown("t,x,y,z,qx,qy,qz,qw", false);  // the scalar stands first, the header says last
  EXPECT_NE(order.find("qw from the column given as qx, qx from the column given as qy"), std::string::npos) << order;
  const auto inverse = flown("t,x,y,z,qw,qx,qy,qz", true);
  EXPECT_NE(inverse.find("give frame.attitude = \"world to body\""), std::string::npos) << inverse;
  map.world_to_body = true;
  EXPECT_EQ(refusal(map), "");
  EXPECT_NE(flown("t,x,y,z,qw,qx,qy,qz", false), "");
}

TEST_F(ImportColumns, OfNoTurnAFlightIsWrittenWhoseAxesContradictIt) {
  int right = 0, asked = 0;
  for (const char* world : {"x, y, z", "y, x, -z", "x, -z, y", "z, x, y", "-y, -z, x", "y, z, x"})
    for (const char* body : {"x, y, z", "x, -y, -z", "x, -z, y", "z, -y, x"})
      for (const bool inverse : {false, true})
        for (const double moved : {0.0, 1.0})
          for (const bool force : {false, true}) {
            const Mat3 of_world = turn_of(world)->transpose(), of_body = *turn_of(body);
            table(force ? "t,x,y,z,qw,qx,qy,qz,fx,fy,fz" : "t,x,y,z,qw,qx,qy,qz", [&](double t) {
              Truth s = truth(t);
              if (moved == 0)
                s = {0.01 * s.p, 0.01 * s.v, 0.01 * s.a, Eigen::Quaterniond(Eigen::AngleAxisd(0.4, Vec3::UnitZ()))};
              const Vec3 p = of_world * (s.p + Vec3(0.6, 0.8, 1.2));
              Eigen::Quaterniond q(Mat3(of_world * s.q.toRotationMatrix() * of_body));
              const Vec3 f =
                  of_body.transpose() * (s.q.conjugate() * Vec3(s.a + Vec3(0.05 * std::sin(777 * t), 0, kGravity)));
              if (inverse) q = q.conjugate();
              std::string cells = line({t, p.x(), p.y(), p.z()}) + line({0, q.w(), q.x(), q.y(), q.z()}).substr(1);
              return force ? cells + line({0, f.x(), f.y(), f.z()}).substr(1) : cells;
            });
            ColumnMap map;
            map.columns = {{"t_s", {"t", ""}}, {"x_m", {"x", ""}}, {"y_m", {"y", ""}}, {"z_m", {"z", ""}}};
            for (const char* name : {"qw", "qx", "qy", "qz"}) map.columns[name] = {name, ""};
            for (const char* axis : {"x", "y", "z"})
              if (force) map.columns[std::string("specific_force_") + axis] = {std::string("f") + axis, ""};
            const auto log = import_columns(path_, map);
            const std::string which = std::string(world) + "; " + body + "; " + std::to_string(inverse) +
                                      std::to_string(moved) + std::to_string(force);
            if (!log) {
              EXPECT_NE(log.error().message.find("frame."), std::string::npos) << which << log.error().message;
              ++asked;
              continue;
            }
            ++right;
            for (std::size_t k = 0; k < log->t_s.size(); k += 97)
              EXPECT_NEAR(log->column("z_m")[k], (moved == 0 ? 0.01 : 1) * truth(log->t_s[k]).p.z() + 1.2, 1e-4)
                  << which;
          }
  EXPECT_GE(right, 3);
  EXPECT_GE(asked, 150);
}

TEST_F(ImportColumns, WhatNeitherTheFlightNorTheMapTellsIsAsked) {
  table("t,x,y,z,qw,qx,qy,qz", [](double t) {
    const Vec3 p = 0.002 * truth(t).p;
    return line({t, p.x() + 0.6, p.y() + 1.2, p.z() + 0.8, 1, 0, 0, 0});
  });
  ColumnMap map;
  map.columns = {{"t_s", {"t", ""}}, {"x_m", {"x", ""}}, {"y_m", {"y", ""}}, {"z_m", {"z", ""}}};
  EXPECT_NE(refusal(map).find("give frame.world = "), std::string::npos) << refusal(map);
  for (const char* name : {"qw", "qx", "qy", "qz"}) map.columns[name] = {name, ""};
  EXPECT_NE(refusal(map).find("give frame.world = "), std::string::npos) << refusal(map);
  map.world = turn_of("x, -z, y");
  EXPECT_NE(refusal(map).find("give frame.body = \"x, -z, y\""), std::string::npos) << refusal(map);
  map.body = turn_of("x, -z, y");
  const auto log = import_columns(path_, map);
  ASSERT_TRUE(log) << log.error().message;
  EXPECT_NEAR(log->column("z_m")[50], 1.2, 0.01);
  EXPECT_NEAR(log->column("y_m")[50], -0.8, 0.01);
}

TEST_F(ImportColumns, WhatWasDrawnOnAfterTheLastSampleIsCutOffAndTold) {
  table("t,x,y,z,vx,vy,vz,ax,ay,az", [](double t) {
    const Truth s = truth(std::min(t, 6.0)), before = truth(5.99);
    const Vec3 a = t > 6 ? Vec3(s.a + (t - 6) / 0.01 * (s.a - before.a)) : s.a;
    const Vec3 p = truth(t).p, v = truth(t).v;
    return line({t, p.x(), p.y(), p.z(), v.x(), v.y(), v.z(), a.x(), a.y(), a.z()});
  });
  const auto log = import_columns(path_, motion_map());
  ASSERT_TRUE(log) << log.error().message;
  EXPECT_NEAR(log->t_s.back(), 6.0, 0.03);
  ASSERT_EQ(log->notes.size(), 1u);
  EXPECT_NE(log->notes[0].find("straight line"), std::string::npos);
}

TEST_F(ImportColumns, AFlightIsFoundAgainUnderAnotherNameAndCutShort) {
  const auto flight = [](double from, double to) {
    FlightLog log;
    for (double t = from; t < to; t += 0.01) {
      log.t_s.push_back(t - from);
      for (int i = 0; i < 3; ++i)
        log.columns[std::array{"x_m", "y_m", "z_m"}[static_cast<std::size_t>(i)]].push_back(truth(t).p[i]);
    }
    return log;
  };
  const FlightMark whole(flight(0, 20)), part(flight(0, 12)), other(flight(20.003, 40));
  EXPECT_GT(whole.shared(part), 0.99);
  EXPECT_LT(whole.shared(other), 0.01);
  FlightLog still = flight(0, 0.3);
  for (int k = 0; k < 500; ++k)
    for (auto& [name, column] : still.columns) column.push_back(column.back());
  still.t_s.resize(still.columns["x_m"].size());
  EXPECT_EQ(whole.shared(FlightMark(still)), 0) << "30 places say nothing";
}

// What a table beside the recordings says of them.

class LabelsTest : public testing::Test {
 protected:
  std::string path_ = (std::filesystem::temp_directory_path() / ("labels-" + std::to_string(::getpid()) + ".csv"));
  tl::expected<Labels, LogError> read(const std::string& text) {
    std::ofstream(path_, std::ios::binary) << text;
    return read_labels(path_);
  }
  void refused(const std::string& text, const std::string& line, const std::string& what) {
    const auto labels = read(text);
    ASSERT_FALSE(labels) << text;
    EXPECT_TRUE(labels.error().message.starts_with(path_ + ":" + line + ": ")) << labels.error().message;
    EXPECT_NE(labels.error().message.find(what), std::string::npos) << labels.error().message;
  }
  void TearDown() override { std::filesystem::remove(path_); }
};

TEST_F(LabelsTest, ARowSaysOfItsRecordingWhatItsCellsHoldAndNothingWhereTheyAreEmpty) {
  const auto labels = read("\xef\xbb\xbfrecording,ceiling,cut_mm\r\n b ,1,\r\n\r\na,-1,2.5\r\n");
  ASSERT_TRUE(labels) << labels.error().message;
  const Labels expected{{"a", {{"ceiling", -1}, {"cut_mm", 2.5}}}, {"b", {{"ceiling", 1}}}};
  EXPECT_EQ(*labels, expected);
}

TEST_F(LabelsTest, WhatIsNoTableOfLabelsIsRefusedByFileAndLine) {
  refused("name,ceiling\na,1\n", "1", "name recording first");
  refused("recording\na\n", "1", "one label or more");
  refused("recording,ceiling\na,1\n\na,0\n", "4", "'a' has a row already");
  refused("recording,ceiling\na,1\n ,0\n", "3", "without a recording");
  refused("recording,ceiling\na,yes\n", "2", "column 'ceiling' holds 'yes'");
  refused("recording,ceiling\na,1,2\n", "2", "3 cells");
  refused("recording,ceiling,ceiling\na,1,2\n", "1", "named twice");
  EXPECT_EQ(read_labels(path_ + ".absent").error().kind, LogError::Kind::not_found);
}

TEST_F(LabelsTest, ARecordingIsKnownByItsNameWithoutFolderAndEndings) {
  EXPECT_EQ(recording_name("somewhere/e8_log00.csv"), "e8_log00");
  EXPECT_EQ(recording_name("B2_circle.csv.gz"), "B2_circle");
  EXPECT_EQ(recording_name("log_8.v2.ulg"), "log_8.v2");
}

TEST_F(LabelsTest, ALabelIsAColumnOfEveryRowAndTakesThePlaceOfNothingMeasured) {
  FlightLog log;
  log.t_s = {0, 0.01, 0.02};
  log.columns["z_m"] = {1, 2, 3};
  log.columns["ceiling"] = {-1, -1, -1};
  ASSERT_TRUE(add_labels(log, {{"ceiling", 1}, {"cut_mm", 2.5}}, "labels.csv"));
  EXPECT_EQ(log.column("ceiling"), std::vector<double>(3, 1));
  EXPECT_EQ(log.column("cut_mm"), std::vector<double>(3, 2.5));
  for (const char* measured : {"z_m", "t_s"}) {
    const auto added = add_labels(log, {{measured, 1}}, "labels.csv");
    ASSERT_FALSE(added) << measured;
    EXPECT_EQ(added.error().message.substr(0, 13), "labels.csv:1:");
  }
  EXPECT_EQ(log.column("z_m"), (std::vector<double>{1, 2, 3}));
}

}  // namespace
}  // namespace backwash::log
