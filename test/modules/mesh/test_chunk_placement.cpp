#include "modules/core/geometry/lie.hpp"
#include "modules/mesh/chunk_placement.hpp"
#include "modules/mesh/mesh_chunks.hpp"
#include "modules/mesh/mesh_poses.hpp"
#include "test/modules/mesh/wavy_sheet.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

constexpr RobotId kRobot = 3;

MeshPoses poses_of(const std::vector<SE3>& T_world_kf) {
  return {.robot = kRobot, .keyframes = mesh_keyframes(T_world_kf)};
}

// Keyframes above the sheet from -2 m to 2 m along x. A vertex is seen by those within 2 of its x.
struct SeenSheet {
  explicit SeenSheet(std::size_t keyframes = 41) : mesh(wavy_sheet(40, 0.1)) {
    for (std::size_t i = 0; i < keyframes; ++i)
      origin.T_world_kf.push_back(make_pose(so3_exp({0.1, 0.0, 0.01 * static_cast<double>(i)}),
                                            {0.1 * static_cast<double>(i) - 2.0, 0.0, 1.5}));
    origin.mapped = mesh.vertices;
    const auto last = static_cast<double>(keyframes - 1);
    for (const auto& vertex : mesh.vertices) {
      const double near = std::round(0.25 * (static_cast<double>(vertex.x()) + 2.0) * last);
      origin.seen_by.push_back({static_cast<KeyframeIndex>(std::clamp(near - 2.0, 0.0, last)),
                                static_cast<KeyframeIndex>(std::clamp(near + 2.0, 0.0, last))});
    }
  }
  [[nodiscard]] std::vector<MeshChunk> chunks() const {
    return split_mesh(mesh, kRobot, 0, {}, &origin).chunks;
  }
  LabelledMesh mesh;
  MeshOrigin origin;
};

// One triangle with vertices on the axes, seen by keyframes 0 and 4, and its views.
MeshChunk seen_triangle(std::array<MeshChunk::View, 2> views) {
  MeshChunk chunk{.key = {.robot = kRobot}};
  chunk.offsets = {{1000, 0, 0}, {0, 1000, 0}, {0, 0, 1000}};
  chunk.faces = {{0, 1, 2}};
  chunk.keyframes = mesh_keyframes(std::vector<SE3>(5, SE3::Identity()));
  chunk.views.assign(3, views);
  return chunk;
}

}  // namespace

TEST_CASE("A rounded pose is within a millimetre and a tenth of a milliradian") {
  const auto i = GENERATE(range(0, 20));
  const SE3 T = make_pose(so3_exp({0.3 * i, -0.1 * i, 2.9 - 0.2 * i}),
                          {0.12345 * i, -1e3 + 0.7777 * i, 1e6 - 0.3333 * i});
  const RoundedPose rounded = RoundedPose::of(T);
  CHECK(rounded.is_valid());
  CHECK((rounded.pose().translation() - T.translation()).cwiseAbs().maxCoeff() < 0.5001e-3);
  CHECK(angle_of(rounded.pose().linear() * T.linear().transpose()) < 1e-4);
  CHECK_THROWS_AS(RoundedPose::of(make_pose(Eigen::Matrix3d::Identity(), {0.0, 3e6, 0.0})),
                  std::invalid_argument);
  CHECK_THROWS_AS(RoundedPose::of(make_pose(Eigen::Matrix3d::Identity(), {0.0, NAN, 0.0})),
                  std::invalid_argument);
}

TEST_CASE("However long a trajectory is, its poses stay within the bound") {
  CHECK(mesh_keyframe_step(0) == 4);
  CHECK(mesh_keyframe_step(4096) == 4);
  CHECK(mesh_keyframe_step(4097) == 8);
  const auto keyframes = GENERATE(1U, 5U, 4096U, 4097U, 100000U);
  const std::size_t count = mesh_keyframes(std::vector<SE3>(keyframes, SE3::Identity())).size();
  CHECK(count <= kMaxMeshKeyframes);
  CHECK(count >= std::min<std::size_t>(kMaxMeshKeyframes / 2, (keyframes + 3) / 4));
}

TEST_CASE("A vertex moves with the mean of its first and its last view") {
  std::vector<SE3> now(5, SE3::Identity());
  now[4] = make_pose(Eigen::Matrix3d::Identity(), {0.0, 0.0, 8.0});
  const MeshPoses poses = poses_of(now);
  const auto height = [&](std::array<MeshChunk::View, 2> views) {
    const MeshChunk chunk = seen_triangle(views);
    REQUIRE_FALSE(fault_of(chunk));
    return place(chunk, &poses).vertices[0].z();
  };
  CHECK(height({0, 0}) == Approx(0.0));
  CHECK(height({0, 1}) == Approx(1.0));  // a quarter of the way to keyframe 4
  CHECK(height({2, 2}) == Approx(4.0));
  CHECK(height({0, 4}) == Approx(4.0));
  CHECK(height({4, 4}) == Approx(8.0));
}

TEST_CASE("A chunk without poses of its keyframes stays as it was sent") {
  const MeshChunk chunk = seen_triangle({0, 4});
  MeshPoses poses =
      poses_of(std::vector<SE3>(5, make_pose(Eigen::Matrix3d::Identity(), {1.0, 1.0, 1.0})));
  CHECK(place(chunk, &poses).vertices[0].x() == Approx(2.0));
  poses.keyframes.pop_back();
  poses.anchor = 7;
  CHECK(place(chunk, &poses).vertices == place(chunk, nullptr).vertices);
  CHECK(place(chunk, &poses).anchor == 0);
  MeshChunk fixed = chunk;
  fixed.keyframes.clear();
  fixed.views.clear();
  CHECK(place(fixed, &poses).vertices == place(fixed, nullptr).vertices);
}

