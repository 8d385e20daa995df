#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <functional>
#include <vector>

#include "modules/simulation/world/camp_plan.hpp"
#include "modules/simulation/world/scene.hpp"

namespace km {

/// Where things may stand in a camp: off the tracks and not in each other.
class CampSite {
 public:
  CampSite(Scene& scene, const CampPlan& plan) : scene_(scene), plan_(plan) {}

  /// Calls `add` in a frame on the ground at `p`, upright, unless something is within `radius_m`.
  /// Returns whether it did.
  bool stand(const Eigen::Vector2f& p, float yaw_rad, float radius_m,
             const std::function<void()>& add);
  /// The same, tilted like the ground below a footprint of 2 `radius_m`.
  bool lie(const Eigen::Vector2f& p, float yaw_rad, float radius_m,
           const std::function<void()>& add);

 private:
  [[nodiscard]] bool claim(const Eigen::Vector2f& p, float radius_m);

  struct Claim {
    Eigen::Vector2f center;
    float radius_m;
  };

  Scene& scene_;
  const CampPlan& plan_;
  std::vector<Claim> claims_;
};

}  // namespace km
