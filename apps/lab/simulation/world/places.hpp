#pragma once

#include <cstdint>

#include "apps/lab/simulation/world/world.hpp"
#include "modules/core/config.hpp"

namespace km {

/// Places that mislead place recognition.
struct PlacesConfig {
  static constexpr const char* kSection = "places";

  bool alike = false;
  bool opposite = false;

  void visit_fields(auto& visitor) {
    visitor.field("alike", alike, "city: one kind of house, and the same things along all streets");
    visitor.field("opposite", opposite,
                  "every second robot drives the route of the robot before it the other way round");
  }
};

/// make_city() with houses of one kind, and the same things along all streets.
[[nodiscard]] World make_uniform_city(std::uint64_t seed);

/// A store with equal aisles between equal shelves, for vehicles on a level floor.
[[nodiscard]] World make_store(std::uint64_t seed);

/// Distance from a route of `world` to the lane of the opposite direction [m]; 0 indoors.
[[nodiscard]] double lane_apart_m(const World& world);

}  // namespace km
