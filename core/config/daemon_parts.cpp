// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "core/config/daemon_parts.hpp"

namespace backwash::config {
namespace {

constexpr std::string_view kProfile = "odometry.profile", kTwist = "odometry.twist", kChild = "odometry.child",
                           kMessage = "odometry.message";

/// One of the names of an enumeration.
template <typename Enum>
std::optional<Enum> named(std::string_view text, std::span<const Enum> all) {
  const auto found = std::ranges::find(all, text, [](Enum e) { return config::name(e); });
  return found == all.end() ? std::nullopt : std::optional(*found);
}

/// What a custom estimator sends: messages of poses alone have no twist.
tl::expected<void, ConfigError> read_custom(const StrictTable& file, const std::string& twist,
                                            const std::string& message, Daemon::Odometry& odometry) {
  constexpr Twist kTwists[] = {Twist::body, Twist::world, Twist::none};
  const auto type = named<PoseMessage>(message, kPoseMessages);
  if (!type)
    return tl::unexpected(file.error(kMessage, "needs \"odometry\", \"pose\", \"pose_with_covariance\" or \"tf\""));
  odometry.message = *type;
  const bool poses = *type != PoseMessage::odometry;
  if (poses) odometry.twist = Twist::none;
  if (twist.empty()) return {};
  const auto frame = named<Twist>(twist, kTwists);
  if (!frame) return tl::unexpected(file.error(kTwist, "needs \"body\", \"world\" or \"none\""));
  if (poses && *frame != Twist::none)
    return tl::unexpected(file.error(kTwist, "needs \"none\": message = \"" + message + "\" has poses alone"));
  odometry.twist = *frame;
  return {};
}

}  // namespace

tl::expected<void, ConfigError> read_odometry(const StrictTable& file, const OdometryWords& said, Daemon& d) {
  const auto profiles = odometry_profiles();
  const auto profile = std::ranges::find(profiles, said.profile, &OdometryProfile::name);
  if (profile == profiles.end()) {
    std::string all;
    for (const auto& p : profiles) all += (all.empty() ? "\"" : ", \"") + std::string(p.name) + '"';
    return tl::unexpected(file.error(kProfile, "needs one of " + all));
  }
  if (said.profile != "custom") {
    for (const auto key : {kTwist, kChild, kMessage})
      if (file.has(key)) return tl::unexpected(file.error(key, "needs profile = \"custom\""));
    d.odometry.child = profile->child;
  }
  if (!file.has("frames.odometry") && d.frames.map != profile->frame) d.frames.odometry = profile->frame;
  d.odometry.twist = profile->twist;
  if (!file.has("odometry.rate_least")) d.odometry.timing.rate_least = profile->rate_least;
  return read_custom(file, said.twist, said.message, d.odometry);
}

tl::expected<void, ConfigError> read_frames(const StrictTable& file, const std::string& sent, Daemon& d) {
  if (d.frames.map == d.frames.odometry || d.frames.map == d.frames.body || d.frames.odometry == d.frames.body)
    return tl::unexpected(file.error("frames", "needs three different names"));
  // Of odometry a child frame says nothing of what is placed: VINS-Fusion's is its world.
  const std::string& child = d.odometry.child;
  if (d.odometry.message == PoseMessage::tf && (child == d.frames.map || child == d.frames.odometry))
    return tl::unexpected(file.error(kChild, "needs the vehicle's frame, none of the map or of the odometry"));
  if (sent == "none") return {};
  if (sent != "map" && sent != "vehicle")
    return tl::unexpected(file.error("dds.tf", "needs \"none\", \"map\" or \"vehicle\""));
  if (d.odometry.message == PoseMessage::tf)
    return tl::unexpected(file.error("dds.tf", "needs \"none\": with odometry.message = \"tf\" others send them"));
  d.dds.tf = sent == "map" ? Transforms::map : Transforms::vehicle;
  return {};
}

}  // namespace backwash::config
