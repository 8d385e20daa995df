#include <catch2/catch.hpp>

#include "test/modules/simulation/world/world_checks.hpp"

namespace km {

TEST_CASE("Every triangle of the camp is sound, and it depends on the seed alone", "[simulation]") {
  const World camp = make_camp(1);
  const World other = make_camp(2);
  check_sound(camp);
  check_sound(other);
  CHECK(fingerprint(make_camp(1)) == fingerprint(camp));
  CHECK(fingerprint(other) != fingerprint(camp));
  CHECK(camp.name == "camp");
  CHECK(camp.mesh.triangles.size() < 1'600'000);
  const std::set<SurfaceClass> classes = classes_of(camp);
  for (const SurfaceClass required :
       {SurfaceClass::kRoad, SurfaceClass::kTerrain, SurfaceClass::kVegetation,
        SurfaceClass::kVehicle, SurfaceClass::kPole, SurfaceClass::kFence, SurfaceClass::kTent,
        SurfaceClass::kPerson, SurfaceClass::kObject}) {
    CAPTURE(static_cast<int>(required));
    CHECK(classes.contains(required));
  }
}

TEST_CASE("The camp's routes are closed, long, free of obstacles and overlap in part",
          "[simulation]") {
  const std::uint64_t seed = GENERATE(1, 5);
  CAPTURE(seed);
  check_routes(make_camp(seed));
}

}  // namespace km
