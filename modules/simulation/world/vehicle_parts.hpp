#pragma once

#include <Eigen/Core>
#include <span>

#include "modules/simulation/world/scene.hpp"

namespace km {

/// A cross-section of a car's body. From one to the next, nose to tail, the skin is stretched.
struct BodyStation {
  float x = 0.0F;           ///< Forward of the middle [m].
  float bottom = 0.25F;     ///< Height of the sill [m].
  float belt = 0.9F;        ///< Height of the windows' lower edge [m].
  float top = 1.4F;         ///< Height of the roof or bonnet [m].
  float half_width = 0.9F;  ///< At the widest [m].
  float half_roof = 0.6F;   ///< Of the roof or bonnet [m].
  bool side_glass = false;  ///< From here to the next station, belt to roof.
  bool top_glass = false;   ///< From here to the next station: a screen across.
};

/// Paints of one vehicle.
struct VehiclePaints {
  MaterialId body = 0;
  MaterialId glass = 0;
  MaterialId dark = 0;  ///< Rubber, bumpers, arches.
  MaterialId metal = 0;
  MaterialId white = 0;
  MaterialId red = 0;
};
[[nodiscard]] VehiclePaints vehicle_paints(Scene& scene, MaterialId body);

/// The skin over the stations, closed at both ends and below.
void add_body(Scene& scene, std::span<const BodyStation> stations, const VehiclePaints& paints);

/// The gap of a door: a dark line down the flanks from the windows to the sill, `x` within the
/// stations.
void add_seam(Scene& scene, std::span<const BodyStation> stations, float x,
              const VehiclePaints& paints);

/// A wheel that touches the ground at x, its outer face at y (its sign tells the side).
void add_wheel(Scene& scene, float x, float y, float radius, float width,
               const VehiclePaints& paints);
/// The dark arch above a wheel, in the plane y, cut off below height `bottom`.
void add_wheel_arch(Scene& scene, float x, float y, float wheel_radius, float radius, float bottom,
                    const VehiclePaints& paints);

/// A number plate in the plane x, facing along `forward` (+1 or -1).
void add_number_plate(Scene& scene, float x, float z, float forward, const VehiclePaints& paints,
                      SeededRandom& random);

}  // namespace km
