#include "modules/mesh_deformation/mesh_corrector.hpp"
#include "test/modules/mesh_deformation/corridor.hpp"
#include "test/support/random_pose.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

struct Corridor {
  MapMesh map = sheet(kSheet);
  std::vector<SE3> T_odom_kf = keyframes_above(kSheet);
  std::vector<SE3> T_world_kf = T_odom_kf;
  std::uint64_t version = 1;

  [[nodiscard]] CorrectionInput input() const { return {map, version, T_odom_kf, T_world_kf}; }
  void bend_to(double radius_m) { T_world_kf = bent(T_odom_kf, radius_m); }
};

TEST_CASE("A mesh is corrected once and again only for a reason") {
  Corridor corridor;
  corridor.bend_to(20.0);
  MeshCorrector corrector(MeshDeformationConfig{});
  const auto first = corrector.correct(corridor.input());
  REQUIRE(first);
  CHECK_FALSE(corrector.correct(corridor.input()));

  SECTION("a keyframe that moved by less than the threshold is no reason") {
    corridor.T_world_kf[3].translation().z() += 0.005;
    CHECK_FALSE(corrector.correct(corridor.input()));
  }
  SECTION("a keyframe that moved by more") {
    corridor.T_world_kf[3].translation().z() += 0.015;
    CHECK(corrector.correct(corridor.input()));
  }
  SECTION("a keyframe that turned by more") {
    corridor.T_world_kf[3].linear() *= bend(corridor.T_odom_kf[1], 25.0).linear();
    CHECK(corrector.correct(corridor.input()));
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
    CHECK(corrector.correct(corridor.input()));
  }
  SECTION("a new keyframe that the map does not have yet is no reason") {
    corridor.T_odom_kf.push_back(corridor.T_odom_kf.back());
    CHECK_FALSE(corrector.correct(corridor.input()));
  }
}

TEST_CASE("A mesh corrected from scratch does not depend on earlier corrections") {
  Corridor corridor;
  corridor.bend_to(20.0);
  MeshCorrector fresh(MeshDeformationConfig{});
  const MeshCorrection expected = fresh.correct_from_scratch(corridor.input());

  MeshCorrector corrector(MeshDeformationConfig{});
  Corridor half;  // a smaller map first, with other nodes
  half.map = sheet({.columns = 16, .rows = 8, .step_m = 0.25, .keyframe_step_m = 0.5});
  half.bend_to(30.0);
  REQUIRE(corrector.correct(half.input()));
  corridor.version = 2;
  REQUIRE(corrector.correct(corridor.input()));
  CHECK(corrector.correct_from_scratch(corridor.input()).mesh.vertices == expected.mesh.vertices);
  CHECK_FALSE(corrector.correct(corridor.input()));
}

// A corridor visited twice; odometry places the second visit 0.6 m higher.
struct TwoVisits {
  static constexpr float kDrift_m = 0.6F;

  TwoVisits() {
    map = sheet(kSheet);
    map.voxel_m = kSheet.step_m;
    T_odom_kf = T_world_kf = keyframes_above(kSheet);
    add_visit();
  }

  // Adds another visit, which odometry places above the last one.
  void add_visit() {
    const MapMesh once = sheet(kSheet);
    const auto shift = static_cast<KeyframeIndex>(T_odom_kf.size()) + kAway;
    const double height_m = T_odom_kf.back().translation().z() -
                            T_world_kf.back().translation().z() + static_cast<double>(kDrift_m);
    LabelledMesh again = once.mesh;
    for (Eigen::Vector3f& p : again.vertices) p.z() += static_cast<float>(height_m);
    map.mesh.append(again);
    for (const auto& [first, last] : once.seen_by) {
      map.seen_by.push_back({first + shift, last + shift});
      map.ids.push_back(map.ids.size());
    }
    T_world_kf.resize(shift, T_world_kf.back());
    T_odom_kf.resize(shift, T_odom_kf.back());
    for (SE3 pose : keyframes_above(kSheet)) {
      T_world_kf.push_back(pose);
      pose.translation().z() += height_m;
      T_odom_kf.push_back(pose);
    }
    ++version;
  }
  [[nodiscard]] CorrectionInput input() const { return {map, version, T_odom_kf, T_world_kf}; }
  [[nodiscard]] std::size_t one() const { return map.mesh.faces.size() / 2; }

