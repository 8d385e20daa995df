#include "modules/distance_field/node/distance_field_node.hpp"

#include <algorithm>
#include <utility>

#include "modules/core/distance_color.hpp"

namespace km {
namespace {

// Updates of a minute at least. Beyond it the mapper waits.
constexpr std::size_t kQueue = 256;

}  // namespace

DistanceFieldNode::DistanceFieldNode(const DistanceFieldTopics& topics)
    : WorkerNode({.name = "distance_field", .queue = kQueue, .in_background = true}),
      slices_(topics.slices) {
  follow(topics.space);
}

void DistanceFieldNode::step(const SpaceUpdate& update) {
  if (update.is_first)
    field_.emplace(std::min(kMaxDistance_m, kMaxDistance_voxels * update.voxel_m), update.voxel_m);
  field_->set(update.changes);
  newest_ = update.stamp;
  camera_z_m_ = update.camera_z_m;
  if (!published_ || seconds_between(*published_, update.stamp) >= kSlice_s) publish_slice();
}

void DistanceFieldNode::publish_slice() {
  published_ = newest_;
  DistanceSlice slice{*newest_, {}};
  for (const DistanceField::SlicePoint& point : field_->slice(camera_z_m_)) {
    slice.points.vertices.push_back(point.point);
    slice.points.colors.push_back(
        distance_color(static_cast<double>(point.distance_m) / field_->max_distance_m()));
  }
  slices_.publish(std::move(slice));
}

}  // namespace km
