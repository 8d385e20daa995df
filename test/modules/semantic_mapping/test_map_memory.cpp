#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <opencv2/core/utility.hpp>
#include <set>

#include "test/modules/semantic_mapping/mesh_checks.hpp"
#include "test/modules/semantic_mapping/wall_scene.hpp"

namespace km {
namespace {

TEST_CASE("A frame seen again keeps every vertex and its first keyframe", "[semantic_mapping]") {
  SemanticMapper mapper(settings(0.05), small_camera(), two_classes());
  REQUIRE(integrate(mapper, wall(2.51, true), at(0), 4));
  CHECK(mapper.update_mesh().vertices_added > 500);
  const MapMesh before = mapper.mesh();
  CHECK(mapper.update_mesh().blocks == 0);
  REQUIRE(integrate(mapper, wall(2.51, true), at(0), 7));
  const MeshUpdateReport report = mapper.update_mesh();
  CHECK(report.vertices_added == 0);
  CHECK(report.vertices_removed == 0);
  const MapMesh after = mapper.mesh();
  CHECK(after.ids == before.ids);
  CHECK(after.mesh.labels == before.mesh.labels);
  CHECK(after.mesh.faces.size() == before.mesh.faces.size());
  const float silhouette = 0.4F / std::sqrt(1.5F * 1.5F - 0.4F * 0.4F);  // of the ball, at z = 1
  for (std::size_t i = 0; i < after.ids.size(); ++i) {
    CHECK(before.seen_by[i] == std::array<KeyframeIndex, 2>{4, 4});
    CHECK(after.seen_by[i][0] == 4);
    CHECK((after.seen_by[i][1] == 4 || after.seen_by[i][1] == 7));
    // At the ball's rim the surface runs along the line of sight.
    const Eigen::Vector3f& p = after.mesh.vertices[i];
    const bool at_rim = std::abs(p.head<2>().norm() / p.z() - silhouette) < 0.025F;
    CHECK((after.seen_by[i][1] == 7 || at_rim));
    CHECK((after.mesh.vertices[i] - before.mesh.vertices[i]).norm() < 1e-5F);
  }
}

TEST_CASE("What left the window is final, and a revisit makes vertices of its own",
          "[semantic_mapping]") {
  SemanticMappingConfig config = settings();
  config.window_m = 5.0;
  SemanticMapper mapper(config, small_camera(), two_classes());
  for (KeyframeIndex i = 0; i < 3; ++i) REQUIRE(integrate(mapper, wall(2.03), at(0), i));
  mapper.update_mesh();
  const MapMesh first = mapper.mesh();
  std::size_t finalised = 0;
  for (KeyframeIndex i = 3; i < 10; ++i) {
    const DepthAndLabels images = wall(2.03);
    finalised += mapper.integrate(images.depth, &images.labels, at(20), i).blocks_finalised;
  }
  CHECK(finalised > 0);
  for (KeyframeIndex i = 10; i < 12; ++i) REQUIRE(integrate(mapper, wall(2.08), at(0), i));
  mapper.update_mesh();
  const MapMesh last = mapper.mesh();
  CHECK(mapper.size().final_faces == 2 * first.mesh.faces.size());  // here, and 20 m away
  REQUIRE(std::includes(last.ids.begin(), last.ids.end(), first.ids.begin(), first.ids.end()));
  std::size_t anew = 0;
  for (std::size_t i = 0, old = 0; i < last.ids.size(); ++i) {
    if (old < first.ids.size() && last.ids[i] == first.ids[old]) {
      CHECK(last.seen_by[i] == first.seen_by[old]);
      CHECK(last.mesh.vertices[i] == first.mesh.vertices[old]);
      CHECK(last.mesh.labels[i] == first.mesh.labels[old++]);
    } else if (last.mesh.vertices[i].x() < 5.0F) {
      ++anew;
      CHECK(last.seen_by[i][0] >= 10);
      CHECK(last.mesh.vertices[i].z() == Approx(2.08F).margin(1e-3));
    }
  }
  CHECK(anew > 100);
}

// Along a wall with a window shorter than the way: rim edges away from the wall's own border.
TEST_CASE("Mesh that became final on the way has no cracks", "[semantic_mapping]") {
  SemanticMappingConfig config = settings();
  config.window_m = 0.6;
  const KeyframeIndex meshed_every = GENERATE(1U, 7U, 100U);
  CAPTURE(meshed_every);
  SemanticMapper mapper(config, small_camera(), two_classes());
  for (KeyframeIndex i = 0; i < 60; ++i) {
    const SE3 T_odom_cam = at(0.15 * i, 0.02 * i);
    REQUIRE(integrate(mapper, wall(2.03, false, T_odom_cam), T_odom_cam, i));
    if (i % meshed_every == 0) mapper.update_mesh();
  }
  mapper.update_mesh();
  const MapSize size = mapper.size();
  CHECK(size.final_faces > size.faces / 2);
  const LabelledMesh mesh = mapper.mesh().mesh;
  std::size_t cracks = 0;
  for (const auto& [a, b] : rim_of(mesh)) {
    const Eigen::Vector3f p = 0.5F * (mesh.vertices[a] + mesh.vertices[b]);
    const float middle = p.x() * 0.02F / 0.15F;  // height of the camera when it was there
    if (p.x() > -0.8F && p.x() < 9.6F && std::abs(p.y() - middle) < 0.6F) ++cracks;
  }
  CHECK(cracks == 0);
}

TEST_CASE("Blocks never exceed their bound, and their mesh is not lost", "[semantic_mapping]") {
  SemanticMappingConfig config = settings();
  config.max_blocks = 64;
  SemanticMapper mapper(config, small_camera(), two_classes());
  std::size_t finalised = 0, refused = 0;
  for (KeyframeIndex i = 0; i < 80; ++i) {
    const SE3 T_odom_cam = at(0.25 * i);
    const DepthAndLabels images = wall(2.03, false, T_odom_cam);
    const IntegrationReport report = mapper.integrate(images.depth, &images.labels, T_odom_cam, i);
    finalised += report.blocks_finalised;
    refused += report.blocks_refused;
    CHECK(mapper.size().blocks <= 64);
  }
  CHECK(finalised > 0);
  CHECK(refused == 0);
  mapper.update_mesh();
  // 20 m of wall, 1.8 m high.
  std::set<int> columns;
  for (const Eigen::Vector3f& p : mapper.mesh().mesh.vertices)
    columns.insert(static_cast<int>(std::floor(p.x() + 0.5F)));
  for (int x = 0; x < 20; ++x) CHECK(columns.contains(x));

  // A frame that alone needs more: counted, within the bound.
  config.voxel_size_m = 0.02;
  SemanticMapper full(config, small_camera(), two_classes());
  CHECK(full.integrate(wall(2.03).depth, nullptr, at(0), 0).blocks_refused > 0);
  CHECK(full.size().blocks == 64);
}

TEST_CASE("Two threads give the same mesh as one, bit by bit", "[semantic_mapping]") {
  const auto map_with = [](int threads) {
    cv::setNumThreads(threads);
    SemanticMapper mapper(settings(), small_camera(), BoxRoom::palette());
    for (int i = 0; i < 10; ++i) {
      const SE3 T_room_cam = BoxRoom::T_room_cam(3 * i);
      REQUIRE(integrate(mapper, render(small_camera(), T_room_cam, cast_room), T_room_cam,
                        static_cast<KeyframeIndex>(i)));
      mapper.update_mesh();
    }
    return mapper.mesh();
  };
  const MapMesh one = map_with(1), two = map_with(2);
  cv::setNumThreads(-1);
  CHECK(one.ids == two.ids);
  CHECK(one.seen_by == two.seen_by);
  CHECK(one.mesh.vertices == two.mesh.vertices);
  CHECK(one.mesh.labels == two.mesh.labels);
  CHECK(one.mesh.faces == two.mesh.faces);
}

}  // namespace
}  // namespace km
