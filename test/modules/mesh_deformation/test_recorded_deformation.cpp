#include <catch2/catch.hpp>
#include <cstddef>
#include <iostream>
#include <numbers>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include "modules/core/lie.hpp"
#include "modules/evaluation/mesh/mesh_error.hpp"
#include "modules/mesh_deformation/local_mesh_optimizer.hpp"
#include "modules/mesh_deformation/mesh_corrector.hpp"
#include "modules/semantic_mapping/semantic_mapper.hpp"
#include "test/modules/semantic_mapping/wall_scene.hpp"
#include "test/support/recorded_kitchen.hpp"
#include "test/support/shared_data.hpp"

namespace km {
namespace {

// A robot that maps, with every frame as a keyframe.
struct RecordedRobot {
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

// Odometry with drift: lengths grow by 2 %. The heading drifts by 2 degrees in all, evenly over
// `steps` frames, about a tilted axis.
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

// Distances [m] from `truth` to two meshes, from its points within 20 cm of either of them, which
// are more than half.
std::pair<DistanceSummary, DistanceSummary> distances_to(const LabelledMesh& truth,
                                                         const LabelledMesh& first,
                                                         const LabelledMesh& second) {
  const MeshInput a{"first", first}, b{"second", second};
  const MeshChange change =
      mesh_change(truth, {&a, 1}, {&b, 1}, {.icp = false, .registration = {}, .crop_m = 0.2});
  REQUIRE(change.before.merged.coverage > 0.5);
  REQUIRE(change.after.merged.coverage > 0.5);
  return {change.before.merged.truth.surface, change.after.merged.truth.surface};
}

TEST_CASE("A recorded kitchen mapped with drift is corrected to agree with the first robot's",
          "[mesh_deformation][slow]") {
  const auto folder = shared_data("7scenes_redkitchen");
  if (!folder) return;
  RecordedKitchen kitchen(*folder);
  SemanticMappingConfig mapping;
  mapping.voxel_size_m = 0.05;
  const Camera& camera = kitchen.rig().cameras[0];
  RecordedRobot first{SemanticMapper(mapping, camera)};
  RecordedRobot given{SemanticMapper(mapping, camera)};
  RecordedRobot drifted{SemanticMapper(mapping, camera)};
  const std::size_t half = kitchen.frame_count() / 4;  // half of the frames are used
  Drift drift(half);
  for (std::size_t frame = 0; const auto posed = kitchen.next(); ++frame) {
    kitchen.skip(1);
    if (frame < half) {
      first.integrate(*posed, posed->T_world_cam);
    } else {
      given.integrate(*posed, posed->T_world_cam);
      drifted.integrate(*posed, drift.next(posed->T_world_cam));
    }
  }
  const LabelledMesh reference = first.mesh().mesh;
  const LabelledMesh undrifted = given.mesh().mesh;
  const MapMesh map = drifted.mesh();
  LocalMeshOptimizer optimizer;
  const DeformedMesh corrected = optimizer.optimize(map, drifted.T_odom_kf, drifted.T_world_kf);
  CHECK(corrected.report.status == DeformationStatus::kConverged);
  const auto [before, after] = distances_to(reference, map.mesh, corrected.mesh);
  const double floor_m = distances_to(reference, map.mesh, undrifted).second.median_m;
  std::cout << "kitchen, distance between the robots' meshes, median and mean: " << 1e3 * floor_m
            << " mm with the given poses (median); " << 1e3 * before.median_m << ", "
            << 1e3 * before.mean_m << " with drift; " << 1e3 * after.median_m << ", "
            << 1e3 * after.mean_m << " corrected with " << corrected.report.nodes << " nodes\n";
  CHECK(before.median_m > 1.5 * after.median_m);
  CHECK(before.mean_m > after.mean_m);
  CHECK(after.median_m < 1.5 * floor_m);
}

constexpr int kFramesPerLap = 50;

SemanticMappingConfig window_of_3_m() {
  SemanticMappingConfig config = settings(0.1);
  config.window_m = 3.0;  // a quarter of a lap
  return config;
}

// Circles in a room. Odometry rotates by 2.5 degrees per lap too much: less than a voxel while a
// wall is in view, 20 cm at the walls from one lap to the next. The mesh is corrected after every
// `period` frames.
class Flight {
 public:
  Flight(double duplicate_voxels, int period)
      : corrector_(all_faces(), {.voxels = duplicate_voxels, .copies = 1, .share = 0.0}),
        period_(period) {}

