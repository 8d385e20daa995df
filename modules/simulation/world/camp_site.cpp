#include "modules/simulation/world/camp_site.hpp"

#include <algorithm>
#include <cmath>

namespace km {

using Eigen::Vector2f;
using Eigen::Vector3f;

bool CampSite::claim(const Vector2f& p, float radius_m) {
  if (plan_.distance_to_track(p) < kTrackClear_m + radius_m) return false;
  const bool taken = std::ranges::any_of(claims_, [&](const Claim& other) {
    return (other.center - p).norm() < other.radius_m + radius_m;
  });
  if (!taken) claims_.push_back({p, radius_m});
  return !taken;
}

bool CampSite::stand(const Vector2f& p, float yaw_rad, float radius_m,
                     const std::function<void()>& add) {
  if (!claim(p, radius_m)) return false;
  const auto z = static_cast<float>(plan_.ground(p.x(), p.y()));
  const ScopedFrame frame(scene_.mesh, standing_at({p.x(), p.y(), z}, yaw_rad));
  scene_.mesh.set_uv_offset({std::fmod(std::abs(p.x()), 5.0F), std::fmod(std::abs(p.y()), 5.0F)});
  add();
  scene_.mesh.set_uv_offset(Vector2f::Zero());
  return true;
}

bool CampSite::lie(const Vector2f& p, float yaw_rad, float radius_m,
                   const std::function<void()>& add) {
  const Vector3f forward(std::cos(yaw_rad), std::sin(yaw_rad), 0.0F);
  const Vector3f left(-forward.y(), forward.x(), 0.0F);
  const auto ground = [&](const Vector3f& offset) {
    const float x = p.x() + offset.x();
    const float y = p.y() + offset.y();
    return Vector3f(x, y, static_cast<float>(plan_.ground(x, y)));
  };
  const float reach = 0.7F * radius_m;
  const Vector3f x_axis = (ground(reach * forward) - ground(-reach * forward)).normalized();
  const Vector3f slope = ground(reach * left) - ground(-reach * left);
  const Vector3f z_axis = x_axis.cross(slope).normalized();
  Eigen::Isometry3f tilt = Eigen::Isometry3f::Identity();
  tilt.linear().col(0) = x_axis;
  tilt.linear().col(1) = z_axis.cross(x_axis);
  tilt.linear().col(2) = z_axis;
  return stand(p, 0.0F, radius_m, [&] {
    const ScopedFrame frame(scene_.mesh, tilt);
    add();
  });
}

}  // namespace km
