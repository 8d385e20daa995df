#include "modules/objects/object_merging.hpp"

#include <algorithm>
#include <utility>

namespace km {
namespace {

// Part of the smaller box that two boxes of one object share. Both are first enlarged by half of
// ObjectsConfig::gap_m.
constexpr double kMergeOverlap = 0.3;

std::vector<RobotId> united(const std::vector<RobotId>& a, const std::vector<RobotId>& b) {
  std::vector<RobotId> all;
  std::ranges::set_union(a, b, std::back_inserter(all));
  return all;
}

// `main` has at least as much surface as `part`.
void absorb(MapObject& main, const MapObject& part) {
  std::vector<Eigen::Vector3d> corners;
  for (const ObjectBox& box : {main.box, part.box})
    for (const Eigen::Vector3d& corner : corners_of(box)) corners.push_back(corner);
  main.box = enclosing_box(corners);
  main.views += part.views;
  main.robots = united(main.robots, part.robots);
}

bool are_same(const MapObject& a, const MapObject& b, const ObjectsConfig& config) {
  if (a.layer != b.layer || a.label != b.label) return false;
  const ObjectBox box_a = a.box.grown(0.5 * config.gap_m), box_b = b.box.grown(0.5 * config.gap_m);
  const double reach = 0.5 * (box_a.size_m.norm() + box_b.size_m.norm());
  if ((a.box.center - b.box.center).norm() > reach) return false;
  const double smaller = std::min(box_a.volume_m3(), box_b.volume_m3());
  return smaller > 0.0 && shared_volume_m3(box_a, box_b) >= kMergeOverlap * smaller;
}

}  // namespace

std::vector<MapObject> merge_objects(std::vector<MapObject> objects, const ObjectsConfig& config) {
  std::ranges::stable_sort(
      objects, [](const MapObject& a, const MapObject& b) { return a.surface_m2 > b.surface_m2; });
  std::vector<MapObject> merged;
  for (MapObject& object : objects) {
    // A box that grows may reach a former object.
    for (auto same = merged.begin(); same != merged.end();) {
      if (!are_same(*same, object, config)) {
        ++same;
        continue;
      }
      MapObject main = std::move(*same);
      merged.erase(same);
      if (main.surface_m2 < object.surface_m2) std::swap(main, object);
      absorb(main, object);
      object = std::move(main);
      same = merged.begin();
    }
    merged.push_back(std::move(object));
  }
  return merged;
}

}  // namespace km
