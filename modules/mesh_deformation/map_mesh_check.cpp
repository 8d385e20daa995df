#include "modules/mesh_deformation/map_mesh_check.hpp"

#include <cmath>
#include <stdexcept>
#include <string>

namespace km {
namespace {

constexpr float kFarthest_m = 1e7F;
constexpr double kRigidTolerance = 1e-6;  // of the entries of R^T R

[[noreturn]] void refuse(const std::string& problem) {
  throw std::invalid_argument("mesh deformation: " + problem);
}

void check_vertices(const MapMesh& map, std::size_t keyframes) {
  const auto& vertices = map.mesh.vertices;
  if (map.seen_by.size() != vertices.size())
    refuse("seen_by has " + std::to_string(map.seen_by.size()) + " entries for " +
           std::to_string(vertices.size()) + " vertices");
  if (!map.certainty.empty() && map.certainty.size() != vertices.size())
    refuse("certainty has " + std::to_string(map.certainty.size()) + " entries for " +
           std::to_string(vertices.size()) + " vertices");
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    if (!(vertices[v].cwiseAbs().maxCoeff() < kFarthest_m) || !vertices[v].allFinite())
      refuse("vertex " + std::to_string(v) + " is not finite or beyond 10,000 km");
    const auto [first, last] = map.seen_by[v];
    if (first > last || last >= keyframes)
      refuse("vertex " + std::to_string(v) + " was seen by keyframes " + std::to_string(first) +
             " to " + std::to_string(last) + ", of " + std::to_string(keyframes));
  }
}

void check_faces(const LabelledMesh& mesh) {
  for (std::size_t f = 0; f < mesh.faces.size(); ++f)
    for (const std::uint32_t corner : mesh.faces[f])
      if (corner >= mesh.vertices.size())
        refuse("face " + std::to_string(f) + " names vertex " + std::to_string(corner) + " of " +
               std::to_string(mesh.vertices.size()));
}

void check_ids(const MapMesh& map) {
  if (map.ids.empty()) return;
  if (map.ids.size() != map.mesh.vertices.size())
    refuse("there are " + std::to_string(map.ids.size()) + " ids for " +
           std::to_string(map.mesh.vertices.size()) + " vertices");
  for (std::size_t v = 1; v < map.ids.size(); ++v)
    if (map.ids[v - 1] >= map.ids[v])
      refuse("ids do not ascend at vertex " + std::to_string(v) + ": " +
             std::to_string(map.ids[v - 1]) + ", " + std::to_string(map.ids[v]));
}

bool is_rigid(const SE3& T) {
  const Eigen::Matrix3d R = T.linear();
  if (!T.matrix().allFinite() || R.determinant() < 0.0) return false;
  return (R.transpose() * R - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < kRigidTolerance;
}

}  // namespace

void check_map_mesh(const MapMesh& map, std::size_t keyframes) {
  check_vertices(map, keyframes);
  check_faces(map.mesh);
  check_ids(map);
}

void check_poses(std::span<const SE3> poses, std::string_view what) {
  for (std::size_t i = 0; i < poses.size(); ++i)
    if (!is_rigid(poses[i]))
      refuse(std::string(what) + " pose of keyframe " + std::to_string(i) +
             " is not finite or not rigid");
}

void check_trajectories(std::span<const SE3> T_odom_kf, std::span<const SE3> T_world_kf) {
  check_poses(T_odom_kf, "odometry");
  check_poses(T_world_kf, "optimised");
  if (T_world_kf.size() > T_odom_kf.size() || (T_world_kf.empty() && !T_odom_kf.empty()))
    refuse(std::to_string(T_world_kf.size()) + " optimised poses for " +
           std::to_string(T_odom_kf.size()) + " keyframes");
}

}  // namespace km
