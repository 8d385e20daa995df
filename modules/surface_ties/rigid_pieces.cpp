#include "modules/surface_ties/rigid_pieces.hpp"

#include <algorithm>
#include <optional>
#include <utility>

namespace km {
namespace {

// Largest motion of a side of a box [m].
double motion_m(const Eigen::AlignedBox3d& a, const Eigen::AlignedBox3d& b) {
  return std::max((a.min() - b.min()).cwiseAbs().maxCoeff(),
                  (a.max() - b.max()).cwiseAbs().maxCoeff());
}

}  // namespace

std::set<KeyframeIndex> RigidPieces::add(const MeshChunk& chunk) {
  std::set<KeyframeIndex> changed;
  if (const auto known = parts_.find(chunk.key); known != parts_.end()) {
    changed.insert(known->second.piece());
    samples_ -= known->second.samples.size();
    parts_.erase(known);
  }
  if (!chunk.empty() && chunk.odometry) {
    const MeshChunk* const one = &chunk;
    const SE3 T_world_kf =
        find_pose(chunk.keyframes, chunk.odometry->id.index).value_or(SE3::Identity());
    Part part{{*chunk.odometry, T_world_kf},
              chunk.anchor,
              {},
              sample_plane_patches(assemble_mesh(std::span(&one, 1)), spacing_m_)};
    transform(part.samples, T_world_kf.inverse());
    move(part);
    if (!part.samples.empty() && samples_ + part.samples.size() <= kMaxSamples) {
      samples_ += part.samples.size();
      changed.insert(part.piece());
      parts_.emplace(chunk.key, std::move(part));
    }
  }
  for (const KeyframeIndex number : changed) {
    measure(number);
    places_.erase(number);
  }
  return changed;
}

std::set<KeyframeIndex> RigidPieces::add(const MeshPoses& poses) {
  poses_ = poses;
  for (auto& [key, part] : parts_) {
    const auto [place, is_new] = places_.try_emplace(part.piece());
    if (is_new) place->second = {part.anchor, boxes_.at(part.piece())};
    move(part);
  }
  std::set<KeyframeIndex> changed;
  for (auto& [number, place] : places_) {
    measure(number);
    const Place now{poses_.anchor, boxes_.at(number)};
    if (now.anchor == place.anchor && motion_m(now.box, place.box) <= kMoved_m) continue;
    place = now;
    changed.insert(number);
  }
  return changed;
}

// Places the part with the present pose of its keyframe, if it is known.
void RigidPieces::move(Part& part) const {
  if (const auto T_world_kf = find_pose(poses_.keyframes, part.keyframe.odometry.id.index)) {
    part.keyframe.T_world_kf = *T_world_kf;
    part.anchor = poses_.anchor;
  }
  part.box.setEmpty();
  for (const SurfaceSample& sample : part.samples)
    part.box.extend(part.keyframe.T_world_kf * sample.point);
}

void RigidPieces::measure(KeyframeIndex number) {
  Eigen::AlignedBox3d box;
  for (const auto& [key, part] : parts_)
    if (part.piece() == number) box.extend(part.box);
  if (box.isEmpty())
    boxes_.erase(number);
  else
    boxes_[number] = box;
}

RigidPiece RigidPieces::piece(KeyframeIndex number) const {
  std::vector<const Part*> parts;
  const Part* largest = nullptr;
  for (const auto& [key, part] : parts_) {
    if (part.piece() != number) continue;
    parts.push_back(&part);
    if (largest == nullptr || part.samples.size() > largest->samples.size()) largest = &part;
  }
  RigidPiece piece{largest->keyframe, largest->anchor, {}};
  for (const Part* part : parts) {
    if (part->anchor != largest->anchor) continue;
    std::vector<SurfaceSample> samples = part->samples;
    transform(samples,
              largest->keyframe.odometry.T_odom_kf.inverse() * part->keyframe.odometry.T_odom_kf);
    piece.samples.insert(piece.samples.end(), samples.begin(), samples.end());
  }
  return piece;
}

}  // namespace km