TEST_CASE("A correction moves no face to another chunk") {
  SeenSheet sheet;
  const std::vector<MeshChunk> before = sheet.chunks();
  const SE3 T = make_pose(so3_exp({0.0, 0.0, 0.4}), {1.3, 0.7, 0.0});
  sheet.mesh.transform(T);
  for (SE3& pose : sheet.origin.T_world_kf) pose = T * pose;
  const std::vector<MeshChunk> after = sheet.chunks();
  const MeshPoses poses = poses_of(sheet.origin.T_world_kf);
  REQUIRE(before.size() == after.size());
  REQUIRE(before.size() > 3);
  for (std::size_t i = 0; i < before.size(); ++i) {
    CHECK(before[i].key == after[i].key);
    CHECK(before[i].faces == after[i].faces);
    CHECK_FALSE(differ(before[i], after[i], 0.005, &poses));
    CHECK(differ(before[i], after[i], 0.005));
  }
  SECTION("but surface that moves otherwise is sent") {
    for (auto& vertex : sheet.mesh.vertices) vertex.z() += 0.012F;
    CHECK(differ(before[0], sheet.chunks()[0], 0.005, &poses));
    CHECK_FALSE(differ(before[0], sheet.chunks()[0], 0.016, &poses));
  }
}

TEST_CASE("A chunk of a long visit has fewer keyframes but keeps its views") {
  SeenSheet sheet(4001);
  for (auto& vertex : sheet.mesh.vertices) vertex *= 0.25F;  // one cell
  sheet.origin.mapped = sheet.mesh.vertices;
  std::vector<SE3> bent = sheet.origin.T_world_kf;
  for (std::size_t i = 0; i < bent.size(); ++i)
    bent[i].translation().z() += 1e-3 * static_cast<double>(i);
  const MeshPoses poses = poses_of(bent);
  double highest = 0.0;
  for (const MeshChunk& chunk : sheet.chunks()) {
    REQUIRE_FALSE(fault_of(chunk));
    CHECK(chunk.keyframes.size() <= kMaxChunkKeyframes);
    CHECK(plain_bytes(chunk) <= kMaxChunkBytes);
    const PlacedChunk before = place(chunk, nullptr), after = place(chunk, &poses);
    for (std::size_t v = 0; v < before.vertices.size(); ++v) {
      // The bend is linear in the number of the keyframe, which is linear in x. At most 64
      // keyframes in powers of two of 4001 are 64 apart, in quarters 16. Both views differ by up to
      // that.
      const double keyframe = 1e3 * (4.0 * static_cast<double>(before.vertices[v].x()) + 2.0);
      const auto lift = static_cast<double>(after.vertices[v].z() - before.vertices[v].z());
      CHECK(lift == Approx(1e-3 * keyframe).margin(0.04));
      highest = std::max(highest, lift);
    }
  }
  CHECK(highest > 3.9);
}

TEST_CASE("Surfaces that were mapped at one place and belong far apart are sent apart") {
  SeenSheet sheet;
  const std::size_t vertices = sheet.mesh.vertices.size();
  LabelledMesh far = sheet.mesh;
  for (auto& vertex : far.vertices) vertex.x() += 100.0F;
  sheet.mesh.append(far);
  for (std::size_t v = 0; v < vertices; ++v) {
    sheet.origin.mapped.emplace_back(sheet.origin.mapped[v]);
    sheet.origin.seen_by.emplace_back(sheet.origin.seen_by[v]);
  }
  std::size_t faces = 0;
  for (const MeshChunk& chunk : sheet.chunks()) {
    faces += chunk.faces.size();
    const PlacedChunk placed = place(chunk, nullptr);
    const auto [low, high] =
        std::ranges::minmax(placed.vertices, {}, [](const auto& p) { return p.x(); });
    CHECK(high.x() - low.x() < 66.0F);
  }
  CHECK(faces == sheet.mesh.faces.size());
}

TEST_CASE("Poses are sent again if they move surface or have other keyframes") {
  std::vector<SE3> trajectory(9, SE3::Identity());
  const MeshPoses before = poses_of(trajectory);
  CHECK_FALSE(has_moved(before, poses_of(trajectory), 0.0));
  SECTION("a shift") {
    trajectory[4].translation().x() = 0.007;
    CHECK(has_moved(before, poses_of(trajectory), 0.005));
    CHECK_FALSE(has_moved(before, poses_of(trajectory), 0.010));
  }
  SECTION("a turn moves surface at the range of depth") {
    trajectory[4].linear() = so3_exp({0.0, 0.002, 0.0});
    CHECK(has_moved(before, poses_of(trajectory), 0.005));
    CHECK_FALSE(has_moved(before, poses_of(trajectory), 0.015));
  }
  SECTION("another keyframe") {
    trajectory.resize(13, SE3::Identity());
    CHECK(has_moved(before, poses_of(trajectory), 1.0));
  }
  SECTION("another frame") {
    MeshPoses after = before;
    after.anchor = 5;
    CHECK(has_moved(before, after, 1.0));
  }
}

}  // namespace km
