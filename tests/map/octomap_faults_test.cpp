// SPDX-License-Identifier: BSD-3-Clause
// A damaged tree is refused for what is wrong with it, not by luck further on.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <limits>

#include "core/map/octomap/octomap_message.hpp"

namespace backwash::map {
namespace {

using ::testing::HasSubstr;
using Bytes = std::vector<std::int8_t>;

std::string fault(const Bytes& data, bool binary) {
  const auto grid = decode_octomap(data, 0.1, binary, "OcTree", std::size_t{1} << 20);
  return grid ? std::string("taken") : grid.error().message;
}

/// A node of a full tree: log-odds and children.
Bytes full_node(float log_odds, std::uint8_t children) {
  const auto bits = std::bit_cast<std::uint32_t>(log_odds);
  Bytes bytes;
  for (int shift = 0; shift < 32; shift += 8) bytes.push_back(static_cast<std::int8_t>(bits >> shift & 0xff));
  bytes.push_back(static_cast<std::int8_t>(children));
  return bytes;
}

TEST(OctomapFaults, ANodeWithoutANumber) {
  Bytes tree;
  for (int level = 0; level < 16; ++level)
    for (const auto b : full_node(0, 1)) tree.push_back(b);
  Bytes good = tree, bad = tree;
  for (const auto b : full_node(0.5F, 0)) good.push_back(b);
  for (const auto b : full_node(std::numeric_limits<float>::quiet_NaN(), 0)) bad.push_back(b);
  EXPECT_EQ(fault(good, false), "taken");
  EXPECT_THAT(fault(bad, false), HasSubstr("not a number"));
}

TEST(OctomapFaults, DataThatEndInTheMiddle) {
  EXPECT_THAT(fault({0x01}, true), HasSubstr("end in the middle"));
  EXPECT_THAT(fault({0x03, 0x00}, true), HasSubstr("end in the middle"));
  EXPECT_THAT(fault(full_node(0, 1), false), HasSubstr("end in the middle"));
}

TEST(OctomapFaults, AnInnerNodeWithoutChildren) {
  EXPECT_THAT(fault({0x00, 0x00}, true), HasSubstr("no children"));
  EXPECT_THAT(fault({0x03, 0x00, 0x00, 0x00}, true), HasSubstr("no children"));
}

}  // namespace
}  // namespace backwash::map
