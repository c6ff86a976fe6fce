// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <iterator>
#include <string_view>

/// Written by idl/type_hashes.py; the test type_hashes says when it has to be again.
namespace backwash::dds {

struct TypeHash {
  std::string_view type, hash;
};

// clang-format off
inline constexpr TypeHash kTypeHashes[] = {
    {"builtin_interfaces::msg::dds_::Time_", "RIHS01_b106235e25a4c5ed35098aa0a61a3ee9c9b18d197f398b0e4206cea9acf9c197"},
    {"builtin_interfaces::msg::dds_::Duration_", "RIHS01_e8d009f659816f758b75334ee1a9ca5b5c0b859843261f14c7f937349599d93b"},
    {"std_msgs::msg::dds_::Header_", "RIHS01_f49fb3ae2cf070f793645ff749683ac6b06203e41c891e17701b1cb597ce6a01"},
    {"std_msgs::msg::dds_::ColorRGBA_", "RIHS01_77a7a5b9ae477306097665106e0413ba74440245b1f3d0c6d6405fe5c7813fe8"},
    {"geometry_msgs::msg::dds_::Point_", "RIHS01_6963084842a9b04494d6b2941d11444708d892da2f4b09843b9c43f42a7f6881"},
    {"geometry_msgs::msg::dds_::Vector3_", "RIHS01_cc12fe83e4c02719f1ce8070bfd14aecd40f75a96696a67a2a1f37f7dbb0765d"},
    {"geometry_msgs::msg::dds_::Quaternion_", "RIHS01_8a765f66778c8ff7c8ab94afcc590a2ed5325a1d9a076ffff38fbce36f458684"},
    {"geometry_msgs::msg::dds_::Pose_", "RIHS01_d501954e9476cea2996984e812054b68026ae0bfae789d9a10b23daf35cc90fa"},
    {"geometry_msgs::msg::dds_::PoseStamped_", "RIHS01_10f3786d7d40fd2b54367835614bff85d4ad3b5dab62bf8bca0cc232d73b4cd8"},
    {"geometry_msgs::msg::dds_::PoseWithCovariance_", "RIHS01_9a7c0fd234b7f45c6098745ecccd773ca1085670e64107135397aee31c02e1bb"},
    {"geometry_msgs::msg::dds_::PoseWithCovarianceStamped_", "RIHS01_26432f9803e43727d3c8f668d1fdb3c630f548af631e2f4e31382371bfea3b6e"},
    {"geometry_msgs::msg::dds_::Transform_", "RIHS01_beb83fbe698636351461f6f35d1abb20010c43d55374d81bd041f1ba2581fddc"},
    {"geometry_msgs::msg::dds_::TransformStamped_", "RIHS01_0a241f87d04668d94099cbb5ba11691d5ad32c2f29682e4eb5653424bd275206"},
    {"geometry_msgs::msg::dds_::Twist_", "RIHS01_9c45bf16fe0983d80e3cfe750d6835843d265a9a6c46bd2e609fcddde6fb8d2a"},
    {"geometry_msgs::msg::dds_::TwistWithCovariance_", "RIHS01_49f574f033f095d8b6cd1beaca5ca7925e296e84af1716d16c89d38b059c8c18"},
    {"tf2_msgs::msg::dds_::TFMessage_", "RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087"},
    {"nav_msgs::msg::dds_::Odometry_", "RIHS01_3cc97dc7fb7502f8714462c526d369e35b603cfc34d946e3f2eda2766dfec6e0"},
    {"nav_msgs::msg::dds_::Path_", "RIHS01_1957a5bb3cee5da65c4e52e52b65a93df227efce4c20f8458b36e73066ca334b"},
    {"sensor_msgs::msg::dds_::PointField_", "RIHS01_5c6a4750728c2bcfbbf7037225b20b02d4429634732146b742dee1726637ef01"},
    {"sensor_msgs::msg::dds_::PointCloud2_", "RIHS01_9198cabf7da3796ae6fe19c4cb3bdd3525492988c70522628af5daa124bae2b5"},
    {"sensor_msgs::msg::dds_::BatteryState_", "RIHS01_4bee5dfce981c98faa6828b868307a0a73f992ed0789f374ee96c8f840e69741"},
    {"sensor_msgs::msg::dds_::CompressedImage_", "RIHS01_15640771531571185e2efc8a100baf923961a4d15d5569652e6cb6691e8e371a"},
    {"octomap_msgs::msg::dds_::Octomap_", "RIHS01_9891a19a05b70ec20aa8f45db3f8300b9ab80afff32c61c549d25087da9625b0"},
    {"visualization_msgs::msg::dds_::UVCoordinate_", "RIHS01_f27f7ed21fe360c6066944f856b801a0c0d1e94e815b6886444b42d90b196a26"},
    {"visualization_msgs::msg::dds_::MeshFile_", "RIHS01_7710ece15a148fb7c9b546364cfb215bb06098087bd6394fe5b73a493508f8c4"},
    {"visualization_msgs::msg::dds_::Marker_", "RIHS01_45b13ccf791f225962bf74e746f9644518855d783a6f42ba0cc14fde2b4f3ce0"},
    {"visualization_msgs::msg::dds_::MarkerArray_", "RIHS01_86cb8800b6fb05b5eff1abd7a56f62a5641d3ae9a1c29e78e67e704f1d067dcf"},
    {"diagnostic_msgs::msg::dds_::KeyValue_", "RIHS01_d68081eaa540288c5440753baecef0c4e16e81a5f78ad68902ded5100413bb42"},
    {"diagnostic_msgs::msg::dds_::DiagnosticStatus_", "RIHS01_b0e3e692ea2d54a8af2f4ef1930e81556a2db55216b771f8a7d2724ed47bf0e4"},
    {"diagnostic_msgs::msg::dds_::DiagnosticArray_", "RIHS01_5a8a36efb05fb25070fa0fb3810290c0e6cd4862b54a8fb975a1ee8dc55a333e"},
    {"backwash_msgs::msg::dds_::Command_", "RIHS01_9cb4a34c5d3ba0112f62be6fe4adbc70269969d5fca7ec0be3684b7cf3bc7f28"},
    {"backwash_msgs::msg::dds_::Ack_", "RIHS01_953155f2fc84599a77fcb7daa338737e9446064765e7b4fd05c37886227686ff"},
    {"backwash_msgs::msg::dds_::Timing_", "RIHS01_2145ee542663a02c6d70bc306afe089bceb7d5cf68cb6823bbb04492929701b1"},
    {"backwash_msgs::msg::dds_::Parameter_", "RIHS01_4ba17b7cf55cf1a35b445d08fd2a8abc23c15955f4395e7be5df7c1eeb3107af"},
    {"backwash_msgs::msg::dds_::Advice_", "RIHS01_17c2f1c681685b8a1ac5ddca49bb02442a51bd1c887fe5debfe06ab08eb441c2"},
    {"backwash_msgs::msg::dds_::Status_", "RIHS01_ebf190b7637ef3c619046ce4f2323be8fc5168f866711e4e1d4859250022cd8a"},
    {"backwash_msgs::msg::dds_::ReachStep_", "RIHS01_eb1cf8bae007f124aced5c5d7111a2856f049f00ff8db1583041a39701ef0aa2"},
    {"backwash_msgs::msg::dds_::ReachTube_", "RIHS01_205e5a736e8e66742da3743c25961c8bcef8edc4bc08b1c7f503e3f980520ebd"},
    {"backwash_msgs::msg::dds_::MapPart_", "RIHS01_f721a090fccf137d5acd86d8d436fb0eeb0aaab7c3f33afd575a5e0e4dcbfb68"},
    {"backwash_msgs::msg::dds_::MapReceipt_", "RIHS01_c155532ee7aeadde8c7ed792ea535d6c6296d9d5519cf0f7f2650eaa9bc2137f"},
};
// clang-format on

/// What ROS 2's tools compare types by, of a type by its name on the wire; empty: of one that is not of idl/.
constexpr std::string_view type_hash(std::string_view type) {
  const auto* const found = std::ranges::find(kTypeHashes, type, &TypeHash::type);
  return found == std::end(kTypeHashes) ? std::string_view() : found->hash;
}

}  // namespace backwash::dds
