#include "modules/mesh/seen_through.hpp"
#include "modules/mesh_deformation/mesh_corrector.hpp"
#include "test/modules/semantic_mapping/wall_scene.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

using Box = Eigen::AlignedBox3d;

Box box(const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
  return {low, high};
}

// Depth along a ray to the first of some boxes, from outside.
struct BoxScene {
  std::vector<Box> boxes;

  double operator()(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                    LabelId& label) const {
    double nearest = std::numeric_limits<double>::infinity();
    label = 1;
    for (const Box& solid : boxes) {
      double in = 0.0, out = std::numeric_limits<double>::infinity();
      for (int axis = 0; axis < 3; ++axis) {
        const double a = (solid.min()[axis] - origin[axis]) / direction[axis];
        const double b = (solid.max()[axis] - origin[axis]) / direction[axis];
        in = std::max(in, std::min(a, b));
        out = std::min(out, std::max(a, b));
      }
      if (in <= out && in > 0.0) nearest = std::min(nearest, in);
    }
    return nearest;
  }
};

const Box kWall = box({-20.0, -20.0, 4.0}, {20.0, 20.0, 5.0});
const Box kFloor = box({-20.0, 0.8, -20.0}, {20.0, 2.0, 20.0});  // y is down
const Box kParked = box({-0.5, -0.4, 2.0}, {0.5, 0.8, 2.6});
const Box kPole = box({0.8, -3.0, 2.0}, {0.92, 3.0, 2.12});
const Box kScreen = box({-3.0, -3.0, 2.5}, {-1.0, 3.0, 2.7});

// A camera looks along z. It moves along x to kEnd_m and back to the start. Each pose is a
// keyframe. With a window of 1 m, surface at x = 0 is final when the camera returns.
class TwoPasses {
 public:
  TwoPasses(BoxScene first, BoxScene second)
      : first_(std::move(first)), second_(std::move(second)) {}

  // Difference between the true pose and odometry in the second pass [m].
  Eigen::Vector3d drift = Eigen::Vector3d::Zero();
  // Standard deviation of the poses of the second pass [m].
  double sigma_m = 0.0;
  double voxel_m = 0.1;

  struct Recording {
    MapMesh map;
    std::vector<SE3> poses;
    std::vector<Matrix6> covariances;

    [[nodiscard]] CorrectionInput input(std::uint64_t version) const {
      return {map, version, poses, poses, covariances};
    }
  };

  Recording record() const {
    SemanticMappingConfig config = settings(voxel_m);
    config.window_m = 1.0;
    SemanticMapper mapper(config, small_camera(), two_classes());
    Recording result;
    for (int k = 0; k < 60; ++k) {
      const bool is_first = k < 30;
      const SE3 T = at(-1.5 + kStep_m * (is_first ? k : 59 - k));
      const SE3 T_true = is_first ? T : at(T.translation().x() + drift.x(), drift.y(), drift.z());
      REQUIRE(integrate(mapper, render(small_camera(), T_true, is_first ? first_ : second_), T,
                        static_cast<KeyframeIndex>(k)));
      mapper.update_mesh();
      result.poses.push_back(T);
      const double variance = is_first ? 0.0 : sigma_m * sigma_m;
      result.covariances.emplace_back(variance * Matrix6::Identity());
    }
    result.map = mapper.mesh();
    return result;
  }

  MeshCorrection run(int seen_through_views) const {
    MeshDeformationConfig correction{.seen_through_views = seen_through_views};
    const Recording recording = record();
    return MeshCorrector(correction).correct_from_scratch(recording.input(1));
  }

  // Number of faces within half a voxel of true surface that the removal takes away. Farther away
  // there are spurious faces at the borders of near surface, which may go.
  [[nodiscard]] std::size_t removed() const {
    const MeshCorrection all = run(0), some = run(3);
    CHECK(all.seen_through == 0);
    CHECK(some.mesh.faces.size() + some.seen_through == all.mesh.faces.size());
    return faces_near_truth(all.mesh) - faces_near_truth(some.mesh);
  }

