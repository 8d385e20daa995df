#include <catch2/catch.hpp>

#include "test/modules/simulation/world/world_checks.hpp"

namespace km {

TEST_CASE("Every triangle of the city is sound, and it depends on the seed alone", "[simulation]") {
  const World city = make_city(1);
  const World other = make_city(2);
  check_sound(city);
  check_sound(other);
  CHECK(fingerprint(make_city(1)) == fingerprint(city));
  CHECK(fingerprint(other) != fingerprint(city));
  CHECK(city.name == "city");
  CHECK(city.mesh.triangles.size() < 1'600'000);
  const std::set<SurfaceClass> classes = classes_of(city);
  for (const SurfaceClass required :
       {SurfaceClass::kBuilding, SurfaceClass::kRoad, SurfaceClass::kSidewalk,
        SurfaceClass::kTerrain, SurfaceClass::kVegetation, SurfaceClass::kVehicle,
        SurfaceClass::kPole, SurfaceClass::kFence, SurfaceClass::kPerson, SurfaceClass::kObject}) {
    CAPTURE(static_cast<int>(required));
    CHECK(classes.contains(required));
  }
}

TEST_CASE("The city's routes are closed, long, free of obstacles and overlap in part",
          "[simulation]") {
  const std::uint64_t seed = GENERATE(1, 5);
  CAPTURE(seed);
  check_routes(make_city(seed));
}

}  // namespace km
