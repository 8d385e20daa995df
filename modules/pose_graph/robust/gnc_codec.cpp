#include "modules/pose_graph/robust/gnc_codec.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "runtime/dds/wire_pose.hpp"
#include "runtime/dds/wire_sequence.hpp"

namespace km {

Codec<GncPoses>::Encoded Codec<GncPoses>::encode(const GncPoses& poses) {
  Encoded encoded;
  for (const SE3& T : poses.T_world_pose) encoded.T_world_pose.push_back(to_wire(T));
  encoded.wire.robot = poses.robot;
  encoded.wire.update = poses.update;
  borrow(encoded.wire.T_world_pose, encoded.T_world_pose);
  return encoded;
}

Decoded<GncPoses> Codec<GncPoses>::decode(const Wire& wire) {
  using Result = Decoded<GncPoses>;
  if (wire.robot != wire.header.robot) return Result::refuse("written by another robot");
  const auto T_world_pose = elements_of(wire.T_world_pose, kMaxGncEntries);
  if (!T_world_pose) return Result::refuse("poses are missing or too many");
  GncPoses poses{.robot = wire.robot, .update = wire.update};
  for (const km_wire_Pose& pose : *T_world_pose) {
    const std::optional<SE3> T = from_wire(pose);
    if (!T) return Result::refuse("a pose is not a rigid transform");
    poses.T_world_pose.push_back(*T);
  }
  return Result::accept(std::move(poses));
}

Codec<GncResiduals>::Encoded Codec<GncResiduals>::encode(const GncResiduals& residuals) {
  Encoded encoded;
  encoded.residuals = residuals.residuals;
  encoded.wire.robot = residuals.robot;
  encoded.wire.update = residuals.update;
  encoded.wire.between = residuals.between;
  encoded.wire.inside = residuals.inside;
  borrow(encoded.wire.residuals, encoded.residuals);
  return encoded;
}

Decoded<GncResiduals> Codec<GncResiduals>::decode(const Wire& wire) {
  using Result = Decoded<GncResiduals>;
  if (wire.robot != wire.header.robot) return Result::refuse("written by another robot");
  const auto told = elements_of(wire.residuals, kMaxGncEntries);
  if (!told) return Result::refuse("residuals are missing or too many");
  if (std::size_t{wire.between} + wire.inside > told->size())
    return Result::refuse("fewer residuals than closures");
  if (!std::all_of(told->begin(), told->end(),
                   [](float r) { return std::isfinite(r) && r >= 0.0F; }))
    return Result::refuse("a residual is negative or not a number");
  return Result::accept(
      {wire.robot, wire.update, wire.between, wire.inside, {told->begin(), told->end()}});
}

}  // namespace km
