// SPDX-License-Identifier: BSD-3-Clause
#include "core/log/columns/foreign_table.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>

#include <unistd.h>

namespace backwash::log {
namespace {

tl::expected<ForeignTable, LogError> read(const std::string& text) {
  const std::string path =
      std::filesystem::temp_directory_path() / ("backwash_foreign." + std::to_string(getpid()) + ".txt");
  std::ofstream(path) << text;
  auto table = read_foreign_table(path);
  std::filesystem::remove(path);
  return table;
}

TEST(ForeignTable, CellsAreBetweenTabsSemicolonsCommasOrBlanks) {
  for (const std::string text :
       {"t\tx\ty\n0.5\t1\t2\n1,5\t3\t4\n2.5\t5\t6\n", "t;x;y\r\n0,5;1;2\r\n1,5;3;4\r\n2,5;5;6\r\n",
        "\xef\xbb\xbft,x,y\n0.5,1,2\n1.5,3,4\n2.5,5,6\n", "# t x y\n0.5  1 2\n 1.5 3  4\n2.5 5 6\n",
        "\"t\",\"x\",\"y\"\n\"0.5\",1,2\n1.5,3,4\n2.5,5,6\n"}) {
    const auto table = read(text);
    ASSERT_TRUE(table) << table.error().message;
    EXPECT_EQ(table->names(), "t, x, y") << text;
    EXPECT_EQ(table->find("t")->values, (std::vector{0.5, 1.5, 2.5})) << text;
    EXPECT_EQ(table->find("y")->values, (std::vector<double>{2, 4, 6})) << text;
  }
}

TEST(ForeignTable, NamesTakeWhatStandsAboveThemAndUnitsLeaveThem) {
  const auto motion = read(
      "Format Version,1.23,Capture Frame Rate,100\n\n,,Rigid Body,Rigid Body,Marker\n,,cf,cf,m1\n,,Rotation,Position,"
      "Position\nFrame,Time (Seconds),X,X,X\n0,0.00,1,2,3\n1,0.01,1,2,3\n2,0.02,1,2,3\n");
  ASSERT_TRUE(motion) << motion.error().message;
  EXPECT_EQ(motion->columns[2].name, "cf Rotation X");
  EXPECT_NE(motion->columns[3].name, motion->columns[4].name);
  EXPECT_EQ(motion->find("Time")->unit, "s");
  const auto counted =
      read("Objects\n200\n,,drone,,\nFrame,Sub Frame,TX,TY,TZ\n,,mm,mm,mm\n1,0,5,6,7\n2,0,5,6,7\n3,0,5,6,7\n");
  ASSERT_TRUE(counted) << counted.error().message;
  EXPECT_EQ(counted->find("TX")->unit, "mm");
  ASSERT_TRUE(counted->find(kFrameTime));
  EXPECT_DOUBLE_EQ(counted->find(kFrameTime)->values[1], 0.01);
  const auto units = read("#stamp, v_R_x [m s^-1], q_w []\n1,2,3\n2,3,4\n3,4,5\n");
  ASSERT_TRUE(units) << units.error().message;
  EXPECT_EQ(units->find("v_R_x")->unit, "m/s");
  EXPECT_TRUE(units->find("q_w"));
}

TEST(ForeignTable, GapsTextsAndColumnsWithoutANameAreTold) {
  const auto table = read(",t,x,mode\n0,0.1,,hover\n1,0.2,nan,hover\n2,0.3,4,land\n");
  ASSERT_TRUE(table) << table.error().message;
  EXPECT_EQ(table->columns[0].name, "column 1");
  EXPECT_TRUE(std::isnan(table->find("x")->values[1]));
  EXPECT_EQ(table->find("mode")->text_line, 2U);
  const auto bare = read("1 2 3\n2 2 3\n3 2 3\n");
  ASSERT_TRUE(bare);
  EXPECT_FALSE(bare->named);
  const auto torn = read("t,x\n1,2\n2,3\n3,4\n4\n");
  ASSERT_FALSE(torn);
  EXPECT_NE(torn.error().message.find(":5: 1 cells in a table of 2 columns"), std::string::npos)
      << torn.error().message;
  EXPECT_FALSE(read("no numbers\nhere\n"));
}

}  // namespace
}  // namespace backwash::log
