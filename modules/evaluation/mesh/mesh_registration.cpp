#include "modules/evaluation/mesh/mesh_registration.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <opencv2/core/utility.hpp>
#include <optional>

#include "modules/core/geometry/lie.hpp"
#include "modules/core/geometry/symmetric_eigen.hpp"

namespace km {
namespace {

constexpr double kGate_m = 0.01;      // smallest final bound on the distance of a pair
constexpr double kGateMedians = 3.0;  // final bound, as a multiple of the median
constexpr int kMaxIterations = 50;
constexpr std::size_t kMaxPoints = 50'000;  // paired points of the estimate, evenly chosen
constexpr double kStop_m = 1e-5;            // step that ends the iterations
constexpr double kShrink = 0.7;             // factor on the gate from one iteration to the next
// Share of the pairs' weight below which a direction is undetermined
constexpr double kOpen = 1e-3;
constexpr std::size_t kMinPairs = 6;
constexpr double kMinCosine = 0.7071;  // cosine of 45 degrees, between the normals of a pair

// An estimated point, moved by the current transform, and the plane of the nearest true face.
struct Pair {
  Eigen::Vector3d point;
  Eigen::Vector3d normal;
  double offset_m = 0.0;    // along the normal, from the plane to the point
  float distance_m = 0.0F;  // distance from the point to the face
};

class Pairing {
 public:
  Pairing(const LabelledMesh& truth, const NearestSurface& nearest, const OrientedPoints& estimate)
      : truth_(truth), nearest_(nearest) {
    const std::size_t step = std::max<std::size_t>(1, estimate.points.size() / kMaxPoints);
    for (std::size_t i = 0; i < estimate.points.size(); i += step) {
      points_.emplace_back(estimate.points[i].cast<double>());
      normals_.emplace_back(estimate.normals[i].cast<double>());
    }
  }

  // The pairs within the gate, in the order of the points.
  [[nodiscard]] std::vector<Pair> pairs(const SE3& T, double gate_m) const {
    std::vector<std::optional<Pair>> found(points_.size());
    cv::parallel_for_(cv::Range(0, static_cast<int>(points_.size())), [&](const cv::Range& range) {
      for (int i = range.start; i < range.end; ++i) {
        const auto at = static_cast<std::size_t>(i);
        found[at] = pair_of(T * points_[at], T.linear() * normals_[at]);
      }
    });
    std::vector<Pair> result;
    for (const auto& pair : found)
      if (pair) result.push_back(*pair);
    return within(std::move(result), gate_m);
  }

 private:
  [[nodiscard]] std::optional<Pair> pair_of(const Eigen::Vector3d& point,
                                            const Eigen::Vector3d& point_normal) const {
    const auto near = nearest_.find(point.cast<float>(), kRegistrationReach_m);
    if (!near) return std::nullopt;
    const LabelledMesh::Face& face = truth_.faces[near->face];
    const auto corner = [&](std::size_t k) {
      return Eigen::Vector3d(truth_.vertices[face[k]].cast<double>());
    };
    const Eigen::Vector3d normal = (corner(1) - corner(0)).cross(corner(2) - corner(0));
    if (!(normal.norm() > 0.0)) return std::nullopt;
    const Eigen::Vector3d unit = normal.normalized();
    if (std::abs(unit.dot(point_normal)) < kMinCosine) return std::nullopt;
    return Pair{point, unit, unit.dot(point - corner(0)), near->surface_m};
  }

  [[nodiscard]] std::vector<Pair> within(std::vector<Pair> pairs, double gate_m) const {
    if (pairs.empty()) return pairs;
    std::vector<float> distances;
    distances.reserve(pairs.size());
    for (const Pair& pair : pairs) distances.push_back(pair.distance_m);
    const auto middle = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2);
    std::nth_element(distances.begin(), middle, distances.end());
    const double limit_m = std::max({gate_m, kGate_m, kGateMedians * static_cast<double>(*middle)});
    std::erase_if(pairs,
                  [&](const Pair& pair) { return static_cast<double>(pair.distance_m) > limit_m; });
    return pairs;
  }

