#include "modules/mesh/chunk_placement.hpp"

#include <cstddef>
#include <cstdint>
#include <optional>

namespace km {
namespace {

// Position [m] of a vertex as it was sent.
Eigen::Vector3d sent_position(const MeshChunk& chunk, std::size_t vertex) {
  Eigen::Vector3d position;
  for (std::size_t axis = 0; axis < 3; ++axis)
    position[static_cast<Eigen::Index>(axis)] =
        static_cast<double>(chunk.step_m) *
        static_cast<double>(std::int64_t{chunk.origin[axis]} + chunk.offsets[vertex][axis]);
  return position;
}

// Motion of each keyframe of the chunk since it was sent; nothing unless all poses are known.
std::optional<std::vector<SE3>> motions_of(const MeshChunk& chunk, const MeshPoses* poses) {
  if (poses == nullptr || chunk.keyframes.empty()) return std::nullopt;
  std::vector<SE3> motions;
  for (const MeshKeyframe& keyframe : chunk.keyframes) {
    const std::optional<SE3> now = find_pose(poses->keyframes, keyframe.index);
    if (!now) return std::nullopt;
    motions.push_back(*now * keyframe.T_world_kf.pose().inverse());
  }
  return motions;
}

// `D_k v` of place().
Eigen::Vector3d moved(const Eigen::Vector3d& v, MeshChunk::View view,
                      const std::vector<SE3>& motions) {
  const std::size_t before = view / kViewsPerKeyframe;
  const Eigen::Vector3d near = motions[before] * v;
  const double share = static_cast<double>(view % kViewsPerKeyframe) / kViewsPerKeyframe;
  if (share == 0.0) return near;
  return near + share * (motions[before + 1] * v - near);
}

constexpr double kPoseRounding_m = 0.002;

}  // namespace

PlacedChunk place(const MeshChunk& chunk, const MeshPoses* poses) {
  PlacedChunk placed{&chunk, chunk.anchor, {}};
  const auto motions = motions_of(chunk, poses);
  if (motions) placed.anchor = poses->anchor;
  placed.vertices.reserve(chunk.offsets.size());
  for (std::size_t v = 0; v < chunk.offsets.size(); ++v) {
    Eigen::Vector3d position = sent_position(chunk, v);
    if (motions)
      position = 0.5 * (moved(position, chunk.views[v][0], *motions) +
                        moved(position, chunk.views[v][1], *motions));
    placed.vertices.push_back(position.cast<float>());
  }
  return placed;
}

bool differ(const MeshChunk& a, const MeshChunk& b, double min_move_m, const MeshPoses* poses) {
  if (a.step_m != b.step_m || a.labels != b.labels || a.faces != b.faces ||
      a.offsets.size() != b.offsets.size())
    return true;
  const PlacedChunk sent = place(a, poses), present = place(b, poses);
  if (sent.anchor != present.anchor) return true;
  const bool is_moved = poses != nullptr && !a.keyframes.empty();
  const double limit_m = min_move_m + (is_moved ? kPoseRounding_m : 0.0);
  for (std::size_t v = 0; v < sent.vertices.size(); ++v)
    if ((sent.vertices[v] - present.vertices[v]).cast<double>().cwiseAbs().maxCoeff() > limit_m)
      return true;
  return false;
}

}  // namespace km
