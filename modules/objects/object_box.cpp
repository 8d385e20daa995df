#include "modules/objects/object_box.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

namespace km {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

double cross2(const Vector2d& a, const Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

// Convex hull, counter-clockwise, by Andrew's monotone chain.
std::vector<Vector2d> hull_of(std::vector<Vector2d> points) {
  std::ranges::sort(points, [](const Vector2d& a, const Vector2d& b) {
    return std::pair(a.x(), a.y()) < std::pair(b.x(), b.y());
  });
  points.erase(std::unique(points.begin(), points.end()), points.end());
  if (points.size() < 3) return points;
  std::vector<Vector2d> hull;
  const auto add = [&hull](const Vector2d& p, std::size_t kept) {
    while (hull.size() > kept &&
           cross2(hull.back() - hull[hull.size() - 2], p - hull.back()) <= 0.0)
      hull.pop_back();
    hull.push_back(p);
  };
  for (const Vector2d& p : points) add(p, 1);
  const std::size_t lower = hull.size();
  for (std::size_t i = points.size() - 1; i-- > 0;) add(points[i], lower);
  hull.pop_back();
  return hull;
}

struct Rectangle {
  double area = std::numeric_limits<double>::infinity();
  Vector2d center = Vector2d::Zero(), size = Vector2d::Zero(), axis = Vector2d::UnitX();
};

Rectangle rectangle_along(const Vector2d& axis, const std::vector<Vector2d>& hull) {
  const Vector2d across(-axis.y(), axis.x());
  Vector2d low = Vector2d::Constant(std::numeric_limits<double>::infinity());
  Vector2d high = -low;
  for (const Vector2d& p : hull) {
    const Vector2d q(p.dot(axis), p.dot(across));
    low = low.cwiseMin(q);
    high = high.cwiseMax(q);
  }
  const Vector2d middle = 0.5 * (low + high);
  return {(high - low).prod(), middle.x() * axis + middle.y() * across, high - low, axis};
}

// The part of a convex polygon on the left of the line from a to b.
std::vector<Vector2d> clipped(const std::vector<Vector2d>& polygon, const Vector2d& a,
                              const Vector2d& b) {
  std::vector<Vector2d> result;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vector2d& p = polygon[i];
    const Vector2d& q = polygon[(i + 1) % polygon.size()];
    const double side_p = cross2(b - a, p - a), side_q = cross2(b - a, q - a);
    if (side_p >= 0.0) result.push_back(p);
    if ((side_p > 0.0 && side_q < 0.0) || (side_p < 0.0 && side_q > 0.0))
      result.emplace_back(p + side_p / (side_p - side_q) * (q - p));
  }
  return result;
}

std::vector<Vector2d> base_of(const ObjectBox& box) {
  const Vector2d x(std::cos(box.yaw_rad), std::sin(box.yaw_rad)), y(-x.y(), x.x());
  const Vector2d c = box.center.head<2>(), u = 0.5 * box.size_m.x() * x,
                 v = 0.5 * box.size_m.y() * y;
  return {c - u - v, c + u - v, c + u + v, c - u + v};
}

double area_of(const std::vector<Vector2d>& polygon) {
  double twice = 0.0;
  for (std::size_t i = 1; i + 1 < polygon.size(); ++i)
    twice += cross2(polygon[i] - polygon[0], polygon[i + 1] - polygon[0]);
  return 0.5 * twice;
}

ObjectBox conventional(ObjectBox box) {
  constexpr double kPi = std::numbers::pi;
  if (box.size_m.y() > box.size_m.x()) {
    std::swap(box.size_m.x(), box.size_m.y());
    box.yaw_rad += 0.5 * kPi;
  }
  box.yaw_rad -= kPi * std::floor(box.yaw_rad / kPi + 0.5);
  return box;
}

}  // namespace

ObjectBox ObjectBox::grown(double margin_m) const {
  return {center, yaw_rad, size_m + Vector3d::Constant(2.0 * margin_m)};
}

SE3 ObjectBox::pose() const {
  return make_pose(Eigen::AngleAxisd(yaw_rad, Vector3d::UnitZ()).toRotationMatrix(), center);
}

ObjectBox upright_box(const SE3& T_world_box, const Vector3d& size_m) {
  const Vector3d x = T_world_box.linear().col(0);
  return conventional({T_world_box.translation(), std::atan2(x.y(), x.x()), size_m});
}

ObjectBox enclosing_box(std::span<const Vector3d> points) {
  std::vector<Vector2d> base;
  double low = points[0].z(), high = low;
  for (const Vector3d& p : points) {
    base.emplace_back(p.head<2>());
    low = std::min(low, p.z());
    high = std::max(high, p.z());
  }
  const std::vector<Vector2d> hull = hull_of(std::move(base));
  Rectangle best = rectangle_along(Vector2d::UnitX(), hull);
  for (std::size_t i = 0; i < hull.size(); ++i) {
    const Vector2d edge = hull[(i + 1) % hull.size()] - hull[i];
    if (edge.norm() <= 0.0) continue;
    const Rectangle other = rectangle_along(edge.normalized(), hull);
    if (other.area < best.area) best = other;
  }
  return conventional({{best.center.x(), best.center.y(), 0.5 * (low + high)},
                       std::atan2(best.axis.y(), best.axis.x()),
                       {best.size.x(), best.size.y(), high - low}});
}

std::array<Vector3d, 8> corners_of(const ObjectBox& box) {
  std::array<Vector3d, 8> corners;
  const std::vector<Vector2d> base = base_of(box);
  for (std::size_t i = 0; i < 8; ++i) {
    const double side = i < 4 ? -0.5 : 0.5;
    corners[i] << base[i % 4], box.center.z() + side * box.size_m.z();
  }
  return corners;
}

double shared_volume_m3(const ObjectBox& a, const ObjectBox& b) {
  const double height =
      std::min(a.center.z() + 0.5 * a.size_m.z(), b.center.z() + 0.5 * b.size_m.z()) -
      std::max(a.center.z() - 0.5 * a.size_m.z(), b.center.z() - 0.5 * b.size_m.z());
  if (!(height > 0.0)) return 0.0;
  std::vector<Vector2d> shared = base_of(a);
  const std::vector<Vector2d> other = base_of(b);
  for (std::size_t i = 0; i < 4 && !shared.empty(); ++i)
    shared = clipped(shared, other[i], other[(i + 1) % 4]);
  return height * area_of(shared);
}

double intersection_over_union(const ObjectBox& a, const ObjectBox& b) {
  const double shared = shared_volume_m3(a, b);
  const double all = a.volume_m3() + b.volume_m3() - shared;
  return all > 0.0 ? shared / all : 0.0;
}

}  // namespace km
