#include <Eigen/Geometry>
#include <algorithm>
#include <catch2/catch.hpp>
#include <chrono>
#include <cstdio>
#include <ctime>
#include <opencv2/core/utility.hpp>
#include <vector>

#include "modules/evaluation/statistics.hpp"
#include "modules/semantic_mapping/semantic_mapper.hpp"
#include "test/modules/semantic_mapping/wall_scene.hpp"

// Speed and accuracy of the mapper in the box room: 40 frames of 640 x 480, as in the measurements
// of other programs. Times of one thread are CPU time of the process, those of two are wall time.

namespace km {
namespace {

constexpr int kFrames = 40;

// Position of the room in the voxel grid. If walls pass through the sample points of voxels, the
// signs there are noise: there are more vertices, and all of them are close to these points. The
// grids of other programs are halfway between. A robot's grid is rotated.
enum class Placement { kAligned, kHalfway, kTurned };

const char* name_of(Placement placement) {
  return placement == Placement::kAligned   ? "aligned"
         : placement == Placement::kHalfway ? "halfway"
                                            : "turned";
}

SE3 T_odom_room(Placement placement, double voxel_m) {
  if (placement == Placement::kAligned) return SE3::Identity();
  if (placement == Placement::kHalfway)
    return make_pose(Eigen::Matrix3d::Identity(), Eigen::Vector3d::Constant(0.5 * voxel_m));
  const Eigen::Vector3d axis = Eigen::Vector3d(0.2, -0.1, 1.0).normalized();
  return make_pose(Eigen::AngleAxisd(0.6, axis).toRotationMatrix(), {0.31, -0.17, 0.23});
}

struct Case {
  double voxel_m = 0.05;
  bool labels = true;
  bool carving = true;
  int threads = 1;
  Placement placement = Placement::kHalfway;
};

double now_ms(int threads) {
  if (threads == 1) return 1e3 * static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
  const auto now = std::chrono::steady_clock::now().time_since_epoch();
  return std::chrono::duration<double, std::milli>(now).count();
}

const std::vector<DepthAndLabels>& frames() {
  static const std::vector<DepthAndLabels> rendered = [] {
    std::vector<DepthAndLabels> images;
    for (int i = 0; i < kFrames; ++i)
      images.push_back(render(BoxRoom::camera(), BoxRoom::T_room_cam(i), cast_room));
    return images;
  }();
  return rendered;
}

void run(const Case& setup) {
  cv::setNumThreads(setup.threads);
  SemanticMappingConfig config;
  config.voxel_size_m = setup.voxel_m;
  config.carving = setup.carving;
  SemanticMapper mapper(config, BoxRoom::camera(), BoxRoom::palette());
  const SE3 T_odom_room = km::T_odom_room(setup.placement, setup.voxel_m);
  std::vector<double> integrate, mesh;
  for (int i = 0; i < kFrames; ++i) {
    const DepthAndLabels& images = frames()[static_cast<std::size_t>(i)];
    const double start = now_ms(setup.threads);
    (void)mapper.integrate(images.depth, setup.labels ? &images.labels : nullptr,
                           T_odom_room * BoxRoom::T_room_cam(i), static_cast<KeyframeIndex>(i));
    const double integrated = now_ms(setup.threads);
    mapper.update_mesh();
    mesh.push_back(now_ms(setup.threads) - integrated);
    integrate.push_back(integrated - start);
  }
  const double start = now_ms(setup.threads);
  const MapMesh result = mapper.mesh();
  const double whole = now_ms(setup.threads) - start;
  double error = 0.0;
  std::size_t right = 0;
  for (std::size_t i = 0; i < result.mesh.vertices.size(); ++i) {
    const Eigen::Vector3d p = T_odom_room.inverse() * result.mesh.vertices[i].cast<double>();
    error += BoxRoom::distance(p);
    if (setup.labels && result.mesh.labels[i] == BoxRoom::label_at(p)) ++right;
  }
  const auto count = static_cast<double>(result.mesh.vertices.size());
  std::printf(
      "%5.2f  %-8s %-3s %-3s %d  %5.2f / %5.2f / %5.2f  %5.2f / %5.2f  %5.1f  %7.0f  %6zu  %6.3f  "
      "%6.4f\n",
      setup.voxel_m, name_of(setup.placement), setup.labels ? "yes" : "no",
      setup.carving ? "yes" : "no", setup.threads, quantile(integrate, 0.5),
      quantile(integrate, 0.9), quantile(integrate, 1.0), quantile(mesh, 0.5), quantile(mesh, 0.9),
      whole, count, mapper.size().blocks, 1e3 * error / count, static_cast<double>(right) / count);
  std::fflush(stdout);
}

TEST_CASE("Box room", "[!benchmark]") {
  (void)frames();
  std::printf(
      "voxel grid     lab car thr integrate p50/p90/max ms  mesh p50/p90  all  vertices blocks  "
      "error mm  labels right\n");
  for (const double voxel_m : {0.05, 0.10})
    for (const int threads : {1, 2})
      for (const bool labels : {false, true})
        for (const bool carving : {false, true})
          run({voxel_m, labels, carving, threads, Placement::kHalfway});
  for (const double voxel_m : {0.05, 0.10})
    for (const Placement placement : {Placement::kAligned, Placement::kTurned})
      run({voxel_m, true, true, 1, placement});
}

}  // namespace
}  // namespace km
