#include <algorithm>
#include <catch2/catch.hpp>
#include <random>
#include <stdexcept>
#include <vector>

#include "modules/mesh_deformation/mesh_corrector.hpp"
#include "test/modules/mesh_deformation/corridor.hpp"
#include "test/support/random_pose.hpp"

namespace km {
namespace {

const SheetSize kSheet{.columns = 32, .rows = 8, .step_m = 0.25, .keyframe_step_m = 0.5};
constexpr double kSame_m = 1e-5;  // a few roundings of floats below 20 m

struct Corridor {
  MapMesh map = sheet(kSheet);
  std::vector<SE3> T_odom_kf = keyframes_above(kSheet);
  std::vector<SE3> T_world_kf = T_odom_kf;
  std::uint64_t version = 1;

  [[nodiscard]] CorrectionInput input() const { return {map, version, T_odom_kf, T_world_kf}; }
  void bend_to(double radius_m) {
    for (std::size_t i = 0; i < T_odom_kf.size(); ++i) T_world_kf[i] = bend(T_odom_kf[i], radius_m);
  }
  void move(const SE3& T) {
    for (SE3& pose : T_world_kf) pose = T * pose;
  }
};

double largest_distance_m(const LabelledMesh& a, const LabelledMesh& b) {
  REQUIRE(a.vertices.size() == b.vertices.size());
  double largest = 0.0;
  for (std::size_t v = 0; v < a.vertices.size(); ++v)
    largest = std::max(largest, static_cast<double>((a.vertices[v] - b.vertices[v]).norm()));
  return largest;
}

TEST_CASE("A mesh is corrected once, then only for a reason", "[mesh_deformation]") {
  Corridor corridor;
  corridor.bend_to(20.0);
  MeshCorrector corrector(MeshDeformationConfig{});
  const auto first = corrector.correct(corridor.input());
  REQUIRE(first);
  CHECK(first->deformed);
  CHECK_FALSE(corrector.correct(corridor.input()));

  SECTION("a keyframe that moved by less than the threshold is none") {
    corridor.T_world_kf[3].translation().z() += 0.005;
    CHECK_FALSE(corrector.correct(corridor.input()));
  }
  SECTION("a keyframe that moved by more") {
    corridor.T_world_kf[3].translation().z() += 0.015;
    CHECK(corrector.correct(corridor.input()).value().deformed);
  }
  SECTION("a keyframe that turned by more") {
    corridor.T_world_kf[3].linear() *= bend(corridor.T_odom_kf[1], 25.0).linear();
    CHECK(corrector.correct(corridor.input()).value().deformed);
  }
  SECTION("small moves that add up") {
    int corrections = 0;
    for (int i = 0; i < 12; ++i) {
      corridor.T_world_kf[3].translation().z() += 0.002;  // 24 mm in all, the threshold is 10
      corrections += corrector.correct(corridor.input()) ? 1 : 0;
    }
    CHECK(corrections == 2);
  }
  SECTION("another map") {
    ++corridor.version;
    CHECK(corrector.correct(corridor.input()).value().deformed);
  }
  SECTION("a new keyframe that the map does not know yet is none") {
    corridor.T_odom_kf.push_back(corridor.T_odom_kf.back());
    CHECK_FALSE(corrector.correct(corridor.input()));
  }
}

TEST_CASE("A mesh whose keyframes all move alike is moved as a whole", "[mesh_deformation]") {
  const auto seed = GENERATE(range(0U, 3U));
  CAPTURE(seed);
  std::mt19937 rng(seed);
  Corridor corridor;
  corridor.bend_to(20.0);
  MeshCorrector corrector(MeshDeformationConfig{});
  const auto first = corrector.correct(corridor.input());
  REQUIRE(first);
  for (int i = 0; i < 3; ++i) {  // again and again: from the last optimisation, without drift
    corridor.move(random_pose(rng, 2.0));
    const auto moved = corrector.correct(corridor.input());
    REQUIRE(moved);
    CHECK_FALSE(moved->deformed);
    CHECK(moved->report.nodes == first->report.nodes);
    CHECK(moved->mesh.faces == corridor.map.mesh.faces);
    CHECK(moved->mesh.labels == corridor.map.mesh.labels);
    LocalMeshOptimizer fresh;
    const DeformedMesh anew = fresh.optimize(corridor.map, corridor.T_odom_kf, corridor.T_world_kf);
    CHECK(largest_distance_m(moved->mesh, anew.mesh) < kSame_m);
    CHECK_FALSE(corrector.correct(corridor.input()));
  }
  SECTION("then one of them bends: what was optimised before is what counts") {
    corridor.T_world_kf[5].translation() += Eigen::Vector3d(0.0, 0.0, 0.02);
    CHECK(corrector.correct(corridor.input()).value().deformed);
  }
  SECTION("a small motion of all is no reason") {
    corridor.move(make_pose(Eigen::Matrix3d::Identity(), {0.0, 0.004, 0.0}));
    CHECK_FALSE(corrector.correct(corridor.input()));
  }
}

TEST_CASE("A refused correction is as if it had not been asked for", "[mesh_deformation]") {
  Corridor corridor;
  MeshCorrector corrector(MeshDeformationConfig{});
  Corridor without;
  without.T_world_kf.clear();
  CHECK_THROWS_AS(corrector.correct(without.input()), std::invalid_argument);
  CHECK(corrector.correct(corridor.input()));
  ++without.version;
  CHECK_THROWS_AS(corrector.correct(without.input()), std::invalid_argument);
  CHECK_THROWS_AS(corrector.correct_afresh(without.input()), std::invalid_argument);
  CHECK_FALSE(corrector.correct(corridor.input()));
}

TEST_CASE("A mesh corrected afresh does not show what was corrected before", "[mesh_deformation]") {
  Corridor corridor;
  corridor.bend_to(20.0);
  MeshCorrector fresh(MeshDeformationConfig{});
  const MeshCorrection expected = fresh.correct_afresh(corridor.input());
  CHECK(expected.deformed);

  MeshCorrector corrector(MeshDeformationConfig{});
  Corridor half;  // a smaller map first: other nodes
  half.map = sheet({.columns = 16, .rows = 8, .step_m = 0.25, .keyframe_step_m = 0.5});
  half.bend_to(30.0);
  REQUIRE(corrector.correct(half.input()));
  corridor.version = 2;
  const auto on_the_way = corrector.correct(corridor.input());
  REQUIRE(on_the_way);
  CHECK(on_the_way->mesh.vertices != expected.mesh.vertices);  // else there is nothing to test
  CHECK(corrector.correct_afresh(corridor.input()).mesh.vertices == expected.mesh.vertices);
  CHECK_FALSE(corrector.correct(corridor.input()));
}

}  // namespace
}  // namespace km
