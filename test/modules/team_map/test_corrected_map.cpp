#include "modules/mesh/node/mesh_chunks_node.hpp"
#include "modules/mesh/team_mesh.hpp"
#include "modules/mesh_deformation/mesh_corrector.hpp"
#include "test/modules/mesh_deformation/corridor.hpp"
#include "test/support/inbox.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

constexpr RobotId kMapper = 2;

// A floor of 20 m by 2 m, with vertices 10 cm and keyframes 20 cm apart.
constexpr SheetSize kFloor{.columns = 200, .rows = 20, .step_m = 0.1, .keyframe_step_m = 0.2};

// The mesh of a robot, corrected and offered to the others whenever its trajectory has changed.
struct CorrectedRobot {
  CorrectedRobot() { correct(); }
  void correct() {
    std::optional<MeshCorrection> correction =
        corrector.correct({map, map_version, T_odom_kf, T_world_kf});
    REQUIRE(correction);
    mesh = std::make_shared<const LabelledMesh>(correction->mesh);
    sender.step({kMapper, mesh, std::make_shared<const MeshOrigin>(correction->origin)},
                now_s += 100.0);
    REQUIRE(sender.waiting() == 0);
  }
  [[nodiscard]] std::size_t chunk_bytes() {
    std::size_t bytes = 0;
    for (const MeshChunk& chunk : chunks.messages())
      bytes += plain_bytes(chunk);  // a floor packs to little
    return bytes;
  }
  [[nodiscard]] std::size_t poses_bytes() {
    std::size_t bytes = 0;
    for (const MeshPoses& newest : poses.messages()) bytes += wire_bytes(newest);
    return bytes;
  }

  static MapSharingConfig unlimited() {
    MapSharingConfig config{.max_bytes_per_s = 1e9};
    return config;
  }

  MapMesh map = sheet(kFloor);
  std::uint64_t map_version = 1;
  std::vector<SE3> T_odom_kf = keyframes_above(kFloor), T_world_kf = T_odom_kf;
  MeshCorrector corrector{MeshDeformationConfig()};
  Topic<MeshChunk> chunk_topic;
  Topic<MeshPoses> poses_topic;
  Inbox<MeshChunk> chunks{chunk_topic};
  Inbox<MeshPoses> poses{poses_topic};
  MeshChunksNode sender{unlimited(), kMapper, {chunk_topic, poses_topic}};
  std::shared_ptr<const LabelledMesh> mesh;
  double now_s = 0.0;
};

using Message = std::variant<MeshChunk, MeshPoses>;

// The messages that a receiver with transient-local history gets: the newest chunk of each key, and
// the newest poses.
std::vector<Message> newest_of(CorrectedRobot& robot) {
  std::map<MeshChunkKey, MeshChunk> chunks;
  for (const MeshChunk& chunk : robot.chunks.messages()) chunks.insert_or_assign(chunk.key, chunk);
  std::vector<Message> newest{robot.poses.messages().back()};
  for (const auto& [key, chunk] : chunks) newest.emplace_back(chunk);
  return newest;
}

TeamMesh received(const std::vector<Message>& messages) {
  TeamMesh team;
  for (const Message& message : messages)
    CHECK(std::visit([&](const auto& m) { return team.add(m); }, message) == ChunkVerdict::kTaken);
  return team;
}

// Largest distance of a vertex of the mesh from the nearest one that the receiver has [m].
double error_m(const LabelledMesh& mesh, const TeamMesh& team) {
  const std::vector<PlacedChunk> placed = team.placed();
  double largest = 0.0;
  for (const Eigen::Vector3f& vertex : mesh.vertices) {
    float nearest = 1e9F;
    for (const PlacedChunk& chunk : placed)
      for (const Eigen::Vector3f& p : chunk.vertices)
        nearest = std::min(nearest, (p - vertex).squaredNorm());
    largest = std::max(largest, std::sqrt(static_cast<double>(nearest)));
  }
  return largest;
}

}  // namespace

TEST_CASE("A correction of the trajectory costs poses, and the receiver's mesh follows") {
  CorrectedRobot robot;
  const std::size_t chunk_bytes = robot.chunk_bytes(), poses_bytes = robot.poses_bytes();
  const double radius_m = GENERATE(200.0, 50.0);  // ends move by 1 m and 4 m
  robot.T_world_kf = bent(robot.T_odom_kf, radius_m);
  robot.correct();
  CHECK(robot.chunk_bytes() == chunk_bytes);
  CHECK(robot.poses_bytes() == 2 * poses_bytes);
  CHECK(50 * poses_bytes < chunk_bytes);
  // min_move_m and the rounding of poses along each of two axes, as differ() permits.
  CHECK(error_m(*robot.mesh, received(newest_of(robot))) < 0.012 * 1.4143);
  double highest_m = 0.0;
  for (const Eigen::Vector3f& p : robot.mesh->vertices)
    highest_m = std::max(highest_m, static_cast<double>(p.z()));
  CHECK(highest_m > 0.9);
}

}  // namespace km
