#include "modules/objects/object_extraction.hpp"
#include "test/modules/objects/box_mesh.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

constexpr RobotId kRobot = 3;

ObjectLabels chairs_and_tables() {
  return ObjectLabels().set(kChair).set(kTable);
}

std::vector<MapObject> objects_in(const TestMap& map, const ObjectsConfig& config = {}) {
  return extract_objects(map.mesh, map.seen_by, kRobot, chairs_and_tables(), config);
}

TEST_CASE("Two boxes on a floor are two objects with their boxes, surfaces and views") {
  TestMap map;
  map.add_sheet({-5, -5, 0}, {10, 0, 0}, {0, 10, 0}, kGround, {0, 20});
  const ObjectBox chair{{1.0, 2.0, 0.5}, 0.3, {0.8, 0.5, 1.0}};
  const ObjectBox table{{-2.0, 0.0, 0.4}, -1.2, {2.0, 1.0, 0.8}};
  map.add_box(table, kTable, {8, 11});
  map.add_box(chair, kChair, {3, 5});
  const auto objects = objects_in(map);
  REQUIRE(objects.size() == 2);
  CHECK(objects[0].label == kChair);
  CHECK(intersection_over_union(objects[0].box, chair) > 0.99);
  CHECK(objects[0].surface_m2 == Approx(2.0 * (0.8 + 0.5) * 1.0 + 0.8 * 0.5).epsilon(1e-3));
  CHECK(objects[0].views == 3);
  CHECK(objects[0].keyframe == KeyframeId{kRobot, 5});
  CHECK(objects[0].robots == std::vector<RobotId>{kRobot});
  CHECK(objects[1].label == kTable);
  CHECK(intersection_over_union(objects[1].box, table) > 0.99);
  CHECK(objects[1].views == 4);
}

TEST_CASE("A thin gap does not cut an object, and two close chairs stay two") {
  const double gap_m = GENERATE(0.1, 0.3);
  TestMap map;
  map.add_box({{0.0, 0.0, 0.5}, 0.0, {0.6, 0.5, 1.0}}, kChair);
  map.add_box({{0.6 + gap_m, 0.0, 0.5}, 0.0, {0.6, 0.5, 1.0}}, kChair);
  const auto objects = objects_in(map);
  if (gap_m < ObjectsConfig().gap_m) {
    REQUIRE(objects.size() == 1);
    CHECK(objects[0].box.size_m.x() == Approx(1.2 + gap_m).margin(1e-3));
  } else {
    CHECK(objects.size() == 2);
  }
}

TEST_CASE("Small or hardly seen surfaces are no objects") {
  TestMap map;
  map.add_sheet({0, 0, 1}, {0.2, 0, 0}, {0, 0.2, 0}, kChair, {0, 9});  // 0.04 m^2
  map.add_box({{5.0, 0.0, 0.5}, 0.0, {1.0, 1.0, 1.0}}, kTable, {4, 4});
  CHECK(objects_in(map).empty());
  ObjectsConfig all{.min_surface_m2 = 0.0, .min_views = 1};
  CHECK(objects_in(map, all).size() == 2);
}

TEST_CASE("Objects are the connected parts that a search over all pairs finds") {
  const auto seed = GENERATE(1U, 2U);
  CAPTURE(seed);
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> place(0.0F, 3.0F), edge(-0.05F, 0.05F);
  const auto any = [&](auto& from) {
    const float x = from(random), y = from(random), z = from(random);
    return Eigen::Vector3f(x, y, z);
  };
  TestMap map;
  for (std::uint32_t f = 0; f < 300; ++f) {
    const Eigen::Vector3f middle = any(place);
    for (int i = 0; i < 3; ++i) map.mesh.vertices.emplace_back(middle + any(edge));
    map.mesh.faces.push_back({3 * f, 3 * f + 1, 3 * f + 2});
  }
  map.mesh.labels.assign(900, kChair);
  map.seen_by.assign(900, {0, 5});
  ObjectsConfig config{.gap_m = 0.25, .min_surface_m2 = 0.0};
  std::vector<int> part(900);
  for (std::size_t i = 0; i < 900; ++i) part[i] = static_cast<int>(i / 3);
  for (bool changed = true; changed;) {
    changed = false;
    for (std::size_t i = 0; i < 900; ++i)
      for (std::size_t k = 0; k < i; ++k) {
        const bool near = (map.mesh.vertices[i] - map.mesh.vertices[k]).norm() <= 0.25F;
        if (part[i] == part[k] || (!near && i / 3 != k / 3)) continue;
        const int both = std::min(part[i], part[k]);
        part[i] = part[k] = both;
        changed = true;
      }
  }
  std::sort(part.begin(), part.end());
  const auto parts = std::unique(part.begin(), part.end()) - part.begin();
  REQUIRE(parts > 3);
  CHECK(objects_in(map, config).size() == static_cast<std::size_t>(parts));
}

TEST_CASE("The palette and a list of names decide which classes are objects") {
  const LabelPalette palette(
      {{0, "void", {0, 0, 0}}, {2, "Floor", {1, 0, 0}}, {7, "chair", {2, 0, 0}}});
  const std::vector<std::string> background = {"floor", "sky"};
  CHECK(object_labels(palette, background) == ObjectLabels().set(7));
  CHECK(object_labels(palette, {}) == ObjectLabels().set(7).set(2));
}

TEST_CASE("A mesh without labels has no objects, and lists of other lengths are refused") {
  TestMap map;
  map.add_box({{0.0, 0.0, 0.5}, 0.0, {1.0, 1.0, 1.0}}, kChair);
  map.seen_by.pop_back();
  CHECK_THROWS_AS(objects_in(map), std::invalid_argument);
  map.mesh.labels.clear();
  CHECK(objects_in(map).empty());
}

}  // namespace
}  // namespace km
