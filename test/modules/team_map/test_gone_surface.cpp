#include <algorithm>
#include <catch2/catch.hpp>
#include <limits>
#include <random>
#include <variant>
#include <vector>

#include "modules/mesh/gone_surface.hpp"
#include "modules/mesh/team_mesh.hpp"
#include "modules/team_map/team_map.hpp"
#include "test/modules/semantic_mapping/wall_scene.hpp"

namespace km {
namespace {

constexpr RobotId kOwner = 1, kWitness = 2;
constexpr double kSide_m = 0.1;
constexpr float kFront_m = 2.0F, kBack_m = 4.0F;

// A square of 2 m in the plane at z, seen from lower z.
LabelledMesh square_at(float z, float low_x = -1.0F) {
  LabelledMesh mesh;
  constexpr std::uint32_t kCells = 20;
  for (std::uint32_t i = 0; i <= kCells; ++i)
    for (std::uint32_t j = 0; j <= kCells; ++j)
      mesh.vertices.emplace_back(low_x + 0.1F * static_cast<float>(i) + 0.03F,
                                 -0.97F + 0.1F * static_cast<float>(j), z);
  for (std::uint32_t i = 0; i < kCells; ++i)
    for (std::uint32_t j = 0; j < kCells; ++j) {
      const std::uint32_t a = i * (kCells + 1) + j, b = a + kCells + 1;
      mesh.faces.push_back({a, b + 1, b});
      mesh.faces.push_back({a, a + 1, b + 1});
    }
  return mesh;
}

// Surface of robot kOwner: two squares behind each other.
std::vector<MeshChunk> two_squares() {
  LabelledMesh mesh = square_at(kFront_m);
  mesh.append(square_at(kBack_m));
  return split_mesh(mesh, kOwner, 0, {}).chunks;
}

// Views of robot kWitness of a wall, beginning with keyframe `first`. Half of them are 0.35 m to
// the right.
OwnViews views_of_wall(int count, double wall_m, KeyframeIndex first = 0) {
  CoarseViews views(small_camera(), {}, 0.3);
  OwnViews own;
  own.T_world_odom.assign(first, SE3::Identity());
  for (int i = 0; i < count; ++i) {
    const SE3 T = at(i % 2 == 0 ? 0.0 : 0.35);
    views.add(wall(wall_m, false, T).depth, T, first + static_cast<KeyframeIndex>(i));
    own.T_world_odom.push_back(SE3::Identity());
  }
  own.covariances.assign(own.T_world_odom.size(), Matrix6::Zero());
  own.views = views.views();
  return own;
}

struct Witness {
  explicit Witness(KeyframeIndex newest_view) {
    for (const MeshChunk& chunk : two_squares()) {
      REQUIRE(team.add(chunk) == ChunkVerdict::kTaken);
      arrivals.take(chunk);
    }
    arrivals.set_newest_view(newest_view);
  }
  [[nodiscard]] GoneSurface gone(const OwnViews& own) const {
    const std::vector<PlacedChunk> placed = team.placed();
    std::vector<TestedChunk> tested;
    for (const PlacedChunk& chunk : placed)
      tested.push_back({&chunk, arrivals.of(chunk.chunk->key)});
    GoneSurface gone = find_gone(own, tested, 3, kSide_m);
    gone.robot = kWitness;
    return gone;
  }
  TeamMesh team;
  SurfaceArrivals arrivals;
};

// Vertices near the plane at z which all views have in view with a margin.
std::size_t vertices_at(const LabelledMesh& mesh, float z) {
  return static_cast<std::size_t>(
      std::ranges::count_if(mesh.vertices, [&](const Eigen::Vector3f& p) {
        return std::abs(p.z() - z) < 0.3F && p.head<2>().cwiseAbs().maxCoeff() < 0.6F;
      }));
}

}  // namespace

TEST_CASE("Surface that another robot sees through goes from the fused mesh of all", "[team_map]") {
  const GoneSurface gone = Witness(0).gone(views_of_wall(6, kBack_m));
  CHECK(fault_of(gone) == nullptr);
  CHECK(gone.blocks.size() < 20);  // 1.6 kB for 4 m^2
  std::vector<std::variant<MeshChunk, GoneSurface>> messages{gone};
  for (const MeshChunk& chunk : two_squares()) messages.emplace_back(chunk);
  std::vector<LabelledMesh> maps;
  std::mt19937 rng(1);
  for (int receiver = 0; receiver < 3; ++receiver) {
    std::shuffle(messages.begin(), messages.end(), rng);
    TeamMesh team;
    for (const auto& message : messages)
      CHECK(std::visit([&](const auto& m) { return team.add(m); }, message) ==
            ChunkVerdict::kTaken);
    maps.push_back(fuse_chunks(team.placed(), kSide_m).mesh);
  }
  CHECK(vertices_at(maps[0], kFront_m) == 0);
  CHECK(vertices_at(maps[0], kBack_m) > 100);
  for (const LabelledMesh& map : maps) {
    CHECK(map.vertices == maps[0].vertices);
    CHECK(map.faces == maps[0].faces);
  }
}

TEST_CASE("Only views after the arrival of a surface remove it", "[team_map]") {
  const OwnViews own = views_of_wall(6, kBack_m);  // keyframes 0 to 5
  CHECK(Witness(2).gone(own).blocks == Witness(0).gone(own).blocks);
  CHECK(Witness(3).gone(own).blocks.empty());
  CHECK(Witness(SurfaceArrivals::kPending).gone(own).blocks.empty());
}

TEST_CASE("Surface of another robot stays where own views show surface", "[team_map]") {
  CHECK(Witness(0).gone(views_of_wall(6, kFront_m)).blocks.empty());
  CHECK(Witness(0).gone(views_of_wall(6, 1.0)).blocks.empty());  // hidden
}

TEST_CASE("Uncertain poses remove no surface of other robots", "[team_map]") {
  OwnViews own = views_of_wall(6, kBack_m);
  for (Matrix6& Sigma : own.covariances) Sigma(5, 5) = 0.25;  // 3 sqrt(2) 0.5 m exceed the distance
  CHECK(Witness(0).gone(own).blocks.empty());
  own.covariances.clear();  // unknown
  CHECK(Witness(0).gone(own).blocks.empty());
}

TEST_CASE("A vertex keeps its arrival while its chunk is sent again", "[team_map]") {
  const MeshChunk first = split_mesh(square_at(kFront_m), kOwner, 0, {.cell_m = 20.0}).chunks.at(0);
  LabelledMesh grown = square_at(kFront_m);
  grown.append(square_at(kFront_m, 1.5F));
  const MeshChunk second = split_mesh(grown, kOwner, 0, {.cell_m = 20.0}).chunks.at(0);
  REQUIRE(first.key == second.key);
  SurfaceArrivals arrivals;
  arrivals.take(first);
  arrivals.set_newest_view(7);
  arrivals.take(second);
  const auto count = [&](KeyframeIndex keyframe) {
    return static_cast<std::size_t>(std::ranges::count(arrivals.of(second.key), keyframe));
  };
  CHECK(count(7) == first.offsets.size());
  CHECK(count(SurfaceArrivals::kPending) == second.offsets.size() - first.offsets.size());
  MeshChunk restarted = second;
  restarted.boot = 9;
  arrivals.take(restarted);
  CHECK(count(7) == 0);
}

TEST_CASE("Gone surface of another frame, or of another robot, removes nothing", "[team_map]") {
  GoneSurface gone = Witness(0).gone(views_of_wall(6, kBack_m));
  const bool other_frame = GENERATE(false, true);
  if (other_frame) {
    gone.anchor = 1;
  } else {
    for (GoneBlock& block : gone.blocks) block.owner = 5;
  }
  Witness robot(0);
  REQUIRE(robot.team.add(gone) == ChunkVerdict::kTaken);
  CHECK(vertices_at(fuse_chunks(robot.team.placed(), kSide_m).mesh, kFront_m) > 100);
}

TEST_CASE("Faulty gone surface is found", "[team_map]") {
  GoneSurface gone{.blocks = {{.owner = 1, .block = {0, 0, 0}}, {.owner = 1, .block = {0, 0, 1}}}};
  CHECK(fault_of(gone) == nullptr);
  SECTION("blocks twice") {
    gone.blocks[1] = gone.blocks[0];
  }
  SECTION("blocks in another order") {
    std::swap(gone.blocks[0], gone.blocks[1]);
  }
  SECTION("cells of no size") {
    gone.cell_m = std::numeric_limits<float>::quiet_NaN();
  }
  CHECK(fault_of(gone) != nullptr);
}

}  // namespace km
