// SPDX-License-Identifier: BSD-3-Clause
// The field that a flight's page holds: the world's own bounds, and every other one or fewer where there are too many.
#include "core/report/field_box.hpp"

#include <gtest/gtest.h>

#include "core/config/config.hpp"
#include "core/map/load_map.hpp"
#include "core/report/page/page_data.hpp"

namespace backwash::report {
namespace {

class FieldBoxOf : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    const auto vehicle = config::load_vehicle("builtin:quad-5in").value();
    const auto model = config::load_model("builtin:quad-5in").value();
    world_ = plan::build_world(map::load_map("builtin:apartment").value(), model, vehicle);
  }
  static void TearDownTestSuite() { world_.reset(); }

  /// Each kept value is the bound at the voxel of its place; returns how many there are.
  std::size_t held_against_the_world(const FieldBox& box) {
    std::size_t n = 0, some = 0;
    for (int k = 0; k < box.count.z(); ++k)
      for (int j = 0; j < box.count.y(); ++j)
        for (int i = 0; i < box.count.x(); ++i, ++n) {
          const Vec3 p = box.first_W + box.side_m * Index3(i, j, k).cwiseProduct(box.stride).cast<double>();
          const double bound = world_->bounds.at(world_->grid.index(p)).w[kZ];
          EXPECT_EQ(reach::bound_of(box.codes.at(n)), bound) << p.transpose();
          some += bound > 0;
        }
    EXPECT_EQ(n, box.codes.size());
    EXPECT_GT(some, n / 4);
    return n;
  }

  static std::shared_ptr<const plan::World> world_;
  const std::vector<Vec3> path_{{3, 4.2, 1.0}, {6, 2, 1.4}, {7.4, 3, 1.2}};
};
std::shared_ptr<const plan::World> FieldBoxOf::world_;

TEST_F(FieldBoxOf, APathHoldsTheWorldsOwnBoundsAtAllHeights) {
  const auto view = field_view(world_->grid, path_);
  EXPECT_DOUBLE_EQ(view.height_m, 1.2);
  const auto box = field_box(*world_, view);
  EXPECT_EQ(box.stride, Index3::Ones());
  EXPECT_GT(box.count.z(), 10);
  EXPECT_EQ(held_against_the_world(box), static_cast<std::size_t>(box.count.prod()));
  EXPECT_EQ(world_->grid.index(box.first_W).z() + box.level, view.layer);
  EXPECT_EQ(world_->grid.index(box.first_W).head<2>(), view.low.head<2>());
  // Two metres more than the path on each side, or the map's edge.
  EXPECT_LE(box.first_W.x(), 1.1);
  EXPECT_LE(box.first_W.y(), 0.1);
  EXPECT_GE(box.first_W.x() + box.side_m * (box.count.x() - 1), 9.3);
}

TEST_F(FieldBoxOf, ALargeMapKeepsAFewLayersAndTheFlightsOwnAmongThem) {
  const auto view = field_view(world_->grid, path_);
  for (const std::size_t most : {20000u, 6000u, 500u}) {
    const auto box = field_box(*world_, view, most);
    EXPECT_LE(held_against_the_world(box), most);
    EXPECT_GT(box.codes.size(), most / 4) << "wasteful";
    EXPECT_EQ(world_->grid.index(box.first_W).z() + box.level * box.stride.z(), view.layer);
    EXPECT_GT(box.stride.prod(), 1);
  }
}

TEST_F(FieldBoxOf, APathOutsideTheMapIsAtItsEdge) {
  const std::vector<Vec3> outside{{-30, -30, -30}};
  const auto box = field_box(*world_, field_view(world_->grid, outside));
  EXPECT_EQ(box.codes.size(), static_cast<std::size_t>(box.count.prod()));
  EXPECT_EQ(box.count, Index3::Ones());
}

TEST(FieldBoxJson, HoldsItsCodesAsTwoBytesEachTheLowerOneFirst) {
  PageData data;
  data.field = FieldBox{{1, 2, 3}, 0.1, {1, 1, 2}, {2, 1, 1}, 0, {0x0102, 0xffff}};
  const auto json = to_json(data);
  EXPECT_NE(json.find("\"first\":[1,2,3],\"side\":0.1,\"stride\":[1,1,2],\"count\":[2,1,1],\"level\":0"), json.npos)
      << json;
  EXPECT_NE(json.find("\"codes\":\"AgH//w==\""), json.npos) << json;
}

}  // namespace
}  // namespace backwash::report