  static constexpr KeyframeIndex kAway = 30;  // keyframes between the visits
  MapMesh map;
  std::vector<SE3> T_odom_kf, T_world_kf;
  std::uint64_t version = 1;
};

TEST_CASE("The newer of two visits that coincide after correction stays") {
  TwoVisits visits;
  MeshDeformationConfig config{.duplicate_faces = 0};
  CopyLimits limits{.copies = 1};
  SECTION("corrected") {
    MeshCorrector corrector(config, limits);
    const auto first = corrector.correct(visits.input());
    REQUIRE(first);
    CHECK(first->mesh.faces.size() == visits.one());
    CHECK(first->mesh.labels.size() == first->mesh.vertices.size());
    const auto& seen_by = visits.map.seen_by;  // the second half of the vertices stays
    const auto half = static_cast<std::ptrdiff_t>(seen_by.size() / 2);
    CHECK(first->origin.seen_by == std::vector(seen_by.begin() + half, seen_by.end()));
    const auto& mapped = visits.map.mesh.vertices;
    CHECK(first->origin.mapped == std::vector(mapped.begin() + half, mapped.end()));
    CHECK(first->superseded_faces == visits.one());
    CHECK(first->report.vertices == visits.map.mesh.vertices.size());
    const auto count = static_cast<std::uint64_t>(visits.map.ids.size() / 2);
    REQUIRE(first->superseded.vertices.size() == count);
    for (std::uint64_t v = 0; v < count; ++v) {
      CHECK(first->superseded.vertices[v].id == v);
      CHECK(first->superseded.vertices[v].replacement == v + count);
    }
    for (SE3& pose : visits.T_world_kf) pose.translation().y() += 1.0;
    const auto again = corrector.correct(visits.input());
    REQUIRE(again);
    CHECK(again->mesh.faces == first->mesh.faces);
    CHECK(again->origin.seen_by == first->origin.seen_by);
  }
  SECTION("with uncorrected poses both stay") {
    visits.T_world_kf = visits.T_odom_kf;
    const auto result = MeshCorrector(config, limits).correct(visits.input());
    REQUIRE(result);
    CHECK(result->mesh.faces.size() == 2 * visits.one());
    CHECK(result->superseded.vertices.empty());
  }
  SECTION("below the bound on faces both stay") {
    config.duplicate_faces = static_cast<int>(visits.map.mesh.faces.size());
    CHECK(MeshCorrector(config, limits).correct(visits.input())->superseded_faces == 0);
    --config.duplicate_faces;
    CHECK(MeshCorrector(config, limits).correct(visits.input())->superseded_faces == visits.one());
  }
  SECTION("with voxels of unknown size both stay") {
    visits.map.voxel_m = 0.0;
    CHECK(MeshCorrector(config, limits).correct(visits.input())->superseded_faces == 0);
  }
}

TEST_CASE("Copies stay until a further visit exceeds their share") {
  TwoVisits visits;
  MeshDeformationConfig config{.duplicate_faces = 0};
  CopyLimits limits{.copies = 1};
  limits.share = 1.0;
  MeshCorrector corrector(config, limits);
  CHECK(corrector.correct(visits.input())->mesh.faces.size() == 2 * visits.one());
  const std::size_t one = visits.one();
  visits.add_visit();
  const auto result = corrector.correct(visits.input());
  REQUIRE(result);
  CHECK(result->superseded_faces == 2 * one);
  CHECK(result->mesh.faces.size() == one);
}

std::vector<SE3> random_poses(std::mt19937& rng, std::size_t count) {
  std::vector<SE3> poses;
  for (std::size_t i = 0; i < count; ++i) poses.push_back(random_pose(rng));
  return poses;
}

TEST_CASE("Keyframes without an optimised pose follow odometry from the last that has one") {
  std::mt19937 rng(2);
  const std::vector<SE3> odometry = random_poses(rng, 4);
  const SE3 T_world_odom = random_pose(rng);
  std::vector<SE3> optimised = moved(T_world_odom, odometry);
  const std::vector<SE3> expected = optimised;
  optimised.resize(2);
  const std::vector<SE3> all = complete(odometry, optimised);
  REQUIRE(all.size() == 4);
  for (std::size_t i = 0; i < 4; ++i) CHECK(all[i].isApprox(expected[i], 1e-12));
  CHECK(complete({}, {}).empty());
}

}  // namespace
}  // namespace km
