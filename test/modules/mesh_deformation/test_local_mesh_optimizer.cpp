#include <algorithm>
#include <catch2/catch.hpp>
#include <limits>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "modules/core/lie.hpp"
#include "modules/mesh_deformation/local_mesh_optimizer.hpp"
#include "test/modules/mesh_deformation/corridor.hpp"
#include "test/support/random_pose.hpp"

namespace km {
namespace {

using Catch::Contains;

constexpr double kSame = 1e-6;  // [m]; some roundings of floats below 10 m

std::string refusal(const MapMesh& map, const std::vector<SE3>& odometry,
                    const std::vector<SE3>& optimised) {
  LocalMeshOptimizer optimizer;
  try {
    (void)optimizer.optimize(map, odometry, optimised);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return {};
}

}  // namespace

TEST_CASE("Keyframes that move rigidly move the mesh rigidly", "[mesh_deformation]") {
  const auto seed = GENERATE(range(0U, 3U));
  CAPTURE(seed);
  std::mt19937 rng(seed);
  const SE3 T_world_odom = random_pose(rng, 1.0);
  const MapMesh map = sheet(kSheet);
  const std::vector<SE3> keyframes = keyframes_above(kSheet);
  LocalMeshOptimizer optimizer;
  const DeformedMesh result = optimizer.optimize(map, keyframes, moved(T_world_odom, keyframes));
  double largest = 0.0;
  for (std::size_t v = 0; v < map.mesh.vertices.size(); ++v) {
    const Eigen::Vector3d expected = T_world_odom * map.mesh.vertices[v].cast<double>();
    largest = std::max(largest, (result.mesh.vertices[v].cast<double>() - expected).norm());
  }
  CHECK(largest < 2 * kSame);  // up to 10 m as float
  CHECK(result.report.status == DeformationStatus::kConverged);
  CHECK(result.report.nodes > 20);
  CHECK(result.report.unbound_vertices == 0);
  CHECK(result.mesh.faces == map.mesh.faces);
  CHECK(result.mesh.labels == map.mesh.labels);
}

TEST_CASE("A straight corridor follows bent keyframes and stays locally rigid",
          "[mesh_deformation]") {
  // 20 m on a circle of 15 m: the end rises by 11 m and turns by 76 degrees.
  const double radius_m = 15.0;
  const SheetSize size{.columns = 80, .rows = 8, .step_m = 0.25, .keyframe_step_m = 0.5};
  const MapMesh map = sheet(size);
  const std::vector<SE3> keyframes = keyframes_above(size);
  LocalMeshOptimizer optimizer;
  const DeformedMesh result = optimizer.optimize(map, keyframes, bent(keyframes, radius_m));
  CHECK(result.report.status == DeformationStatus::kConverged);
  double largest_m = 0.0;
  for (std::size_t v = 0; v < map.mesh.vertices.size(); ++v) {
    const SE3 vertex = make_pose(Eigen::Matrix3d::Identity(), map.mesh.vertices[v].cast<double>());
    const Eigen::Vector3d expected = bend(vertex, radius_m).translation();
    largest_m = std::max(largest_m, (result.mesh.vertices[v].cast<double>() - expected).norm());
  }
  // Keyframes 1 m ahead see the surface bent, which odometry saw straight: at most 1 m^2 / (2 * 15
  // m) = 3.3 cm.
  CHECK(largest_m < 0.035);
  double largest_stretch = 0.0;
  for (const auto& [a, b, c] : map.mesh.faces) {
    const double before = (map.mesh.vertices[b] - map.mesh.vertices[a]).norm();
    const double after = (result.mesh.vertices[b] - result.mesh.vertices[a]).norm();
    largest_stretch = std::max(largest_stretch, std::abs(after / before - 1.0));
  }
  // The surface is 1.5 m below the keyframes' arc: it is 15 / 15 as long there, itself neutral.
  CHECK(largest_stretch < 0.1);
}

TEST_CASE("A warm start and a cold start have the same solution", "[mesh_deformation]") {
  // Within a millimetre at the default tolerance, and within the precision of floats at a small
  // one.
  const auto [tolerance, same_m] = GENERATE(
      table<double, double>({{DeformationStop().energy_tolerance, 1e-3}, {1e-14, 2 * kSame}}));
  CAPTURE(tolerance);
  const DeformationStop stop{.energy_tolerance = tolerance};
  const MapMesh map = sheet(kSheet);
  const std::vector<SE3> keyframes = keyframes_above(kSheet);
  LocalMeshOptimizer optimizer({}, stop);
  for (const double radius_m : {60.0, 20.0, -30.0, 10.0}) {
    CAPTURE(radius_m);
    const DeformedMesh warm = optimizer.optimize(map, keyframes, bent(keyframes, radius_m));
    LocalMeshOptimizer fresh({}, stop);
    const DeformedMesh cold = fresh.optimize(map, keyframes, bent(keyframes, radius_m));
    CHECK(warm.report.warm == (radius_m != 60.0));
    CHECK_FALSE(cold.report.warm);
    CHECK(warm.report.status == DeformationStatus::kConverged);
    CHECK(largest_distance_m(warm.mesh, cold.mesh) < same_m);
  }
}

TEST_CASE("A mesh that grows extends the graph", "[mesh_deformation]") {
  SheetSize size{.columns = 16, .rows = 8, .step_m = 0.25, .keyframe_step_m = 0.5};
  LocalMeshOptimizer growing;
  std::size_t nodes = 0;
  for (; size.columns <= 64; size.columns += 16) {
    CAPTURE(size.columns);
    const MapMesh map = sheet(size);
    const std::vector<SE3> keyframes = keyframes_above(size);
    const std::vector<SE3> corrected = bent(keyframes, 15.0);
    const DeformedMesh result = growing.optimize(map, keyframes, corrected);
    CHECK(result.report.new_nodes > 0);
    CHECK(result.report.nodes == nodes + result.report.new_nodes);
    nodes = result.report.nodes;
    LocalMeshOptimizer fresh;
    const DeformedMesh anew = fresh.optimize(map, keyframes, corrected);
    // Other nodes, the same surface: the difference is at most the error of each (see the bent
    // corridor).
    CHECK(largest_distance_m(result.mesh, anew.mesh) < 0.035);
  }
}

TEST_CASE("Removed and moved vertices leave the rest in place", "[mesh_deformation]") {
  MapMesh map = sheet(kSheet);
  const std::vector<SE3> keyframes = keyframes_above(kSheet);
  LocalMeshOptimizer optimizer;
  const std::size_t nodes = optimizer.optimize(map, keyframes, keyframes).report.nodes;
  map.mesh.faces.clear();
  const auto last = [](auto& list) { list.erase(list.end() - 20, list.end()); };
  last(map.mesh.vertices);
  last(map.mesh.labels);
  last(map.seen_by);
  last(map.ids);
  map.mesh.vertices.erase(map.mesh.vertices.begin());
  map.mesh.labels.erase(map.mesh.labels.begin());
  map.seen_by.erase(map.seen_by.begin());
  map.ids.erase(map.ids.begin());
  map.mesh.vertices[5] += Eigen::Vector3f(0, 0, 0.01F);
  const DeformedMesh result = optimizer.optimize(map, keyframes, keyframes);
  CHECK(result.report.nodes == nodes);
  CHECK(largest_distance_m(result.mesh, map.mesh) < kSame);
}

TEST_CASE("Invalid input is refused by name", "[mesh_deformation]") {
  struct Call {
    MapMesh map = sheet(kSheet);
    std::vector<SE3> keyframes = keyframes_above(kSheet), optimised = keyframes;
  };
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  const auto check_refusal = [](const char* reason, const auto& corrupt) {
    Call input;
    corrupt(input);
    CHECK_THAT(refusal(input.map, input.keyframes, input.optimised), Contains(reason));
  };
  check_refusal("optimised pose of keyframe 3",
                [](Call& in) { in.optimised[3].translation().y() = double{kNan}; });
  check_refusal("odometry pose of keyframe 2", [](Call& in) { in.keyframes[2].linear() *= 1.01; });
  check_refusal("odometry pose of keyframe 2", [](Call& in) { in.keyframes[2].linear() *= -1.0; });
  check_refusal("optimised poses for", [](Call& in) { in.optimised.push_back(SE3::Identity()); });
  check_refusal("0 optimised poses", [](Call& in) { in.optimised.clear(); });
  check_refusal("vertex was seen by keyframes", [](Call& in) { in.map.seen_by[5][1] = 1000; });
  check_refusal("vertex was seen by keyframes", [](Call& in) { in.map.seen_by[5] = {3, 2}; });
  check_refusal("a vertex is not finite", [](Call& in) { in.map.mesh.vertices[4].x() = kNan; });
}

TEST_CASE("A refused call leaves the optimizer unchanged", "[mesh_deformation]") {
  const MapMesh map = sheet(kSheet);
  const std::vector<SE3> keyframes = keyframes_above(kSheet);
  LocalMeshOptimizer optimizer;
  (void)optimizer.optimize(map, keyframes, keyframes);
  const std::vector<SE3> fewer(keyframes.begin(), keyframes.end() - 1);
  CHECK_THROWS_AS(optimizer.optimize({}, fewer, fewer), std::invalid_argument);
  const DeformedMesh result = optimizer.optimize(map, keyframes, keyframes);
  CHECK(result.report.warm);
  CHECK(result.report.new_nodes == 0);
  optimizer.reset();
  CHECK(optimizer.optimize({}, fewer, fewer).mesh.empty());
}

}  // namespace km
