#include <algorithm>
#include <catch2/catch.hpp>
#include <random>
#include <stdexcept>
#include <vector>

#include "modules/mesh_deformation/mesh_corrector.hpp"
#include "modules/mesh_deformation/mesh_node.hpp"
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

// A corridor gone along twice; odometry puts the second visit 0.6 m higher.
struct TwoVisits {
  static constexpr float kDrift_m = 0.6F;

  TwoVisits() {
    const MapMesh once = sheet(kSheet);
    const auto count = static_cast<KeyframeIndex>(keyframe_count(kSheet));
    map = once;
    map.voxel_m = kSheet.step_m;
    LabelledMesh again = once.mesh;
    for (Eigen::Vector3f& p : again.vertices) p.z() += kDrift_m;
    map.mesh.append(again);
    for (const auto& [first, last] : once.seen_by) {
      map.seen_by.push_back({first + count + kAway, last + count + kAway});
      map.ids.push_back(map.ids.size());
    }
    for (const SE3& pose : keyframes_above(kSheet)) T_world_kf.push_back(pose);
    T_world_kf.resize(T_world_kf.size() + kAway, T_world_kf.back());
    for (const SE3& pose : keyframes_above(kSheet)) T_world_kf.push_back(pose);
    T_odom_kf = T_world_kf;
    for (std::size_t i = count; i < T_odom_kf.size(); ++i)
      T_odom_kf[i].translation().z() += static_cast<double>(kDrift_m);
  }
  [[nodiscard]] CorrectionInput input() const { return {map, version, T_odom_kf, T_world_kf}; }
  [[nodiscard]] std::size_t one() const { return map.mesh.faces.size() / 2; }

  static constexpr KeyframeIndex kAway = 30;  // keyframes between the visits
  MapMesh map;
  std::vector<SE3> T_odom_kf, T_world_kf;
  std::uint64_t version = 1;
};

TEST_CASE("Of two visits that coincide once they are corrected, the newer stays",
          "[mesh_deformation]") {
  TwoVisits visits;
  MeshDeformationConfig config;
  config.duplicate_faces = 0;
  SECTION("corrected") {
    MeshCorrector corrector(config);
    const auto first = corrector.correct(visits.input());
    REQUIRE(first);
    CHECK(first->mesh.faces.size() == visits.one());
    CHECK(first->mesh.labels.size() == first->mesh.vertices.size());
    CHECK(first->superseded_faces == visits.one());
    CHECK(first->report.vertices == visits.map.mesh.vertices.size());
    const auto count = static_cast<std::uint64_t>(visits.map.ids.size() / 2);
    REQUIRE(first->superseded.vertices.size() == count);
    for (std::uint64_t v = 0; v < count; ++v) {
      CHECK(first->superseded.vertices[v].id == v);
      CHECK(first->superseded.vertices[v].heir == v + count);
    }
    for (SE3& pose : visits.T_world_kf) pose.translation().y() += 1.0;
    const auto moved = corrector.correct(visits.input());
    REQUIRE(moved);
    CHECK_FALSE(moved->deformed);
    CHECK(moved->mesh.faces == first->mesh.faces);
    CHECK(moved->superseded.vertices.empty());
  }
  SECTION("as odometry has them, both stay") {
    visits.T_world_kf = visits.T_odom_kf;
    const auto result = MeshCorrector(config).correct(visits.input());
    REQUIRE(result);
    CHECK(result->mesh.faces.size() == 2 * visits.one());
    CHECK(result->superseded.vertices.empty());
  }
  SECTION("switched off, both stay") {
    config.duplicate_voxels = 0.0;
    CHECK(MeshCorrector(config).correct(visits.input())->superseded_faces == 0);
  }
  SECTION("as long as there is room, both stay") {
    config.duplicate_faces = static_cast<int>(visits.map.mesh.faces.size());
    CHECK(MeshCorrector(config).correct(visits.input())->superseded_faces == 0);
    --config.duplicate_faces;
    CHECK(MeshCorrector(config).correct(visits.input())->superseded_faces == visits.one());
  }
  SECTION("of voxels of unknown size, both stay") {
    visits.map.voxel_m = 0.0;
    CHECK(MeshCorrector(config).correct(visits.input())->superseded_faces == 0);
  }
}

// Coming again and again: the mapper drops what is superseded, and the graph follows.
TEST_CASE("The deformation graph does not grow in a place seen again and again",
          "[mesh_deformation]") {
  TwoVisits visits;
  const std::uint64_t count = visits.map.ids.size() / 2;
  MeshDeformationConfig config;
  config.duplicate_faces = 0;
  MeshCorrector corrector(config);
  std::size_t nodes_at_first = 0, most_nodes = 0;
  for (std::uint64_t visit = 0; visit < 8; ++visit) {
    const auto result = corrector.correct(visits.input());
    REQUIRE(result);
    CHECK(result->mesh.faces.size() == visits.one());
    if (visit == 0) nodes_at_first = result->report.nodes;
    most_nodes = std::max(most_nodes, result->report.nodes);
    // The older copy is gone, the newer one is the older now, and a third comes.
    const auto keyframes = static_cast<KeyframeIndex>(keyframe_count(kSheet)) + TwoVisits::kAway;
    for (std::uint64_t& id : visits.map.ids) id += count;
    for (SeenBy& seen : visits.map.seen_by) seen = {seen[0] + keyframes, seen[1] + keyframes};
    visits.T_odom_kf.resize(visits.T_odom_kf.size() + TwoVisits::kAway, visits.T_odom_kf.back());
    for (SE3 pose : keyframes_above(kSheet)) {
      visits.T_world_kf.push_back(pose);
      pose.translation().z() +=
          static_cast<double>(TwoVisits::kDrift_m) * static_cast<double>(visit + 2);
      visits.T_odom_kf.push_back(pose);
    }
    visits.T_world_kf.insert(visits.T_world_kf.end() - std::ssize(keyframes_above(kSheet)),
                             TwoVisits::kAway, visits.T_world_kf.back());
    for (Eigen::Vector3f& p : visits.map.mesh.vertices) p.z() += TwoVisits::kDrift_m;
    ++visits.version;
  }
  CHECK(most_nodes <= 2 * nodes_at_first);
}

}  // namespace
}  // namespace km
