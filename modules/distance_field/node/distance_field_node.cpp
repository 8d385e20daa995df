#include "modules/distance_field/node/distance_field_node.hpp"

#include <algorithm>
#include <utility>

#include "modules/core/distance_color.hpp"
#include "runtime/thread.hpp"

namespace km {
namespace {

// Updates of a minute at least. Beyond it the mapper waits.
constexpr std::size_t kQueue = 256;

}  // namespace

DistanceFieldNode::DistanceFieldNode(double voxel_size_m, const DistanceFieldTopics& topics)
    : voxel_size_m_(voxel_size_m),
      slices_(topics.slices),
      worker_(
          kQueue, Overflow::kBlock,
          [this](const auto& update) {
            work_in_background();
            step(*update);
          },
          "distance_field") {
  topics.space.subscribe([this](const auto& update) { worker_.post(update); });
}

void DistanceFieldNode::stop() noexcept {
  worker_.stop();
  if (!std::exchange(stopped_, true) && newest_ && !error()) publish_slice();
}

void DistanceFieldNode::step(const SpaceUpdate& update) {
  if (update.is_first)
    field_.emplace(std::min(kMaxDistance_m, DistanceField::kMaxReach * voxel_size_m_),
                   voxel_size_m_);
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
