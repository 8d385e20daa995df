#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "modules/core/geometry.hpp"
#include "modules/evaluation/mesh/sampled_surface.hpp"
#include "modules/mesh/labelled_mesh.hpp"

namespace km {

/// How an estimate is brought onto the truth.
struct RegistrationOptions {
  double reach_m = 1.0;       ///< Further pairs are not looked at.
  double gate_m = 0.01;       ///< In the end pairs do not count that are further apart than this
  double gate_medians = 3.0;  ///< and than so many medians.
  int max_iterations = 50;
  std::size_t max_points = 50'000;  ///< Of the estimate that are paired, evenly chosen.
};

/// Points on an estimate and the unit normals of its faces there.
struct OrientedPoints {
  std::vector<Eigen::Vector3f> points, normals;

  /// Adds samples of `mesh`; those on faces without area have no normal and are left out.
  void add(const LabelledMesh& mesh, const SurfaceSamples& samples);
};

/// What registration found.
struct [[nodiscard]] Registration {
  SE3 T_truth_estimate = SE3::Identity();
  int iterations = 0;
  bool converged = false;   ///< Else stopped by max_iterations, or nothing was near.
  int free_directions = 0;  ///< Of 6, those the surfaces leave open: not moved along.
  double rms_m = 0.0;       ///< To the planes, of the pairs kept in the last iteration.
  std::size_t pairs = 0;    ///< Kept in the last iteration.
};

/// Iterative closest points: pairs of an estimated sample and the nearest true face, turned by at
/// most 45 degrees against it (ground beside a kerb is not the kerb: in streets, wrong pairs of
/// that kind outnumber the walls that hold the map along the street), within a gate that shrinks
/// from iteration to iteration, distances to the plane of that face (Chen and
/// Medioni, "Object modelling by registration of multiple range images", 1992), Gauss-Newton on
/// [rotation; translation]. Directions in which the surfaces slide along themselves, as a single
/// plane's three, keep what the guess has. Works from `T_truth_estimate` on; converged when a step
/// is below 10 micrometres.
Registration register_mesh(const LabelledMesh& truth, const NearestSurface& nearest_truth,
                           const OrientedPoints& estimate, const SE3& T_truth_estimate,
                           const RegistrationOptions& options = {});

}  // namespace km