  void lap() {
    for (int i = 0; i < kFramesPerLap; ++i) {
      const auto frame = static_cast<int>(T_world_kf_.size());
      const SE3 T_room_cam = BoxRoom::T_room_cam(frame * 100 / kFramesPerLap);
      const double drift = 2.5 * std::numbers::pi / 180.0 * frame / kFramesPerLap;
      const SE3 T_odom_room =
          make_pose(so3_exp(Eigen::Vector3d(0.0, 0.0, drift)), Eigen::Vector3d::Zero());
      T_world_kf_.push_back(T_room_cam);
      T_odom_kf_.push_back(T_odom_room * T_room_cam);
      REQUIRE(integrate(mapper_, render(small_camera(), T_room_cam, cast_room), T_odom_kf_.back(),
                        static_cast<KeyframeIndex>(frame)));
      mapper_.update_mesh();
      if ((frame + 1) % period_ == 0) correct();
    }
  }

  [[nodiscard]] MapSize size() const { return mapper_.size(); }
  [[nodiscard]] const MeshCorrection& corrected() const { return correction_; }

 private:
  static MeshDeformationConfig all_faces() {
    MeshDeformationConfig config;
    config.duplicate_faces = 0;
    return config;
  }
  void correct() {
    correction_ = corrector_.correct({mapper_.mesh(), ++version_, T_odom_kf_, T_world_kf_}).value();
    (void)mapper_.drop(correction_.superseded);
  }

  SemanticMapper mapper_{window_of_3_m(), small_camera(), BoxRoom::palette()};
  MeshCorrector corrector_;
  int period_;
  MeshCorrection correction_;
  std::uint64_t version_ = 0;
  std::vector<SE3> T_odom_kf_, T_world_kf_;
};

// Cells of a quarter metre of the walls that have a vertex.
std::set<std::tuple<int, int, int>> covered(const LabelledMesh& mesh) {
  std::set<std::tuple<int, int, int>> cells;
  for (const Eigen::Vector3f& p : mesh.vertices) {
    const Eigen::Vector3f cell = (4.0F * p).array().round();
    cells.insert(
        {static_cast<int>(cell.x()), static_cast<int>(cell.y()), static_cast<int>(cell.z())});
  }
  return cells;
}

double mean_error_m(const LabelledMesh& mesh) {
  double sum = 0.0;
  for (const Eigen::Vector3f& p : mesh.vertices) sum += BoxRoom::distance(p.cast<double>());
  return sum / static_cast<double>(mesh.vertices.size());
}

double right_labels(const LabelledMesh& mesh) {
  std::size_t right = 0;
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
    right += mesh.labels[v] == BoxRoom::label_at(mesh.vertices[v].cast<double>()) ? 1 : 0;
  return static_cast<double>(right) / static_cast<double>(mesh.vertices.size());
}

TEST_CASE("In a room circled repeatedly the map hardly grows and no surface is lost",
          "[mesh_deformation][slow]") {
  Flight flight(1.0, 25), hoarding(0.0, kFramesPerLap);
  for (int lap = 0; lap < 2; ++lap) {
    flight.lap();
    hoarding.lap();
  }
  const std::size_t faces = flight.size().faces, nodes = flight.corrected().report.nodes;
  const std::size_t hoarded = hoarding.size().faces;
  for (int lap = 2; lap < 5; ++lap) {
    flight.lap();
    hoarding.lap();
  }
  CAPTURE(faces, nodes, hoarded, flight.size().faces, hoarding.size().faces,
          flight.corrected().report.nodes, hoarding.corrected().report.nodes);
  // The rest are parts that only one lap saw, and rims.
  CHECK(hoarding.size().faces > 2 * hoarded);
  CHECK(flight.size().faces - faces < (hoarding.size().faces - hoarded) / 4);
  CHECK(flight.corrected().report.nodes < hoarding.corrected().report.nodes);
  CHECK(flight.size().dropped_faces > faces);

  const LabelledMesh &clean = flight.corrected().mesh, &all = hoarding.corrected().mesh;
  CHECK(clean.faces.size() < all.faces.size() / 3);
  const auto cells_clean = covered(clean), cells_all = covered(all);
  std::size_t lost = 0;
  for (const auto& cell : cells_all) lost += cells_clean.contains(cell) ? 0 : 1;
  CAPTURE(lost, cells_all.size());
  CHECK(lost <= cells_all.size() / 50);  // cells reached only by a displaced copy
  CAPTURE(mean_error_m(clean), mean_error_m(all), right_labels(clean), right_labels(all));
  CHECK(mean_error_m(clean) < 1.1 * mean_error_m(all) + 0.001);
  CHECK(right_labels(clean) > right_labels(all) - 0.005);
}

}  // namespace
}  // namespace km
