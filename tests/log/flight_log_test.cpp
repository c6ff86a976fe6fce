// SPDX-License-Identifier: BSD-3-Clause
#include "core/log/columns/flight_log.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <bit>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <random>

#include "core/log/columns/log_columns.hpp"

namespace backwash::log {
namespace {

using Kind = LogError::Kind;

class FlightLogFile : public ::testing::Test {
 protected:
  FlightLogFile() : folder_(std::filesystem::temp_directory_path() / ("backwash_log_" + std::to_string(::getpid()))) {
    std::filesystem::create_directories(folder_);
  }
  ~FlightLogFile() override { std::filesystem::remove_all(folder_); }
  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  std::string with(const std::string& text) const {
    std::ofstream(path("in.csv"), std::ios::binary) << text;
    return path("in.csv");
  }
  std::filesystem::path folder_;
};

double any_finite_double(std::mt19937_64& random) {
  while (true) {
    const double value = std::bit_cast<double>(random());
    if (std::isfinite(value)) return value;
  }
}

TEST_F(FlightLogFile, RoundTripIsBitForBit) {
  std::mt19937_64 random(7);
  FlightLog log;
  for (int row = 0; row < 500; ++row) {
    log.t_s.push_back(0.02 * row);
    for (const char* name : {"x_m", "cmd_az_mps2", "thrust"}) log.columns[name].push_back(any_finite_double(random));
  }
  log.columns["thrust"][0] = -0.0;
  log.columns["thrust"][1] = 5e-324;
  ASSERT_TRUE(write_csv(path("out.csv"), log, false));
  const auto back = read_csv(path("out.csv"));
  ASSERT_TRUE(back) << back.error().message;
  ASSERT_EQ(back->columns.size(), 3u);
  for (std::size_t row = 0; row < 500; ++row) {
    EXPECT_EQ(std::bit_cast<std::uint64_t>(back->t_s[row]), std::bit_cast<std::uint64_t>(log.t_s[row]));
    for (const auto& [name, column] : log.columns) {
      EXPECT_EQ(std::bit_cast<std::uint64_t>(back->column(name)[row]), std::bit_cast<std::uint64_t>(column[row]));
    }
  }
}

TEST_F(FlightLogFile, ColumnsMayComeInAnyOrderWithSpacesAndCrLf) {
  const auto log = read_csv(with("x_m, t_s ,segment\r\n1.5,0.02,-1\r\n\r\n-2e-3, 0.04 ,+3\r\n"));
  ASSERT_TRUE(log) << log.error().message;
  EXPECT_EQ(log->t_s, (std::vector<double>{0.02, 0.04}));
  EXPECT_EQ(log->column("x_m"), (std::vector<double>{1.5, -2e-3}));
  EXPECT_EQ(log->column("segment"), (std::vector<double>{-1, 3}));
  EXPECT_FALSE(log->has("y_m"));
  EXPECT_FALSE(log->has("t_s"));
}

TEST_F(FlightLogFile, EveryFaultIsNamedWithFileAndLine) {
  struct Fault {
    const char *text, *line, *words;
  };
  for (const Fault& f : {Fault{"", ":1:", "empty"}, Fault{"x_m,y_m\n1,2\n", ":1:", "no column 't_s'"},
                         Fault{"t_s,x_m,x_m\n0,1,2\n", ":1:", "'x_m' is named twice"},
                         Fault{"t_s,,x_m\n0,1,2\n", ":1:", "column 2 has no name"},
                         Fault{"t_s,x_m\n0,1\n0.02\n", ":3:", "1 cells where the first line names 2"},
                         Fault{"t_s,x_m\n0,1\n0.02,2,3\n", ":3:", "3 cells where the first line names 2"},
                         Fault{"t_s,x_m\n0,1\n\n0.02,nan\n", ":4:", "column 'x_m' holds 'nan'"},
                         Fault{"t_s,x_m\n0,inf\n", ":2:", "column 'x_m' holds 'inf'"},
                         Fault{"t_s,x_m\n0,1e999\n", ":2:", "finite number"},
                         Fault{"t_s,x_m\n0,1.5m\n", ":2:", "column 'x_m' holds '1.5m'"},
                         Fault{"t_s,x_m\n0,\n", ":2:", "column 'x_m' holds ''"}}) {
    const auto log = read_csv(with(f.text));
    ASSERT_FALSE(log) << f.text;
    EXPECT_EQ(log.error().kind, Kind::bad_data);
    EXPECT_TRUE(log.error().message.starts_with(path("in.csv") + f.line)) << log.error().message;
    EXPECT_NE(log.error().message.find(f.words), std::string::npos) << log.error().message;
  }
}

TEST_F(FlightLogFile, MissingFileIsItsOwnKindOfError) {
  for (const auto& missing : {path("absent.csv"), folder_.string()}) {
    const auto log = read_csv(missing);
    ASSERT_FALSE(log);
    EXPECT_EQ(log.error().kind, Kind::not_found);
    EXPECT_NE(log.error().message.find(missing), std::string::npos);
  }
}

TEST_F(FlightLogFile, AnotherTimeColumnOrNoneCanBeAskedFor) {
  const auto named = read_csv(with("time,x_m\n3,1\n"), "time");
  ASSERT_TRUE(named);
  EXPECT_EQ(named->t_s, std::vector<double>{3});
  const auto none = read_csv(with("x_m,y_m,z_m\n1,2,3\n"), "");
  ASSERT_TRUE(none);
  EXPECT_TRUE(none->t_s.empty());
  EXPECT_EQ(none->column("z_m"), std::vector<double>{3});
}

TEST_F(FlightLogFile, NothingIsOverwrittenWithoutBeingTold) {
  FlightLog log;
  log.t_s = {1};
  const auto existing = with("keep\n");
  const auto refused = write_csv(existing, log, false);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, Kind::cannot_create);
  std::string kept;
  std::getline(std::ifstream(existing) >> std::ws, kept);
  EXPECT_EQ(kept, "keep");
  EXPECT_TRUE(write_csv(existing, log, true));
  EXPECT_TRUE(read_csv(existing));
  const auto nowhere = write_csv(path("no/such/folder.csv"), log, false);
  ASSERT_FALSE(nowhere);
  EXPECT_EQ(nowhere.error().kind, Kind::cannot_create);
}

/// A gap costs its row, many of them their column, and one in a column that no log holds nothing.
TEST_F(FlightLogFile, GapsCostTheirRowsOrTheirColumn) {
  auto log = read_csv(with("t_s,x_m,thrust,rpm1,mine\n0,1,,,\n0.1,2,0.5,nan,1\n0.2,NaN,0.5,3,1\n0.3,4,0.5,,1\n"), "t_s",
                      {}, true);
  ASSERT_TRUE(log) << log.error().message;
  const auto told = leave_out_gaps(*log);
  ASSERT_EQ(told.size(), 2u);
  EXPECT_EQ(told[0], "half of the rows and more are gaps; left out: rpm1");
  EXPECT_EQ(told[1], "2 of 4 rows left out: gaps in x_m, thrust");
  EXPECT_EQ(log->t_s, (std::vector<double>{0.1, 0.3}));
  EXPECT_EQ(log->column("x_m"), (std::vector<double>{2, 4}));
  EXPECT_FALSE(log->has("rpm1"));
  EXPECT_TRUE(leave_out_gaps(*log).empty());
}

}  // namespace
}  // namespace backwash::log
