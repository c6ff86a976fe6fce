// SPDX-License-Identifier: BSD-3-Clause
// ArduCopter 4.5 to 4.7, which renamed and rescaled many parameters. Names and units: tests/bridge/parameters, from its
// sources.
#include "firmware_bridge/autopilots/profile.hpp"

namespace backwash::firmware_bridge {
namespace {

using enum Ask;
using enum Need;

constexpr double kCentimetres = 100, kCentidegrees = 100, kMilliseconds = 1000;

constexpr std::string_view kIndoors = "to 0: only the VIO says indoors where the vehicle is and how it is turned";
constexpr std::string_view kOtherSource =
    "to 6 (external navigation) or 0: a switch of the remote control changes the estimator over to this source";
constexpr std::string_view kBattery = "to 0 (none) or 1 (land): 2 to 4 and 6 may climb and return, 5 drops the vehicle";

constexpr ParameterRule kRules[] = {
    {{{"GUID_TIMEOUT"}}, required, time_out, 0.3},
    {{{"PSC_VELXY_P"}, {"PSC_NE_VEL_P"}}, required, k_d_horizontal},
    {{{"PSC_POSXY_P"}, {"PSC_NE_POS_P"}}, required, k_p_horizontal},
    {{{"PSC_VELZ_P"}, {"PSC_D_VEL_P"}}, required, k_d_vertical},
    {{{"PSC_POSZ_P"}, {"PSC_D_POS_P"}}, required, k_p_vertical},
    {{{"WPNAV_SPEED", kCentimetres}, {"WP_SPD"}}, required, v_max},
    {{{"WPNAV_SPEED_UP", kCentimetres}, {"WP_SPD_UP"}}, required, v_max},
    {{{"WPNAV_SPEED_DN", kCentimetres}, {"WP_SPD_DN"}}, required, v_max},
    {{{"WPNAV_ACCEL", kCentimetres}, {"WP_ACC"}}, required, a_max},
    {{{"WPNAV_ACCEL_Z", kCentimetres}, {"WP_ACC_Z"}}, required, a_max},
    {{{"ANGLE_MAX", kCentidegrees}, {"ATC_ANGLE_MAX"}}, required, lean},
    {{{"PSC_ANGLE_MAX"}}, required, lean_or_zero},
    {{{"VISO_DELAY_MS", kMilliseconds}}, required, delay},
    {{{"VISO_QUAL_MIN"}}, if_it_has, at_most, kLeastQuality, "to 50 or less: ODOMETRY of a lower quality is not used"},
    {{{"VISO_TYPE"}},
     told,
     one_of,
     any_of({1, 2, 3}),
     "to 1 (MAVLink) and restart it: without it ODOMETRY is not read"},
    {{{"EK3_SRC1_POSXY"}}, told, one_of, any_of({6}), "to 6 (external navigation): the estimator must follow the VIO"},
    {{{"EK3_SRC1_VELXY"}},
     told,
     one_of,
     any_of({0, 6}),
     "to 6 (external navigation): no other velocity fits the VIO's position"},
    {{{"EK3_SRC1_POSZ"}},
     told,
     one_of,
     any_of({6}),
     "to 6 (external navigation): rotor wash spoils the barometer indoors"},
    {{{"EK3_SRC1_VELZ"}},
     told,
     one_of,
     any_of({0, 6}),
     "to 6 (external navigation): no other velocity fits the VIO's height"},
    {{{"EK3_SRC1_YAW"}},
     told,
     one_of,
     any_of({6}),
     "to 6 (external navigation): a compass indoors turns the two frames apart"},
    {{{"EK3_SRC2_POSXY"}}, told, one_of, any_of({0, 6}), kOtherSource},
    {{{"EK3_SRC3_POSXY"}}, told, one_of, any_of({0, 6}), kOtherSource},
    {{{"COMPASS_USE"}}, if_it_has, one_of, any_of({0}), kIndoors},
    {{{"GPS_TYPE"}, {"GPS1_TYPE"}}, if_it_has, one_of, any_of({0}), kIndoors},
    {{{"FS_EKF_ACTION"}}, told, one_of, any_of({1, 3}), "to 1 or 3 (land): without a position nothing else is left"},
    {{{"FS_THR_ENABLE"}},
     told,
     one_of,
     any_of({0, 3}),
     "to 3 (land), or to 0 without a remote control: the others may climb and return"},
    {{{"FS_GCS_ENABLE"}}, told, one_of, any_of({0, 5}), "to 0 (none) or 5 (land): the others may climb and return"},
    {{{"RTL_ALT"}, {"RTL_ALT_M"}},
     told,
     one_of,
     any_of({0}),
     "to 0 (the height at the time): otherwise the pilot's RTL first climbs to it, ceiling or not"},
    {{{"BATT_FS_LOW_ACT"}}, told, one_of, any_of({0, 1, 7}), kBattery},
    {{{"BATT_FS_CRT_ACT"}}, told, one_of, any_of({0, 1, 7}), kBattery},
    {{{"PSC_VELXY_I"}, {"PSC_NE_VEL_I"}}, file, k_i_horizontal},
};
static_assert(std::size(kRules) <= kMostParameters);

}  // namespace

constinit const AutopilotProfile kArduPilot{.name = "ardupilot",
                                            .number = 3,
                                            .rules = kRules,
                                            .follows = true,
                                            .follow = 4,  // guided
                                            .lifts_itself = true,
                                            .needs_origin = true,
                                            .estimator = {193, 1}};

}  // namespace backwash::firmware_bridge
