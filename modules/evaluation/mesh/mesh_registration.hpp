#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "modules/core/geometry/geometry.hpp"
#include "modules/evaluation/mesh/sampled_surface.hpp"
#include "modules/mesh/labelled_mesh.hpp"

namespace km {

/// Largest distance of a pair of the registration, at first.
inline constexpr double kRegistrationReach_m = 1.0;

/// Points on an estimate, and the unit normals of its faces there.
struct OrientedPoints {
  std::vector<Eigen::Vector3f> points, normals;

  /// Adds samples of `mesh`, except for those on faces without area, which have no normal.
  void add(const LabelledMesh& mesh, const SurfaceSamples& samples);
};

/// Result of a registration.
struct [[nodiscard]] Registration {
  SE3 T_truth_estimate = SE3::Identity();
  int iterations = 0;
  bool converged = false;   ///< False: stopped by max_iterations, or nothing was near.
  int free_directions = 0;  ///< Undetermined directions, of 6: no motion along them.
  double rms_m = 0.0;       ///< Rms distance to the planes, over the pairs of the last iteration.
  std::size_t pairs = 0;    ///< Pairs of the last iteration.
};

/// Iterative closest points. A pair is an estimated sample and the nearest true face with a normal
/// within 45 degrees of the sample's. (Ground beside a kerb is not the kerb. In streets such wrong
/// pairs outnumber the walls that determine the position along the street.) Pairs must be within a
/// gate that shrinks from iteration to iteration. Distances are to the plane of the face (Chen and
/// Medioni, "Object modelling by registration of multiple range images", 1992), minimised by
/// Gauss-Newton on [rotation; translation].
///
/// Along directions in which the surfaces slide along themselves, as for three directions of a
/// single plane, the estimate stays. Converged when a step is below 10 micrometres.
Registration register_mesh(const LabelledMesh& truth, const NearestSurface& nearest_truth,
                           const OrientedPoints& estimate);

}  // namespace km