 private:
  static constexpr double kStep_m = 0.35;
  [[nodiscard]] std::size_t faces_near_truth(const LabelledMesh& mesh) const {
    const auto is_near = [&](std::uint32_t vertex) {
      return std::ranges::any_of(first_.boxes, [&](const Box& solid) {
        return solid.exteriorDistance(mesh.vertices[vertex].cast<double>()) < 0.5 * voxel_m;
      });
    };
    return static_cast<std::size_t>(std::ranges::count_if(
        mesh.faces, [&](const auto& face) { return std::ranges::all_of(face, is_near); }));
  }

  BoxScene first_, second_;
};

std::size_t vertices_in(const LabelledMesh& mesh, const Box& space) {
  return static_cast<std::size_t>(std::ranges::count_if(
      mesh.vertices, [&](const Eigen::Vector3f& p) { return space.contains(p.cast<double>()); }));
}

TEST_CASE("A box that has gone loses its surface, and the wall behind it does not") {
  const TwoPasses world({{kWall, kFloor, kParked}}, {{kWall, kFloor}});
  const MeshCorrection all = world.run(0), some = world.run(3);
  // The lowest 0.3 m are before the floor, which the cells around a vertex show behind it.
  const Box middle = box({-0.6, -0.5, 1.9}, {0.6, 0.45, 2.7});
  REQUIRE(vertices_in(all.mesh, middle) > 100);
  CHECK(vertices_in(some.mesh, middle) == 0);
  const Box wall = box({-20.0, -20.0, 3.8}, {20.0, 0.6, 4.2});
  CHECK(vertices_in(some.mesh, wall) == vertices_in(all.mesh, wall));
  const Box floor = box({-20.0, 0.7, 0.0}, {20.0, 0.9, 3.5});
  CHECK(vertices_in(some.mesh, floor) + 60 > vertices_in(all.mesh, floor));  // the rim of the box
  CHECK(some.origin.seen_by.size() == some.mesh.vertices.size());
  CHECK(some.origin.mapped.size() == some.mesh.vertices.size());
}

TEST_CASE("The mapper may drop a box that two searches for copies find gone") {
  auto recording = TwoPasses({{kWall, kFloor, kParked}}, {{kWall, kFloor}}).record();
  MeshDeformationConfig config{.duplicate_faces = 0};
  MeshCorrector corrector(config, {.share = 0.0});
  REQUIRE(corrector.correct(recording.input(1))->superseded.vertices.empty());

  MapMesh& map = recording.map;  // one face more lets a second search follow
  const auto n = static_cast<std::uint32_t>(map.mesh.vertices.size());
  map.mesh.faces.push_back({n, n + 1, n + 2});
  for (const float x : {0.0F, 0.1F, 0.2F}) {
    map.mesh.vertices.emplace_back(x, 10.0F * x, -9.0F);
    map.mesh.labels.push_back(1);
    map.seen_by.push_back(map.seen_by.back());
    map.certainty.push_back(map.certainty.back());
    map.levels.push_back(map.levels.back());
    map.ids.push_back(map.ids.back() + 1);
  }
  const auto second = corrector.correct(recording.input(2));
  REQUIRE(second);
  CHECK(second->superseded_faces == 0);
  const Box around = box({-0.8, -0.7, 1.7}, {0.8, 1.1, 2.9});
  std::size_t in_box = 0;
  for (const auto& [id, replacement] : second->superseded.vertices) {
    CHECK(replacement == id);
    const auto v = std::ranges::lower_bound(map.ids, id) - map.ids.begin();
    in_box += around.contains(map.mesh.vertices[static_cast<std::size_t>(v)].cast<double>());
  }
  CHECK(in_box > 100);
  CHECK(in_box > second->superseded.vertices.size() * 9 / 10);
}

