#pragma once

#include <cstdint>

#include "modules/simulation/world/scene.hpp"

namespace km {

enum class VehicleKind : std::uint8_t { kSedan, kHatchback, kEstate, kVan };

/// Half of the largest extent across and along of any road vehicle here [m].
inline constexpr float kVehicleHalfWidth_m = 1.0F;
inline constexpr float kVehicleHalfLength_m = 2.7F;

/// A parked road vehicle: body, windows, wheels, lights, mirrors, plates. Drives along +x.
void add_vehicle(Scene& scene, VehicleKind kind, SeededRandom& random);

/// A high-wheeled lorry with cab and load bed under canvas, 6.6 m long.
void add_army_truck(Scene& scene, SeededRandom& random);

/// An open-backed off-road car, 4 m long.
void add_army_jeep(Scene& scene, SeededRandom& random);

}  // namespace km
