#pragma once

#include "modules/simulation/world/camp_plan.hpp"
#include "modules/simulation/world/camp_site.hpp"
#include "modules/simulation/world/scene.hpp"

namespace km {

inline const Eigen::Vector3f kOlive(0.2F, 0.22F, 0.12F);  ///< Colours of canvas.
inline const Eigen::Vector3f kSand(0.55F, 0.46F, 0.32F);
inline const Eigen::Vector3f kWhite(0.72F, 0.71F, 0.68F);

/// What stands between the tracks: tents in rows (two yards of equal ones), headquarters, domes,
/// containers, vehicles.
void add_yards(Scene& scene, CampSite& site, const CampPlan& plan, std::uint64_t seed);

}  // namespace km
