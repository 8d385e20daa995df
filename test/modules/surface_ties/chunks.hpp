#pragma once

#include <vector>

#include "modules/core/lie.hpp"
#include "modules/mesh/mesh_chunks.hpp"
#include "test/modules/surface_ties/rooms.hpp"

namespace km {

/// True pose of keyframe `index` of a robot in the room.
inline SE3 pose_in_room(RobotId robot, KeyframeIndex index) {
  return make_pose(so3_exp({0, 0, 0.3 * robot}), {1.0 + 0.05 * index, 1.0 + 0.3 * robot, 1.0});
}

/// Chunks of a room that `robot` has mapped near keyframe `index`. `T_error` is the error of its
/// estimated pose in `world`; odometry begins elsewhere.
inline std::vector<MeshChunk> room_chunks(RobotId robot, KeyframeIndex index, const SE3& T_error) {
  LabelledMesh mesh = inside_of_room();
  mesh.transform(T_error);
  std::vector<MeshChunk> chunks = split_mesh(mesh, robot, 0, {.cell_m = 1.0}).chunks;
  const SE3 T_world_odom = make_pose(so3_exp({0, 0, 1.0}), {5, 6, 7});
  for (MeshChunk& chunk : chunks) {
    chunk.keyframes = {{index, RoundedPose::of(T_error * pose_in_room(robot, index))}};
    chunk.views.assign(chunk.offsets.size(), {0, 0});
    chunk.certainty.assign(chunk.offsets.size(), 0);
    chunk.odometry = {
        {robot, index}, T_world_odom.inverse() * pose_in_room(robot, index), Matrix6::Identity()};
  }
  return chunks;
}

/// Present pose of keyframe `index` of a robot, with this error.
inline MeshPoses room_poses(RobotId robot, KeyframeIndex index, const SE3& T_error) {
  return {.robot = robot,
          .keyframes = {{index, RoundedPose::of(T_error * pose_in_room(robot, index))}}};
}

}  // namespace km
