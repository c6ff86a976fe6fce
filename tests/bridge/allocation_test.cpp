// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cstdlib>
#include <new>

#include "tests/bridge/emulated_controller.hpp"

namespace {
thread_local std::size_t allocations = 0;

void* counted(std::size_t size) {
  ++allocations;
  if (void* p = std::malloc(size)) return p;
  throw std::bad_alloc();
}
}  // namespace

void* operator new(std::size_t size) { return counted(size); }
void* operator new[](std::size_t size) { return counted(size); }
[[gnu::noinline]] void operator delete(void* p) noexcept { std::free(p); }
[[gnu::noinline]] void operator delete[](void* p) noexcept { std::free(p); }
[[gnu::noinline]] void operator delete(void* p, std::size_t) noexcept { std::free(p); }
[[gnu::noinline]] void operator delete[](void* p, std::size_t) noexcept { std::free(p); }

namespace backwash::firmware_bridge::test {
namespace {

TEST(AllocationCounter, CountsAnAllocation) {
  const auto before = allocations;
  ::operator delete(::operator new(1));
  EXPECT_EQ(allocations, before + 1);
}

/// Also with a key, for which frames have to come signed.
class AllocatingLinkTest : public LinkTest, public testing::WithParamInterface<int> {
 protected:
  void say_either(const auto& message) {
    mavlink::EncodedFrame f =
        mavlink::encode_frame({kVehicle, 1, 0}, message, GetParam() != 0 ? mavlink::kIncompatSigned : std::uint8_t{0});
    if (GetParam() != 0) signing_.sign(f);
    far_.write(f.view());
  }
  mavlink::Signing signing_{{1, 2, 3}, 1, 1'000'000};
};

TEST_P(AllocatingLinkTest, AllocatesNothingWhileItReadsAndSends) {
  if (GetParam() != 0) link_.require_signatures(mavlink::Signing({1, 2, 3}, 0, 1'000'000), kStart);
  say_either(px4_heartbeat(false, 1));
  poll_until(1);
  const VioSample vio{1, Vec3::Zero(), Eigen::Quaterniond::Identity(), Vec3::Zero(), Vec3::Zero(), {}, {}, {}, 0};
  std::size_t in_link = 0;
  bool ok = true;
  for (int i = 0; i < 200; ++i) {
    say_either(mavlink::LocalPositionNed{.time_boot_ms = static_cast<std::uint32_t>(i)});
    say_either(mavlink::Attitude{.time_boot_ms = static_cast<std::uint32_t>(i)});
    say_either(mavlink::Statustext{});
    say_either(mavlink::CommandAck{.command = static_cast<std::uint16_t>(i)});
    say_either(mavlink::Timesync{0, 5});
    say_either(px4_heartbeat(true, 6));
    if (i % 10 == 0) far_.write(Bytes{0xFD, 1, 2, 3, 0xFE, 9, 9});
    const auto before = allocations;
    ok = link_.poll(kStart).has_value() && ok;
    ok = link_.send_setpoint({}, kStart) && ok;
    ok = link_.send_odometry(vio) && link_.send_heartbeat() && link_.send_statustext(6, "text") && ok;
    ok = link_.send_arm(true) && link_.send_timesync(kStart) && !link_.fault(kStart) && ok;
    in_link += allocations - before;
    far_.read();
  }
  // A pseudo-terminal hands bytes over in its own time.
  for (int i = 0; i < 1000 && link_.received().frames <= 1000; ++i) {
    ::usleep(1000);
    const auto before = allocations;
    ok = link_.poll(kStart).has_value() && ok;
    in_link += allocations - before;
  }
  EXPECT_TRUE(ok);
  EXPECT_EQ(in_link, 0U);
  EXPECT_GT(link_.received().frames, 1000U);
  EXPECT_GT(link_.transmit().sent(), 1000U);
  EXPECT_EQ(link_.signing() ? link_.signing()->counters().good : 0, GetParam() != 0 ? link_.received().frames : 0);
}

INSTANTIATE_TEST_SUITE_P(UnsignedAndSigned, AllocatingLinkTest, testing::Values(0, 1));

}  // namespace
}  // namespace backwash::firmware_bridge::test
