#pragma once

#include "modules/simulation/world/camp_plan.hpp"
#include "modules/simulation/world/camp_site.hpp"
#include "modules/simulation/world/scene.hpp"

namespace km {

/// Tracks, trodden ground, grass, hills around.
void add_camp_ground(Scene& scene, const CampPlan& plan, std::uint64_t seed);

/// The fence with its towers.
void add_perimeter(Scene& scene, const CampPlan& plan, CampSite& site);

/// Trees on the hills outside the fence.
void add_camp_wood(Scene& scene, const CampPlan& plan, SeededRandom& random);

/// Tufts beside the tracks.
void add_camp_grass(Scene& scene, const CampPlan& plan, SeededRandom& random);

}  // namespace km
