#include "apps/robot/mesh_files_node.hpp"
#include "modules/core/geometry/lie.hpp"
#include "modules/mesh/mesh_file.hpp"
#include "test/support/captured_log.hpp"
#include "test/support/nav2_map.hpp"
#include "test/support/temporary_folder.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

MapMesh triangle() {
  MapMesh map;
  map.mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  map.mesh.labels = {3, 3, 4};
  map.mesh.faces = {{0, 1, 2}};
  map.seen_by = {{0, 0}, {0, 0}, {0, 0}};
  return map;
}

struct Bench {
  TemporaryFolder folder;
  Topic<KeyframeOdometry> keyframes;
  Topic<Trajectory> trajectory;
  Topic<MapMesh> maps;
  Topic<OptimizedMesh> optimized;
  Topic<OccupancyGrid> maps_2d;
  ResultWriter results;
  MeshFilesNode node{folder.path(),
                     results,
                     {.keyframes = keyframes,
                      .trajectory = trajectory,
                      .maps = maps,
                      .optimized = optimized,
                      .maps_2d = maps_2d}};

  [[nodiscard]] LabelledMesh written(const char* file) const {
    return read_mesh(folder.path() / file);
  }
};

TEST_CASE("A mesh is moved to the optimised pose of its first keyframe") {
  Bench bench;
  bench.node.start();
  const SE3 T_odom_first = make_pose(so3_exp(Eigen::Vector3d(0.0, 0.0, 0.3)), {1.0, 2.0, 0.5});
  const SE3 T_world_first = make_pose(so3_exp(Eigen::Vector3d(0.1, 0.0, -1.0)), {-4.0, 0.0, 1.0});
  bench.keyframes.publish({.id = {2, 0}, .T_odom_kf = T_odom_first});
  bench.keyframes.publish({.id = {2, 1}, .T_odom_kf = SE3::Identity()});
  bench.trajectory.publish({2, 2, {SE3::Identity()}});  // not yet joined to the team
  bench.maps.publish(triangle());
  bench.optimized.publish(OptimizedMesh{{.mesh = triangle().mesh, .report = {}, .superseded = {}}});
  bench.node.stop();
  REQUIRE(bench.node.error() == nullptr);
  bench.node.finish(Trajectory{2, 0, {T_world_first, SE3::Identity()}});
  const LabelledMesh mesh = bench.written("mesh.ply");
  const SE3 T_world_odom = T_world_first * T_odom_first.inverse();
  for (std::size_t i = 0; i < 3; ++i) {
    const Eigen::Vector3d p = T_world_odom * triangle().mesh.vertices[i].cast<double>();
    CHECK((mesh.vertices[i].cast<double>() - p).norm() < 1e-5);  // stored as floats
  }
  CHECK(bench.written("mesh_optimized.ply").vertices == triangle().mesh.vertices);
}

TEST_CASE("The 2D map is written") {
  Bench bench;
  bench.node.start();
  bench.maps_2d.publish(OccupancyGrid{0.5, {-1, 2}, 2, 1, {100, -1}});
  bench.node.stop();
  const OccupancyGrid map =
      load_nav2_map(bench.folder.read("map.yaml"), bench.folder.read("map.pgm"));
  CHECK(map.origin == Eigen::Vector2d(-1, 2));
  CHECK(map.cells == std::vector<std::int8_t>{100, -1});
}

TEST_CASE("A mesh that cannot be written is named, and no end of the run") {
  Bench bench;
  const CapturedLog log;
  const fs::path file = bench.folder.path() / "mesh.ply";
  fs::create_directory(file);
  bench.node.start();
  bench.maps.publish(triangle());
  bench.optimized.publish(OptimizedMesh{{.mesh = triangle().mesh, .report = {}, .superseded = {}}});
  bench.node.stop();
  CHECK(bench.node.error() == nullptr);
  CHECK(bench.written("mesh_optimized.ply").vertices == triangle().mesh.vertices);
  const std::string why = file.string() + ": cannot be written: Is a directory";
  CHECK(bench.results.lost() == std::map<std::string, std::string>{{file.string(), why}});
  CHECK_THAT(log.text(), Contains("error results: " + why));

  fs::remove(file);
  bench.node.finish({});
  CHECK(bench.results.lost().empty());
  CHECK(bench.written("mesh.ply").vertices == triangle().mesh.vertices);
}

}  // namespace
}  // namespace km
