// SPDX-License-Identifier: BSD-3-Clause
// PX4 1.15 to 1.17, multicopter. Names and units: tests/bridge/parameters, from its sources.
#include "firmware_bridge/autopilots/profile.hpp"

namespace backwash::firmware_bridge {
namespace {

using enum Ask;
using enum Need;

constexpr double kMilliseconds = 1000;

constexpr ParameterRule kRules[] = {
    // Looked at ten times a second, and acted upon by the commander's next loop of 10 ms.
    {{{"COM_OF_LOSS_T"}}, required, time_out, 0.5, "", 0.11},
    {{{"COM_OBL_RC_ACT"}},
     required,
     one_of,
     any_of({4, 5}),
     "to 4 (land) or 5 (hold): 0 to 2 drift, 3 climbs and returns, 6 and 7 drop the vehicle"},
    {{{"MPC_XY_VEL_P_ACC"}}, required, k_d_horizontal},
    {{{"MPC_XY_P"}}, required, k_p_horizontal},
    {{{"MPC_Z_VEL_P_ACC"}}, required, k_d_vertical},
    {{{"MPC_Z_P"}}, required, k_p_vertical},
    {{{"MPC_XY_VEL_MAX"}}, required, v_max},
    {{{"MPC_Z_VEL_MAX_UP"}}, required, v_max},
    {{{"MPC_Z_VEL_MAX_DN"}}, required, v_max},
    {{{"MPC_TILTMAX_AIR"}}, required, lean},
    {{{"EKF2_EV_DELAY", kMilliseconds}}, required, delay},
    {{{"EKF2_EV_QMIN"}}, if_it_has, at_most, kLeastQuality, "to 50 or less: ODOMETRY of a lower quality is not fused"},
    {{{"EKF2_EV_CTRL"}},
     told,
     bits,
     1 + 2 + 8,
     "to 15: the estimator must take position, height and heading from the VIO"},
    {{{"EKF2_HGT_REF"}}, told, one_of, any_of({3}), "to 3 (vision): rotor wash spoils the barometer indoors"},
    {{{"EKF2_DELAY_MAX", kMilliseconds}},
     if_it_has,
     at_least,
     kLatestVio,
     "to 80 ms or more: what is older than that is not fused at its time"},
    {{{"EKF2_GPS_CTRL"}}, if_it_has, one_of, any_of({0}), "to 0: a GPS that finds a fix indoors turns the frame away"},
    {{{"EKF2_MAG_TYPE"}}, if_it_has, one_of, any_of({5}), "to 5 (none): indoors a compass turns the two frames apart"},
    {{{"COM_OBS_AVOID"}}, if_it_has, one_of, any_of({0}), "to 0: it waits for another computer's set-points"},
    {{{"COM_RC_OVERRIDE"}}, told, bits, 2, "to 3: without its 2 the pilot's sticks do not take over in offboard"},
    {{{"NAV_DLL_ACT"}},
     told,
     one_of,
     any_of({0, 1, 3}),
     "to 0 (none), 1 (hold) or 3 (land): 2 climbs and returns, 5 and 6 drop the vehicle"},
    {{{"NAV_RCL_ACT"}},
     told,
     one_of,
     any_of({0, 1, 3}),
     "to 1 (hold) or 3 (land): 2 climbs and returns, 5 and 6 drop the vehicle"},
    {{{"COM_LOW_BAT_ACT"}}, told, one_of, any_of({0, 2}), "to 2 (land): 1 and 3 climb and return"},
    {{{"MPC_XY_VEL_I_ACC"}}, file, k_i_horizontal},
    {{{"MPC_Z_VEL_I_ACC"}}, file, k_i_vertical},
};
static_assert(std::size(kRules) <= kMostParameters);

}  // namespace

constinit const AutopilotProfile kPx4{.name = "px4",
                                      .number = 12,
                                      .rules = kRules,
                                      .follows = true,
                                      .follow = 6,  // offboard, a main mode
                                      .follow_shift = 16,
                                      .follow_mask = 0xFF,
                                      .integers_bytewise = true,
                                      .estimator = {230, 1}};

}  // namespace backwash::firmware_bridge
