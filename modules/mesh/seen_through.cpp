#include "modules/mesh/seen_through.hpp"

#include <algorithm>
#include <limits>
#include <unordered_map>

#include "modules/mesh/grid_cell.hpp"

namespace km {
namespace {

constexpr double kGroup_patches = 8.0;  // side of the cell of a group

// True if no part of a sphere is in the view, before its farthest depth.
bool is_outside(const CoarseView& view, const Eigen::Vector3f& center_cam, float radius_m) {
  const float z = center_cam.z();
  if (z + radius_m <= 0.0F || z - radius_m >= view.farthest_m) return true;
  const Eigen::Array2f size(static_cast<float>(view.columns), static_cast<float>(view.rows));
  const Eigen::Array2f low = -view.center.array() / view.focal.array();
  const Eigen::Array2f high = (size - view.center.array()) / view.focal.array();
  const Eigen::Array2f at = center_cam.head<2>().array();
  return (at < low * z - radius_m * (1.0F + low.square()).sqrt()).any() ||
         (at > high * z + radius_m * (1.0F + high.square()).sqrt()).any();
}

// Variances of translation and rotation: the largest along any axis is at most their sum.
Eigen::Array2d variances(const Matrix6& Sigma) {
  return {Sigma.bottomRightCorner<3, 3>().trace(), Sigma.topLeftCorner<3, 3>().trace()};
}

}  // namespace

SightVotes::SightVotes(const std::vector<SightPoint>& points, double patch_m)
    : patch_m_(static_cast<float>(patch_m)), order_(points.size()), votes_(points.size()) {
  std::unordered_map<GridCell, std::uint32_t, GridCellHash> group_of_cell;
  std::vector<std::uint32_t> group_of_point;
  group_of_point.reserve(points.size());
  for (const SightPoint& point : points) {
    const GridCell cell = grid_cell(point.position.cast<double>(), kGroup_patches * patch_m);
    const auto next = static_cast<std::uint32_t>(groups_.size());
    const auto [group, is_new] = group_of_cell.try_emplace(cell, next);
    if (is_new) groups_.emplace_back();
    group_of_point.push_back(group->second);
    ++groups_[group->second].end;
  }
  std::size_t begin = 0;
  for (Group& group : groups_) {
    const std::size_t count = group.end;
    group.begin = group.end = begin;
    begin += count;
  }
  points_.resize(points.size());
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    const std::size_t place = groups_[group_of_point[i]].end++;
    order_[place] = i;
    points_[place] = points[i];
  }
  make_groups();
}

void SightVotes::make_groups() {
  for (Group& group : groups_) {
    Eigen::Vector3f low = points_[group.begin].position, high = low;
    group.first_seen = points_[group.begin].last_seen;
    for (std::size_t i = group.begin; i < group.end; ++i) {
      low = low.cwiseMin(points_[i].position);
      high = high.cwiseMax(points_[i].position);
      group.first_seen = std::min(group.first_seen, points_[i].last_seen);
    }
    group.center = 0.5F * (low + high);
    group.radius_m = 0.5F * (high - low).norm();
  }
}

void SightVotes::add(const CoarseView& view, const SE3& T_world_cam, std::int64_t time,
                     std::span<const PoseSigma> sigmas) {
  const Eigen::Isometry3f T_cam_world = T_world_cam.inverse().cast<float>();
  for (const Group& group : groups_) {
    if (group.first_seen >= time) continue;
    if (is_outside(view, T_cam_world * group.center, group.radius_m)) continue;
    for (std::size_t i = group.begin; i < group.end; ++i) {
      const SightPoint& point = points_[i];
      if (point.last_seen < time && point.pose < sigmas.size())
        vote(view, i, sight_of(view, T_cam_world * point.position, patch_m_, sigmas[point.pose]));
    }
  }
}

void SightVotes::vote(const CoarseView& view, std::size_t place, Sight sight) {
  Vote& vote = votes_[place];
  if (sight == Sight::kSurface && vote.count > 0) --vote.count;
  if (sight != Sight::kThrough || (vote.count > 0 && vote.last_keyframe == view.keyframe)) return;
  vote.last_keyframe = view.keyframe;
  if (vote.count < std::numeric_limits<std::uint16_t>::max()) ++vote.count;
}

std::vector<bool> SightVotes::seen_through(int views) const {
  std::vector<bool> result(votes_.size(), false);
  for (std::size_t i = 0; i < votes_.size(); ++i) result[order_[i]] = votes_[i].count >= views;
  return result;
}

std::vector<PoseSigma> relative_sigmas(std::span<const Matrix6> covariances, std::size_t of) {
  std::vector<PoseSigma> sigmas(covariances.size());
  const Eigen::Array2d own = variances(covariances[of]);
  const auto visit = [&](std::size_t k, Eigen::Array2d& shared) {
    const Eigen::Array2d other = variances(covariances[k]);
    shared = shared.min(other);
    const Eigen::Array2d sigma = (own + other - 2.0 * shared).max(0.0).sqrt();
    sigmas[k] = {static_cast<float>(sigma[0]), static_cast<float>(sigma[1])};
  };
  Eigen::Array2d shared = own;
  for (std::size_t k = of + 1; k-- > 0;) visit(k, shared);
  shared = own;
  for (std::size_t k = of + 1; k < covariances.size(); ++k) visit(k, shared);
  return sigmas;
}

std::vector<std::uint32_t> remove_seen_through(LabelledMesh& mesh,
                                               const std::vector<bool>& seen_through) {
  std::vector<std::uint8_t> has_face(mesh.vertices.size(), 0);
  std::erase_if(mesh.faces, [&](const LabelledMesh::Face& face) {
    if (seen_through[face[0]] + seen_through[face[1]] + seen_through[face[2]] >= 2) return true;
    for (const std::uint32_t v : face) has_face[v] = 1;
    return false;
  });
  std::vector<std::uint32_t> kept;
  for (std::uint32_t v = 0; v < has_face.size(); ++v)
    if (has_face[v] != 0) kept.push_back(v);
  mesh.keep_vertices(kept);
  return kept;
}

}  // namespace km
