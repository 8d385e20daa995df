#include "modules/distance_field/node/distance_field_node.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "runtime/thread.hpp"

namespace km {
namespace {

// Updates of a minute at least. Beyond it the mapper waits.
constexpr std::size_t kQueue = 256;

LabelledMesh::Color color_of(double distance_m, double max_m) {
  if (distance_m <= 0.0) return {0, 0, 255};
  const double share = 2.0 * std::min(distance_m / max_m, 1.0);
  const auto byte = [](double value) {
    return static_cast<std::uint8_t>(std::lround(255.0 * std::clamp(value, 0.0, 1.0)));
  };
  return {byte(2.0 - share), byte(share), 0};
}

}  // namespace

DistanceFieldNode::DistanceFieldNode(const DistanceFieldConfig& config, double voxel_size_m,
                                     const DistanceFieldTopics& topics)
    : field_(config, voxel_size_m),
      slices_(topics.slices),
      worker_(
          kQueue, Overflow::kBlock,
          [this](const auto& update) {
            work_in_background();
            step(*update);
          },
          DistanceFieldConfig::kSection) {
  topics.space.subscribe([this](const auto& update) { worker_.post(update); });
}

void DistanceFieldNode::stop() noexcept {
  worker_.stop();
  if (!std::exchange(stopped_, true) && newest_ && !error()) publish_slice();
}

void DistanceFieldNode::step(const SpaceUpdate& update) {
  (void)field_.set(update.changes);
  newest_ = update.stamp;
  camera_z_m_ = update.camera_z_m;
  if (!published_ || seconds_between(*published_, update.stamp) >= kSlice_s) publish_slice();
}

void DistanceFieldNode::publish_slice() {
  published_ = newest_;
  DistanceSlice slice{*newest_, {}};
  for (const DistanceField::SlicePoint& point : field_.slice(camera_z_m_)) {
    slice.points.vertices.push_back(point.point);
    slice.points.colors.push_back(
        color_of(static_cast<double>(point.distance_m), field_.max_distance_m()));
  }
  slices_.publish(std::move(slice));
}

}  // namespace km
