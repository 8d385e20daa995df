#include <algorithm>
#include <catch2/catch.hpp>
#include <cstddef>
#include <iostream>
#include <numbers>
#include <vector>

#include "modules/core/lie.hpp"
#include "modules/mesh_deformation/local_mesh_optimizer.hpp"
#include "modules/semantic_mapping/semantic_mapper.hpp"
#include "test/modules/semantic_mapping/surface_distance.hpp"
#include "test/support/recorded_kitchen.hpp"
#include "test/support/shared_data.hpp"

namespace km {
namespace {

constexpr double kOverlap_m = 0.2;

// A robot that maps: every frame is a keyframe.
struct Robot {
  SemanticMapper mapper;
  std::vector<SE3> T_odom_kf = {};
  std::vector<SE3> T_world_kf = {};

  void integrate(const PosedFrame& posed, const SE3& T_odom_cam) {
    const auto keyframe = static_cast<KeyframeIndex>(T_odom_kf.size());
    REQUIRE(mapper.integrate(*posed.frame->depth, nullptr, T_odom_cam, keyframe).status ==
            IntegrationStatus::kIntegrated);
    T_odom_kf.push_back(T_odom_cam);
    T_world_kf.push_back(posed.T_world_cam);
  }
  [[nodiscard]] MapMesh mesh() {
    mapper.update_mesh();
    return mapper.mesh();
  }
};

// Odometry that goes wrong along the way: lengths grow by 2 %, and the heading turns by 2 degrees
// in all, evenly over `steps` frames, about an axis that tilts it too.
class Drift {
 public:
  explicit Drift(std::size_t steps)
      : turn_(so3_exp(2.0 * std::numbers::pi / 180.0 / static_cast<double>(steps) *
                      Eigen::Vector3d(1, 2, 1).normalized())) {}

  SE3 next(const SE3& T_world_cam) {
    if (first_) {
      T_odom_cam_ = T_world_cam;
      first_ = false;
    } else {
      SE3 step = before_.inverse() * T_world_cam;
      step.translation() *= 1.02;
      step.linear() *= turn_;
      T_odom_cam_ = T_odom_cam_ * step;
    }
    before_ = T_world_cam;
    return T_odom_cam_;
  }

 private:
  Eigen::Matrix3d turn_;
  bool first_ = true;
  SE3 before_ = SE3::Identity();
  SE3 T_odom_cam_ = SE3::Identity();
};

// Median distance [m] of the vertices of `a` from the faces of `b`, of those within 20 cm.
double median_distance_m(const LabelledMesh& a, const LabelledMesh& b) {
  const SurfaceDistance to_b(b, kOverlap_m);
  std::vector<double> distances;
  for (const Eigen::Vector3f& p : a.vertices)
    if (const double d = to_b(p.cast<double>()); d < kOverlap_m) distances.push_back(d);
  REQUIRE(distances.size() > a.vertices.size() / 2);
  const auto middle = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2);
  std::nth_element(distances.begin(), middle, distances.end());
  return *middle;
}

TEST_CASE("A recorded kitchen mapped with drift is corrected to agree with the first robot's",
          "[mesh_deformation][slow]") {
  const auto folder = shared_data("7scenes_redkitchen");
  if (!folder) return;
  RecordedKitchen kitchen(*folder);
  SemanticMappingConfig mapping;
  mapping.voxel_size_m = 0.05;
  const PinholeCamera& camera = kitchen.rig().cameras[0];
  Robot first{SemanticMapper(mapping, camera)};
  Robot given{SemanticMapper(mapping, camera)};
  Robot drifted{SemanticMapper(mapping, camera)};
  const std::size_t half = kitchen.frame_count() / 2;  // frames 0 to 496, and 500 to 996
  Drift drift(half);
  for (std::size_t frame = 0; const auto posed = kitchen.next(); ++frame) {
    if (frame < half) {
      first.integrate(*posed, posed->T_world_cam);
    } else {
      given.integrate(*posed, posed->T_world_cam);
      drifted.integrate(*posed, drift.next(posed->T_world_cam));
    }
  }
  const LabelledMesh reference = first.mesh().mesh;
  const double floor_m = median_distance_m(reference, given.mesh().mesh);
  const MapMesh map = drifted.mesh();
  const double before_m = median_distance_m(reference, map.mesh);

  LocalMeshOptimizer optimizer;
  const DeformedMesh corrected = optimizer.optimize(map, drifted.T_odom_kf, drifted.T_world_kf);
  const double after_m = median_distance_m(reference, corrected.mesh);
  std::cout << "kitchen, median distance between the robots' meshes: " << 1e3 * floor_m
            << " mm with the given poses, " << 1e3 * before_m << " with drift, " << 1e3 * after_m
            << " corrected with " << corrected.report.nodes << " nodes\n";
  CHECK(corrected.report.status == DeformationStatus::kConverged);
  CHECK(before_m > 1.5 * floor_m);  // else there was nothing to correct
  CHECK(after_m < 1.5 * floor_m);
}

}  // namespace
}  // namespace km
