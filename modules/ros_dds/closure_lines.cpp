#include "modules/ros_dds/closure_lines.hpp"

#include <array>

namespace km {
namespace {

constexpr double kLine_m = 0.02;

struct Kind {
  const char* name;
  std::array<float, 3> color;
};
// By ClosureStatus.
constexpr std::array<Kind, 4> kKinds = {{{"candidates", {0.6F, 0.6F, 0.6F}},
                                         {"verified", {1.0F, 0.8F, 0.1F}},
                                         {"rejected", {0.9F, 0.2F, 0.15F}},
                                         {"kept", {0.15F, 0.75F, 0.3F}}}};

std::optional<SE3> pose_of(const KeyframeId& keyframe, const Trajectory& trajectory) {
  if (keyframe.robot != trajectory.robot || keyframe.index >= trajectory.T_world_kf.size())
    return std::nullopt;
  return trajectory.T_world_kf[keyframe.index];
}

}  // namespace

RosMarkerArray closure_lines(std::span<const PublishedClosure> closures,
                             const Trajectory& trajectory, const RosHeader& header) {
  RosMarkerArray message;
  for (const Kind& kind : kKinds) {
    RosMarker& marker = message.markers.emplace_back();
    marker.header = header;
    marker.ns = kind.name;
    marker.type = RosMarkerType::kLineList;
    marker.scale = {kLine_m, 0.0, 0.0};
    marker.color = {kind.color[0], kind.color[1], kind.color[2], 1.0F};
  }
  for (const PublishedClosure& closure : closures) {
    auto from = pose_of(closure.id.from, trajectory);
    auto to = pose_of(closure.id.to, trajectory);
    if (from && !to && closure.T_from_to) to = *from * *closure.T_from_to;
    if (to && !from && closure.T_from_to) from = *to * closure.T_from_to->inverse();
    if (!from || !to) continue;
    auto& points = message.markers[static_cast<std::size_t>(closure.status)].points;
    points.push_back(from->translation());
    points.push_back(to->translation());
  }
  return message;
}

}  // namespace km