  const LabelledMesh& truth_;
  const NearestSurface& nearest_;
  std::vector<Eigen::Vector3d> points_, normals_;
};

struct Step {
  SE3 T = SE3::Identity();  // moves the points
  double length_m = 0.0;
  int free_directions = 0;
};

Eigen::Vector3d centre_of(const std::vector<Pair>& pairs) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Pair& pair : pairs) sum += pair.point;
  return sum / static_cast<double>(pairs.size());
}

// Least squares of n^T (dR (p - c) + c + dt - q) over the pairs, about their centre c. Rotations
// are expressed as the distance [m] that they move a point at the typical radius. All six unknowns
// are then lengths, so that eigenvalues show which directions the surfaces determine.
Step step_of(const std::vector<Pair>& pairs) {
  const Eigen::Vector3d centre = centre_of(pairs);
  double radius2 = 0.0;
  for (const Pair& pair : pairs) radius2 += (pair.point - centre).squaredNorm();
  const double radius = std::max(std::sqrt(radius2 / static_cast<double>(pairs.size())), 1e-3);

  Matrix6 H = Matrix6::Zero();
  Vector6 g = Vector6::Zero();
  for (const Pair& pair : pairs) {
    Vector6 J;
    J << (pair.point - centre).cross(pair.normal) / radius, pair.normal;
    H += J * J.transpose();
    g += J * pair.offset_m;
  }
  const SymmetricEigen eigen = symmetric_eigen(H);
  Step step;
  Vector6 x = Vector6::Zero();
  for (int i = 0; i < 6; ++i) {
    const double value = eigen.values[i];
    const Vector6 direction = eigen.vectors.col(i);
    if (value < kOpen * static_cast<double>(pairs.size()))
      ++step.free_directions;
    else
      x -= direction * (direction.dot(g) / value);
  }
  step.length_m = x.norm();
  const Eigen::Matrix3d R = so3_exp(x.head<3>() / radius);
  step.T = make_pose(R, centre + x.tail<3>() - R * centre);
  return step;
}

double rms_of(const std::vector<Pair>& pairs) {
  double sum = 0.0;
  for (const Pair& pair : pairs) sum += pair.offset_m * pair.offset_m;
  return pairs.empty() ? 0.0 : std::sqrt(sum / static_cast<double>(pairs.size()));
}

}  // namespace

void OrientedPoints::add(const LabelledMesh& mesh, const SurfaceSamples& samples) {
  for (std::size_t i = 0; i < samples.points.size(); ++i) {
    const Eigen::Vector3f normal = mesh.face_normal(samples.faces[i]);
    if (!(normal.norm() > 0.0F)) continue;
    points.push_back(samples.points[i]);
    normals.push_back(normal.normalized());
  }
}

Registration register_mesh(const LabelledMesh& truth, const NearestSurface& nearest_truth,
                           const OrientedPoints& estimate) {
  const Pairing pairing(truth, nearest_truth, estimate);
  Registration result;
  // At first all pairs within reach count, so that an estimate that errs in only one direction is
  // moved.
  double gate_m = kRegistrationReach_m;
  while (result.iterations < kMaxIterations && !result.converged) {
    const std::vector<Pair> pairs = pairing.pairs(result.T_truth_estimate, gate_m);
    result.pairs = pairs.size();
    result.rms_m = rms_of(pairs);
    if (pairs.size() < kMinPairs) break;
    const Step step = step_of(pairs);
    result.T_truth_estimate = step.T * result.T_truth_estimate;
    result.free_directions = step.free_directions;
    result.converged = step.length_m < kStop_m && gate_m <= kGate_m;
    gate_m = std::max(kGate_m, kShrink * gate_m);
    ++result.iterations;
  }
  return result;
}

}  // namespace km
