#include "modules/surface_ties/rigid_pieces.hpp"

#include <utility>

namespace km {

std::set<KeyframeIndex> RigidPieces::add(const MeshChunk& chunk) {
  std::set<KeyframeIndex> changed;
  if (const auto known = parts_.find(chunk.key); known != parts_.end()) {
    changed.insert(known->second.piece());
    samples_ -= known->second.samples.size();
    parts_.erase(known);
  }
  if (!chunk.empty() && chunk.keyframe) {
    const MeshChunk* const one = &chunk;
    Part part{*chunk.keyframe,
              chunk.anchor,
              {},
              sample_plane_patches(assemble_mesh(std::span(&one, 1)), spacing_m_)};
    for (const SurfaceSample& sample : part.samples) part.box.extend(sample.point);
    transform(part.samples, chunk.keyframe->T_world_kf.inverse());
    if (!part.samples.empty() && samples_ + part.samples.size() <= kMaxSamples) {
      samples_ += part.samples.size();
      changed.insert(part.piece());
      parts_.emplace(chunk.key, std::move(part));
    }
  }
  for (const KeyframeIndex number : changed) measure(number);
  return changed;
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
