#include "modules/pose_graph/own_frame.hpp"

#include "modules/pose_graph/vertical_prior.hpp"

namespace km {

void OwnFrame::enter(const TeamFrame& frame) {
  if (frame_ == frame) return;
  frame_ = frame;
  ++version_;
  world_.reset();
}

std::optional<World> OwnFrame::world_of(RobotId anchor, const TeamRoster& roster,
                                        const SE3& T_odom_first, bool upright) const {
  const auto poses = roster.public_poses().find(anchor);
  if (poses == roster.public_poses().end() || poses->second.frame != frame_) return std::nullopt;
  const TeamRoster::Peer* peer = roster.find(anchor);
  const bool own = anchor == self_.robot;
  if (!own && (peer == nullptr || !peer->status)) return std::nullopt;
  const SE3& T_odom_kf = own ? T_odom_first : peer->status->T_odom_first;
  const SE3 T_frame_world = poses->second.T_frame_kf.front().pose() * T_odom_kf.inverse();
  if (!upright) return World{anchor, T_frame_world};
  const Eigen::MatrixXd turned =
      level(T_frame_world.matrix().topRows<3>(), T_odom_kf.translation());
  return World{anchor, make_pose(turned.leftCols<3>(), turned.col(3))};
}

}  // namespace km