TEST_CASE("Surface that is still there stays") {
  const BoxScene scene{{kWall, kFloor, kPole, kScreen}};
  SECTION("in voxels of 0.1 m") {
    CHECK(TwoPasses(scene, scene).removed() == 0);
  }
  SECTION("a pole of two voxels") {
    TwoPasses world(scene, scene);
    world.voxel_m = 0.05;
    CHECK(world.removed() == 0);
  }
  SECTION("odometry has drifted by 5 cm, unknown to the covariance") {
    const int axis = GENERATE(0, 1, 2);
    const double sign = GENERATE(-1.0, 1.0);
    CAPTURE(axis, sign);
    TwoPasses world(scene, scene);
    world.drift = 0.05 * sign * Eigen::Vector3d::Unit(axis);
    CHECK(world.removed() == 0);
  }
}

TEST_CASE("Surface seen once stays") {
  // In the second pass a wall before it hides the box.
  const Box near = box({-20.0, -20.0, 1.5}, {20.0, 20.0, 1.6});
  CHECK(TwoPasses({{kWall, kParked}}, {{kWall, kParked, near}}).removed() == 0);
}

TEST_CASE("Surface stays if the covariance of the poses explains the view through it") {
  TwoPasses world({{kWall, kScreen}}, {{kWall, kScreen}});
  world.drift.x() = 0.5;
  CHECK(world.removed() > 0);
  world.sigma_m = 0.2;
  CHECK(world.removed() == 0);
}

TEST_CASE("Errors of poses on a chain count from one to the other") {
  std::vector<Matrix6> covariances;
  // Out along a chain, a closure at keyframe 4 to the first one, and out again.
  for (const double variance : {0.0, 1.0, 2.0, 3.0, 0.5, 1.5, 2.5}) {
    covariances.emplace_back(Matrix6::Zero());
    covariances.back()(3, 3) = variance;
    covariances.back()(0, 0) = 4.0 * variance;
  }
  const std::vector<PoseSigma> sigmas = relative_sigmas(covariances, 6);
  const auto variance = [&](std::size_t k) {
    return sigmas[k].translation_m * sigmas[k].translation_m;
  };
  CHECK(variance(6) == 0.0F);
  CHECK(variance(5) == Approx(1.0));              // 2.5 - 1.5
  CHECK(variance(4) == Approx(2.0));              // 2.5 - 0.5
  CHECK(variance(3) == Approx(3.0 + 2.5 - 1.0));  // both since keyframe 4
  CHECK(variance(0) == Approx(2.5));
  CHECK(sigmas[5].rotation_rad == Approx(2.0));
  CHECK(relative_sigmas(covariances, 3)[6].translation_m == Approx(sigmas[3].translation_m));
}

TEST_CASE("Views that show surface again outweigh views through it") {
  const BoxScene empty{{kWall}}, parked{{kWall, kParked}};
  CoarseViews views(small_camera(), {}, 0.3);
  const auto add = [&](const BoxScene& scene) {
    const auto k = static_cast<KeyframeIndex>(views.views().size());
    const SE3 T = at(k % 2 == 0 ? 0.0 : 0.35);
    views.add(render(small_camera(), T, scene).depth, T, k);
  };
  const auto is_gone = [&]() -> bool {
    const std::vector<SightPoint> front{{{0.1F, 0.2F, 2.0F}, -1, 0}};
    SightVotes votes(front, 0.1);
    for (const auto& view : views.views())
      votes.add(*view, view->T_odom_cam, view->keyframe, std::vector<PoseSigma>(1));
    return votes.seen_through(3)[0];
  };
  for (int i = 0; i < 2; ++i) add(empty);
  CHECK_FALSE(is_gone());
  add(empty);
  CHECK(is_gone());
  add(parked);
  CHECK_FALSE(is_gone());
  for (int i = 0; i < 9; ++i) add(parked);
  for (int i = 0; i < 2; ++i) add(empty);
  CHECK_FALSE(is_gone());
  add(empty);
  CHECK(is_gone());
}

}  // namespace
}  // namespace km
