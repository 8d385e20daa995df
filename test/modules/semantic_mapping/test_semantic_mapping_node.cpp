#include "modules/semantic_mapping/node/semantic_mapping_node.hpp"
#include "test/modules/semantic_mapping/wall_scene.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

constexpr Stamp kPeriod = 200'000'000;  // 5 Hz

struct Bench {
  Topic<DenseFrame> frames;
  Topic<SupersededSurface> superseded;
  Topic<MapMesh> maps;
  Topic<MappingProgress> progress;
  std::vector<std::shared_ptr<const MapMesh>> meshes;
  MappingProgress last;
  std::unique_ptr<SemanticMappingNode> node;

  Bench() {
    maps.subscribe([this](const auto& message) { meshes.push_back(message); });
    progress.subscribe([this](const auto& message) { last = *message; });
    node = std::make_unique<SemanticMappingNode>(
        settings(), small_camera(), two_classes(), 3.0, Overflow::kBlock,
        SemanticMappingTopics{
            .frames = frames, .superseded = superseded, .maps = maps, .progress = progress});
  }
};

DenseFrame frame(int i) {
  static const DepthAndLabels images = wall(2.03, true);
  static const auto depth = std::make_shared<const DepthImage>(images.depth);
  static const auto labels = std::make_shared<const LabelImage>(images.labels);
  return {i * kPeriod, depth, labels, at(0), static_cast<KeyframeIndex>(i / 2)};
}

TEST_CASE("A mesh is published every few seconds and at the end and is coloured by its labels") {
  Bench bench;
  for (int i = 0; i < 35; ++i) bench.node->step(frame(i));
  CHECK(bench.meshes.size() == 2);  // at 3 s and 6 s
  bench.node->stop();
  bench.node->stop();
  REQUIRE(bench.meshes.size() == 3);
  const MapMesh& map = *bench.meshes.back();
  REQUIRE(map.mesh.vertices.size() > 100);
  CHECK(map.mesh.faces.size() == bench.last.size.faces);
  CHECK(std::count(map.mesh.labels.begin(), map.mesh.labels.end(), LabelId{2}) > 50);  // the ball
  const LabelPalette palette = two_classes();
  CHECK(map.seen_by.size() == map.mesh.vertices.size());
  REQUIRE(map.mesh.colors.size() == map.mesh.vertices.size());
  for (std::size_t i = 0; i < map.mesh.vertices.size(); ++i) {
    const LabelClass* label = palette.find(map.mesh.labels[i]);
    CHECK(map.mesh.colors[i] == (label != nullptr ? label->color : LabelledMesh::Color{}));
  }
  CHECK(bench.last.integrated == 35);
  CHECK(bench.last.unlabelled == 0);
}

TEST_CASE("Unusable frames are counted by reason") {
  Bench bench;
  DenseFrame unlabelled = frame(0);
  unlabelled.labels = nullptr;
  bench.node->step(unlabelled);
  DenseFrame small = frame(1);
  small.depth = std::make_shared<const DepthImage>(DepthImage{2, 2, {1, 1, 1, 1}});
  bench.node->step(small);
  DenseFrame lost = frame(2);
  lost.T_odom_cam.translation().x() = std::numeric_limits<double>::quiet_NaN();
  bench.node->step(lost);
  DenseFrame strange = frame(3);
  strange.labels = std::make_shared<const LabelImage>(
      LabelImage{160, 120, std::vector<std::uint8_t>(160 * 120, 99)});
  bench.node->step(strange);
  CHECK(bench.last.integrated == 2);
  CHECK(bench.last.unlabelled == 1);
  CHECK(bench.last.wrong_size == 1);
  CHECK(bench.last.bad_pose == 1);
  CHECK(bench.last.off_palette_pixels == 160 * 120);
}

TEST_CASE("Superseded surface is dropped with the next frame") {
  Bench bench;
  const auto step = [&](int i, double x) {
    DenseFrame next = frame(i);
    next.T_odom_cam = at(x);
    bench.node->step(next);
  };
  for (int i = 0; i < 16; ++i) step(i, 0.0);
  REQUIRE(bench.meshes.size() == 1);
  const MapMesh first = *bench.meshes.front();
  for (int i = 16; i < 20; ++i) step(i, 20.0);  // out of the window
  for (int i = 20; i < 24; ++i) step(i, 0.0);
  for (int i = 24; i < 40; ++i) step(i, 20.0);
  const MapMesh& twice = *bench.meshes.back();
  const std::size_t faces = bench.last.size.faces;
  REQUIRE(bench.last.size.final_faces >= 2 * first.mesh.faces.size());
  // Both visits see it from the same pose, so their vertices are in the same order.
  SupersededSurface superseded;
  std::vector<std::uint64_t> again;
  for (std::size_t v = 0; v < twice.ids.size(); ++v)
    if (twice.seen_by[v][0] >= 10 && twice.mesh.vertices[v].x() < 5.0F)
      again.push_back(twice.ids[v]);
  REQUIRE(again.size() == first.ids.size());
  for (std::size_t v = 0; v < again.size(); ++v)
    superseded.vertices.push_back({first.ids[v], again[v]});
  bench.superseded.publish(SupersededSurface{});  // the newest counts
  bench.superseded.publish(superseded);
  CHECK(bench.last.size.dropped_faces == 0);
  step(40, 20.0);
  CHECK(bench.last.size.dropped_faces == first.mesh.faces.size());
  CHECK(bench.last.size.faces == faces - first.mesh.faces.size());
}

}  // namespace
}  // namespace km
