#include "modules/mesh_deformation/local_mesh_optimization.hpp"
#include "test/modules/mesh_deformation/corridor.hpp"
#include "test/support/random_pose.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

constexpr double kSame = 1e-6;  // [m]; some roundings of floats below 10 m

std::string refusal(const MapMesh& map, const std::vector<SE3>& odometry,
                    const std::vector<SE3>& optimised) {
  try {
    (void)optimize_mesh(map, odometry, optimised);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return {};
}

}  // namespace

TEST_CASE("Keyframes that move rigidly move the mesh rigidly") {
  const auto seed = GENERATE(range(0U, 3U));
  CAPTURE(seed);
  std::mt19937 rng(seed);
  const SE3 T_world_odom = random_pose(rng, 1.0);
  const MapMesh map = sheet(kSheet);
  const std::vector<SE3> keyframes = keyframes_above(kSheet);
  const DeformedMesh result = optimize_mesh(map, keyframes, moved(T_world_odom, keyframes));
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

TEST_CASE("A straight corridor follows bent keyframes and stays locally rigid") {
  // 20 m on a circle of 15 m: the end rises by 11 m and turns by 76 degrees.
  const double radius_m = 15.0;
  const SheetSize size{.columns = 80, .rows = 8, .step_m = 0.25, .keyframe_step_m = 0.5};
  const MapMesh map = sheet(size);
  const std::vector<SE3> keyframes = keyframes_above(size);
  const DeformedMesh result = optimize_mesh(map, keyframes, bent(keyframes, radius_m));
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

TEST_CASE("Invalid input is refused by name") {
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

}  // namespace km
