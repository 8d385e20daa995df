#include <catch2/catch.hpp>

#include "apps/team/team_meshes.hpp"
#include "modules/mesh/ply_file.hpp"
#include "test/support/temporary_folder.hpp"

namespace km {
namespace {

// Three walls of 3 m that meet in the origin, of classes 1, 2, 3; seen from inside.
LabelledMesh corner() {
  LabelledMesh mesh;
  for (int axis = 0; axis < 3; ++axis) {
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    for (const auto& [u, v] : {std::pair(0.0F, 0.0F), {3.0F, 0.0F}, {3.0F, 3.0F}, {0.0F, 3.0F}}) {
      Eigen::Vector3f p = Eigen::Vector3f::Zero();
      p[(axis + 1) % 3] = u;
      p[(axis + 2) % 3] = v;
      mesh.vertices.push_back(p);
      mesh.labels.push_back(static_cast<LabelId>(axis + 1));
    }
    mesh.faces.push_back({first, first + 1, first + 2});
    mesh.faces.push_back({first, first + 2, first + 3});
  }
  return mesh;
}

LabelledMesh moved(LabelledMesh mesh, const Eigen::Vector3d& by) {
  mesh.transform(make_pose(Eigen::Matrix3d::Identity(), by));
  return mesh;
}

// Robots a and b in a world whose frame is moved against the team's.
struct Team {
  TemporaryFolder folder;
  TeamPlan plan;
  std::vector<std::string> notes;
  const Eigen::Vector3d shift = {0.2, -0.1, 0.1};  // of the team's frame

  Team() {
    plan.output = folder.path();
    for (const char* name : {"a", "b"}) {
      std::filesystem::create_directories(folder.path() / name);
      plan.robots.push_back({});
      plan.robots.back().name = name;
    }
    plan.truth_mesh = folder.path() / "world.ply";
    write_ply(plan.truth_mesh, corner());
  }
  void leave(const char* robot, const char* file, const LabelledMesh& mesh) const {
    write_ply(plan.output / robot / file, moved(mesh, -shift));
  }
  TeamMeshes collect() {
    return collect_meshes(plan, make_pose(Eigen::Matrix3d::Identity(), shift), notes);
  }
};

TEST_CASE("Meshes are compared with the true one, before and after their correction", "[team]") {
  Team team;
  LabelledMesh mislabelled = moved(corner(), {0.1, 0.1, 0.1});
  mislabelled.labels.assign(mislabelled.labels.size(), 2);
  team.leave("a", "mesh.ply", corner());
  team.leave("b", "mesh.ply", mislabelled);
  team.leave("a", "mesh_optimized.ply", corner());
  team.leave("b", "mesh_optimized.ply", corner());
  const TeamMeshes meshes = team.collect();
  CHECK(team.notes.empty());
  REQUIRE(meshes.odometry.has_value());
  REQUIRE(meshes.optimized.has_value());
  REQUIRE(meshes.odometry->robots.size() == 2);
  constexpr double kSampling_m = 0.02;  // points 3 cm apart
  CHECK(meshes.optimized->merged.truth.point.mean_m < kSampling_m);
  // One transform for both: whatever it is, two meshes 17 cm apart cannot both fit.
  CHECK(meshes.odometry->robots[0].truth.point.mean_m +
            meshes.odometry->robots[1].truth.point.mean_m >
        0.05);
  CHECK(meshes.optimized->robots[1].truth.labels.total().accuracy() > 0.97);
  CHECK(meshes.odometry->robots[1].truth.labels.total().accuracy() < 0.4);
  CHECK(meshes.merged.faces.size() == 2 * corner().faces.size());
  for (std::size_t i = 0; i < corner().vertices.size(); ++i)  // as floats
    CHECK((meshes.merged.vertices[i] - corner().vertices[i]).norm() < 1e-5F);

  const std::string table = to_table(meshes);
  CAPTURE(table);
  CHECK(std::count(table.begin(), table.end(), '\n') == 7);
  for (const char* part : {"odometry: error [m]", "\na ", "\nb ", "\nteam, one frame"})
    CHECK_THAT(table, Catch::Contains(part));
}

TEST_CASE("What meshes are missing is noted, the others are compared", "[team]") {
  Team team;
  team.leave("a", "mesh.ply", corner());
  team.leave("a", "mesh_optimized.ply", corner());
  team.leave("b", "mesh.ply", corner());
  const TeamMeshes meshes = team.collect();
  REQUIRE(team.notes.size() == 1);
  CHECK(team.notes[0] == "b left a mesh, but none corrected");
  REQUIRE(meshes.optimized.has_value());
  CHECK(meshes.optimized->robots.size() == 1);
  CHECK_THAT(to_table(meshes), Catch::Contains("\nb ") && Catch::Contains(" - "));
}

TEST_CASE("Without maps there is no table and no note", "[team]") {
  Team team;
  const TeamMeshes meshes = team.collect();
  CHECK(team.notes.empty());
  CHECK(meshes.merged.empty());
  CHECK(to_table(meshes).empty());
}

TEST_CASE("Meshes without a true one are merged, and broken ones named", "[team]") {
  Team team;
  team.plan.truth_mesh.clear();
  team.leave("a", "mesh_optimized.ply", corner());
  team.folder.write("b/mesh_optimized.ply", "ply, or not");
  const TeamMeshes meshes = team.collect();
  CHECK(meshes.merged.faces.size() == corner().faces.size());
  CHECK_FALSE(meshes.optimized.has_value());
  REQUIRE(team.notes.size() == 1);
  CHECK_THAT(team.notes[0], Catch::Contains("b/mesh_optimized.ply"));
}

}  // namespace
}  // namespace km
