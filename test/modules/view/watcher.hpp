#pragma once

#include <cstddef>
#include <map>
#include <variant>
#include <vector>

#include "modules/mesh/team_mesh.hpp"
#include "modules/view/view_update.hpp"

namespace km {

/// State of a robot as a viewer knows it, from the beginning or from the time when it appeared.
struct Watcher {
  void receive(const ViewContent& content) {
    std::visit([this](const auto& c) { take(c); }, content);
  }
  void take(const ViewPose& pose) { poses.push_back(pose); }
  void take(const ViewKeyframes& keyframes) {
    auto& known = keyframes.optimized ? optimized : odometry;
    for (std::size_t k = 0; k < keyframes.T_world_kf.size(); ++k) {
      if (!keyframes.optimized) ++odometry_received;
      known[keyframes.first + static_cast<KeyframeIndex>(k)] = {keyframes.anchor,
                                                                keyframes.T_world_kf[k]};
    }
  }
  void take(const ViewClosures& update) {
    for (const ViewClosure& closure : update.closures) {
      closures[closure.id] = closure;
      order.push_back(closure.id);
    }
  }
  void take(const RobotSample& state) { states.push_back(state); }
  void take(const MeshChunk& chunk) { (void)mesh.add(chunk); }
  void take(const ViewImage& image) { images.push_back(image); }
  void take(const ViewObjects& update) { objects = update; }
  void take(const ViewRaster& update) { raster = update; }

  struct Placed {
    RobotId anchor = 0;
    SE3 T = SE3::Identity();
  };
  std::vector<ViewPose> poses;
  std::map<KeyframeIndex, Placed> odometry, optimized;
  std::map<ClosureId, ViewClosure> closures;
  std::vector<ClosureId> order;
  std::size_t odometry_received = 0;
  std::vector<RobotSample> states;
  std::vector<ViewImage> images;
  TeamMesh mesh;
  ViewObjects objects;
  std::optional<ViewRaster> raster;
};

}  // namespace km
