#include "modules/surface_ties/rigid_pieces.hpp"

#include <algorithm>
#include <optional>
#include <span>
#include <utility>

#include "modules/surface_ties/chunk_visits.hpp"

namespace km {
namespace {

// Largest motion of a side of a box [m].
double motion_m(const Eigen::AlignedBox3d& a, const Eigen::AlignedBox3d& b) {
  return std::max((a.min() - b.min()).cwiseAbs().maxCoeff(),
                  (a.max() - b.max()).cwiseAbs().maxCoeff());
}

// True if the keyframe is in the middle of the views of a vertex.
bool is_seen_by(const MeshChunk& chunk, KeyframeIndex keyframe) {
  return std::ranges::any_of(chunk.views, [&](const auto& views) {
    const std::size_t middle = (std::size_t{views[0]} + views[1]) / 2 / kViewsPerKeyframe;
    return chunk.keyframes[middle].index == keyframe;
  });
}

}  // namespace

std::set<KeyframeIndex> RigidPieces::add(const MeshChunk& chunk) {
  std::set<KeyframeIndex> changed;
  const auto [begin, end] = parts_.equal_range(chunk.key);
  for (auto known = begin; known != end; ++known) {
    changed.insert(known->second.piece());
    samples_ -= known->second.samples.size();
  }
  parts_.erase(begin, end);
  if (!chunk.empty() && !chunk.keyframes.empty())
    for (const MeshChunk& visit : split_visits(chunk, max_gap_keyframes_)) {
      std::optional<Part> part = part_of(visit);
      if (!part || part->samples.empty() || samples_ + part->samples.size() > kMaxSamples) continue;
      samples_ += part->samples.size();
      changed.insert(part->piece());
      parts_.emplace(chunk.key, *std::move(part));
    }
  for (const KeyframeIndex number : changed) {
    measure(number);
    places_.erase(number);
  }
  return changed;
}

// Absent if odometry of the surface is unknown.
std::optional<RigidPieces::Part> RigidPieces::part_of(const MeshChunk& visit) const {
  std::optional<OdometryPose> odometry;
  const auto known = odometry_.find(middle_keyframe(visit).index);
  if (known != odometry_.end())
    odometry = known->second;
  else if (visit.odometry && is_seen_by(visit, visit.odometry->id.index))
    odometry = visit.odometry;
  if (!odometry) return std::nullopt;
  const MeshChunk* const one = &visit;
  Part part{{*odometry, find_pose(visit.keyframes, odometry->id.index).value_or(SE3::Identity())},
            visit.anchor,
            {},
            sample_plane_patches(assemble_mesh(std::span(&one, 1)), spacing_m_)};
  const SeenBy views = seen_by(visit);
  for (SurfaceSample& sample : part.samples) sample.seen_by = views;
  transform(part.samples, part.keyframe.T_world_kf.inverse());
  move(part);
  return part;
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
