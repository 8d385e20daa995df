#pragma once

#include <Eigen/Core>

#include "modules/simulation/world/scene.hpp"

namespace km {

/// Tents stand with their door at -y. `cloth` is the colour of the canvas; walls reach half a metre
/// into the ground, which may be uneven.
void add_ridge_tent(Scene& scene, const Eigen::Vector3f& cloth, SeededRandom& random);  ///< 3 x 4 m
void add_house_tent(Scene& scene, float length_m, const Eigen::Vector3f& cloth,
                    SeededRandom& random);  ///< 5 m wide, upright walls.
void add_tunnel_shelter(Scene& scene, float length_m, const Eigen::Vector3f& cloth);  ///< 6 m wide
void add_dome_tent(Scene& scene, float radius_m, const Eigen::Vector3f& cloth);
/// A sail on four poles, 5 x 4 m, to sit below.
void add_awning_roof(Scene& scene, const Eigen::Vector3f& cloth);

}  // namespace km
