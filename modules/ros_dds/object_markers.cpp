#include "modules/ros_dds/object_markers.hpp"

#include <algorithm>

#include "modules/objects/object_file.hpp"

namespace km {
namespace {

constexpr float kOpacity = 0.4F;
constexpr double kText_m = 0.3;
constexpr double kThinnest_m = 0.01;  // viewers do not draw cubes without volume

Eigen::Vector4f color_of(const LabelPalette& palette, LabelId label) {
  const LabelClass* const known = palette.find(label);
  if (known == nullptr) return {0.5F, 0.5F, 0.5F, kOpacity};
  const auto& [red, green, blue] = known->color;
  return {static_cast<float>(red) / 255.0F, static_cast<float>(green) / 255.0F,
          static_cast<float>(blue) / 255.0F, kOpacity};
}

}  // namespace

RosMarkerArray object_markers(std::span<const MapObject> objects, const LabelPalette& palette,
                              const RosHeader& header) {
  RosMarkerArray message;
  RosMarker& clear = message.markers.emplace_back();
  clear.header = header;
  clear.action = RosMarkerAction::kDeleteAll;
  clear.scale.setOnes();
  clear.color.setOnes();
  for (const MapObject& object : objects) {
    const SE3 T_map_box = object.box.pose();
    RosMarker marker;
    marker.header = header;
    marker.ns = "boxes";
    marker.id = static_cast<std::int32_t>(message.markers.size() / 2);
    marker.type = RosMarkerType::kCube;
    marker.pose = {T_map_box.translation(), Eigen::Quaterniond(T_map_box.linear())};
    marker.scale = object.box.size_m.cwiseMax(kThinnest_m);
    marker.color = color_of(palette, object.label);
    message.markers.push_back(marker);
    marker.ns = "names";
    marker.type = RosMarkerType::kText;
    marker.pose.position.z() += 0.5 * object.box.size_m.z() + kText_m;
    marker.scale = {0.0, 0.0, kText_m};
    marker.color = {1.0F, 1.0F, 1.0F, 1.0F};
    marker.text = class_name(palette, object.label);
    message.markers.push_back(std::move(marker));
  }
  return message;
}

}  // namespace km
