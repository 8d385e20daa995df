#include "modules/surface_ties/surface_pieces.hpp"

#include <utility>

namespace km {

std::set<KeyframeIndex> SurfacePieces::add(const MeshChunk& chunk) {
  std::set<KeyframeIndex> changed;
  if (const auto known = parts_.find(chunk.key); known != parts_.end()) {
    changed.insert(known->second.keyframe.odometry.id.index / kLength);
    samples_ -= known->second.samples.size();
    parts_.erase(known);
  }
  if (chunk.empty() || !chunk.keyframe) return changed;
  const MeshChunk* const one = &chunk;
  std::vector<SurfaceSample> samples =
      sample_plane_patches(assemble_mesh(std::span(&one, 1)), spacing_m_);
  if (samples_ + samples.size() > kMaxSamples) return changed;
  transform(samples, chunk.keyframe->T_world_kf.inverse());
  samples_ += samples.size();
  changed.insert(chunk.keyframe->odometry.id.index / kLength);
  parts_.emplace(chunk.key, Part{*chunk.keyframe, chunk.anchor, std::move(samples)});
  return changed;
}

std::vector<KeyframeIndex> SurfacePieces::numbers() const {
  std::set<KeyframeIndex> numbers;
  for (const auto& [key, part] : parts_) numbers.insert(part.keyframe.odometry.id.index / kLength);
  return {numbers.begin(), numbers.end()};
}

SurfacePiece SurfacePieces::piece(KeyframeIndex number) const {
  std::vector<const Part*> parts;
  const Part* largest = nullptr;
  for (const auto& [key, part] : parts_) {
    if (part.keyframe.odometry.id.index / kLength != number) continue;
    parts.push_back(&part);
    if (largest == nullptr || part.samples.size() > largest->samples.size()) largest = &part;
  }
  SurfacePiece piece{largest->keyframe, largest->anchor, {}};
  for (const Part* part : parts) {
    if (part->anchor != largest->anchor) continue;
    std::vector<SurfaceSample> samples = part->samples;
    transform(samples, largest->keyframe.odometry.T_odom_kf.inverse() *
                           part->keyframe.odometry.T_odom_kf);
    piece.samples.insert(piece.samples.end(), samples.begin(), samples.end());
  }
  return piece;
}

}  // namespace km
