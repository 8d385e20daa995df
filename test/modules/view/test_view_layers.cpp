#include "modules/view/view_layers.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

std::shared_ptr<const ObjectList> chair_at(double x) {
  MapObject chair{.label = 5, .box = {}};
  chair.box.center.x() = x;
  return std::make_shared<const ObjectList>(ObjectList{0, {chair}});
}

std::shared_ptr<const OccupancyGrid> map_of(std::int8_t cell) {
  return std::make_shared<const OccupancyGrid>(OccupancyGrid{0.05, {0, 0}, 1, 1, {cell}});
}

}  // namespace

TEST_CASE("The newest objects and maps are sent once, in turn, and again to a new viewer") {
  ViewLayers layers(1.0);
  CHECK_FALSE(layers.next(0.0));
  layers.add(chair_at(1));
  layers.add(chair_at(2));
  layers.add(map_of(OccupancyGrid::kFree));
  auto sent = layers.next(0.0);
  REQUIRE(sent);
  CHECK(std::get<ViewObjects>(*sent).objects[0].center.x() == 2.0F);
  CHECK_FALSE(layers.next(1.0));  // The bytes of the objects take longer at 1 B/s.
  layers.add(chair_at(3));
  sent = layers.next(1000.0);
  REQUIRE(sent);
  CHECK(std::holds_alternative<ViewRaster>(*sent));
  sent = layers.next(2000.0);
  REQUIRE(sent);
  CHECK(std::get<ViewObjects>(*sent).objects[0].center.x() == 3.0F);
  layers.add(chair_at(3));
  layers.add(map_of(OccupancyGrid::kFree));
  CHECK_FALSE(layers.next(3000.0));  // unchanged
  layers.begin_again();
  CHECK(layers.next(3000.0));
  CHECK(layers.next(4000.0));
  CHECK_FALSE(layers.next(5000.0));
}

}  // namespace km
