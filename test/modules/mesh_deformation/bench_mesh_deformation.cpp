#include <catch2/catch.hpp>
#include <cstddef>
#include <string>
#include <vector>

#include "modules/mesh_deformation/local_mesh_optimizer.hpp"
#include "test/modules/mesh_deformation/hilly_field.hpp"

// A square of 35 m with 500 000 vertices, about 2000 nodes and 500 keyframes; then twice and four
// times all of it. Drift accumulates to about 2 % of the path and some degrees. Warm: between two
// solutions that differ by a fifth of the drift. Times include everything: checks, simplification,
// graph, solution, interpolation, copy of the mesh. "Connected" has no time window: neighbouring
// lanes, which drift apart, are connected along their whole length. Run with --benchmark-samples 5.

namespace km {
namespace {

void bench(const std::string& size, std::size_t side, std::size_t keyframes, std::size_t lanes,
           int window = MeshDeformationConfig().time_window_keyframes) {
  const HillyField scene = hilly_field(side, keyframes, lanes);
  MeshDeformationConfig config;
  config.node_spacing_m = 0.72;
  config.time_window_keyframes = window;
  const std::vector<SE3> a = drifted(scene.T_odom_kf, 1, 0.002, 0.01);
  const std::vector<SE3> b = drifted(a, 2, 0.0004, 0.002);

  BENCHMARK("cold, " + size) {
    LocalMeshOptimizer optimizer(config);
    return optimizer.optimize(scene.map, scene.T_odom_kf, a).report.iterations;
  };
  LocalMeshOptimizer optimizer(config);
  const MeshDeformationReport report = optimizer.optimize(scene.map, scene.T_odom_kf, a).report;
  WARN(size << ": " << report.nodes << " nodes, " << report.edges << " edges, "
            << report.keyframe_edges << " keyframe edges, " << report.iterations
            << " iterations cold");
  bool second = false;
  BENCHMARK("warm, " + size) {
    second = !second;
    return optimizer.optimize(scene.map, scene.T_odom_kf, second ? b : a).report.iterations;
  };
}

TEST_CASE("Local mesh optimization", "[!benchmark]") {
  bench("500 000 vertices, 500 keyframes", 708, 500, 7);
  bench("the same, connected", 708, 500, 7, 1000000);
}

TEST_CASE("Local mesh optimization, growth", "[!benchmark]") {
  bench("1 000 000 vertices, 1000 keyframes", 1001, 1000, 10);
  bench("2 000 000 vertices, 2000 keyframes", 1415, 2000, 14);
}

}  // namespace
}  // namespace km
