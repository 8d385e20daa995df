#include <catch2/catch.hpp>

#include <span>
#include <utility>
#include <vector>

#include "modules/surface_ties/chunk_visits.hpp"
#include "modules/surface_ties/rigid_pieces.hpp"
#include "test/modules/surface_ties/visits.hpp"

namespace km {
namespace {

constexpr double kSpacing_m = 0.15;

LabelledMesh patch(float height_m) {
  return wall({0.1F, 0.1F, height_m}, {0.8F, 0, 0}, {0, 0.8F, 0}, 1);
}

// One chunk with two surfaces, 30 cm above each other.
MeshChunk two_surfaces(const SeenBy& lower, const SeenBy& upper) {
  const auto chunks = chunks_of({}, {{patch(0.3F), lower}, {patch(0.6F), upper}});
  REQUIRE(chunks.size() == 1);
  return chunks[0];
}

// Height of all samples of a piece, in the map.
double height_m(const RigidPiece& piece) {
  double sum = 0.0;
  for (const SurfaceSample& sample : piece.samples)
    sum += (piece.keyframe.T_world_kf * sample.point).z();
  return sum / static_cast<double>(piece.samples.size());
}

std::vector<SurfaceSample> samples_of(const MeshChunk& chunk) {
  const MeshChunk* const one = &chunk;
  return sample_plane_patches(assemble_mesh(std::span(&one, 1)), kSpacing_m);
}

RigidPieces pieces_of(const MeshChunk& chunk, bool is_own) {
  RigidPieces pieces(kSpacing_m, kMaxGap);
  if (is_own)
    for (const OdometryPose& keyframe : DriftingRobot().odometry()) pieces.learn(keyframe);
  (void)pieces.add(chunk);
  return pieces;
}

}  // namespace

TEST_CASE("The surfaces of two visits in one chunk are two pieces", "[rigid_pieces]") {
  const RigidPieces pieces = pieces_of(two_surfaces({4, 12}, {100, 108}), true);
  REQUIRE(pieces.boxes().size() == 2);
  const RigidPiece early = pieces.piece(0), late = pieces.piece(5);
  CHECK(early.keyframe.odometry.id == KeyframeId{DriftingRobot::kId, 4});
  CHECK(late.keyframe.odometry.id == KeyframeId{DriftingRobot::kId, 100});
  CHECK(height_m(early) == Approx(0.3).margin(0.001));
  const SE3 T_error = DriftingRobot().error(100);
  CHECK(height_m(late) == Approx((T_error * Eigen::Vector3d(0.5, 0.5, 0.6)).z()).margin(0.005));
  CHECK(early.samples.front().seen_by == SeenBy{4, 12});
  CHECK(late.samples.front().seen_by == SeenBy{100, 108});
}

TEST_CASE("The surface of one visit is one piece", "[rigid_pieces]") {
  const bool is_own = GENERATE(true, false);
  MeshChunk chunk = two_surfaces({14, 20}, {24, 32});  // 4 keyframes apart, at most 15
  chunk.odometry = DriftingRobot().odometry()[middle_keyframe(chunk).index];
  const RigidPieces pieces = pieces_of(chunk, is_own);
  REQUIRE(pieces.boxes().size() == 1);
  const RigidPiece piece = pieces.piece(pieces.boxes().begin()->first);
  CHECK(piece.keyframe.odometry == *chunk.odometry);
  CHECK(piece.samples.size() == samples_of(chunk).size());
}

TEST_CASE("A chunk of another robot contributes the visit of which it states odometry",
          "[rigid_pieces]") {
  MeshChunk chunk = two_surfaces({4, 12}, {100, 108});
  const bool is_early = GENERATE(true, false);
  chunk.odometry = DriftingRobot().odometry()[is_early ? 4 : 100];
  const RigidPieces pieces = pieces_of(chunk, false);
  REQUIRE(pieces.boxes().size() == 1);
  const RigidPiece piece = pieces.piece(is_early ? 0 : 5);
  CHECK(piece.samples.size() == samples_of(split_visits(chunk, kMaxGap)[is_early ? 0 : 1]).size());
}

TEST_CASE("Faces between two visits belong to neither", "[rigid_pieces]") {
  MeshChunk chunk = two_surfaces({4, 12}, {100, 108});
  const std::size_t faces = chunk.faces.size();
  chunk.faces.push_back({chunk.faces.front()[0], chunk.faces.front()[1], chunk.faces.back()[2]});
  const std::vector<MeshChunk> visits = split_visits(chunk, kMaxGap);
  REQUIRE(visits.size() == 2);
  CHECK(visits[0].faces.size() + visits[1].faces.size() == faces);
  CHECK(seen_by(visits[0]) == SeenBy{4, 12});
  CHECK(seen_by(visits[1]) == SeenBy{100, 108});
  for (const MeshChunk& visit : visits) CHECK(fault_of(visit) == nullptr);
}

TEST_CASE("A chunk that is replaced leaves none of its visits", "[rigid_pieces]") {
  MeshChunk chunk = two_surfaces({4, 12}, {100, 108});
  RigidPieces pieces = pieces_of(chunk, true);
  chunk = MeshChunk{.key = chunk.key};
  CHECK(pieces.add(chunk) == std::set<KeyframeIndex>{0, 5});
  CHECK(pieces.boxes().empty());
}

}  // namespace km
