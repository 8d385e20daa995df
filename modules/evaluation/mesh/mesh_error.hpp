#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "modules/core/geometry/geometry.hpp"
#include "modules/core/map/label_palette.hpp"
#include "modules/evaluation/mesh/mesh_registration.hpp"
#include "modules/evaluation/mesh/sampled_surface.hpp"
#include "modules/mesh/labelled_mesh.hpp"

namespace km {

/// Statistics of distances from one surface to another.
struct DistanceSummary {
  std::size_t count = 0;
  double mean_m = 0.0;  ///< Mean, quantiles and shares are NaN if count is 0.
  double median_m = 0.0;
  double p95_m = 0.0;
  double within_5cm = 0.0;  ///< Share, 0 to 1.
  double within_10cm = 0.0;
};

/// Labels of the estimate at the points of one true class.
struct LabelScore {
  LabelId id = 0;
  std::size_t right = 0;
  std::size_t wrong = 0;    ///< Number of points with another known class.
  std::size_t unknown = 0;  ///< Number of points labelled 0.

  [[nodiscard]] std::size_t points() const { return right + wrong + unknown; }

  /// Share of right labels among all points, unknown included; NaN if there are none.
  [[nodiscard]] double accuracy() const;
  void add(const LabelScore& other);
};

/// Scores of estimated labels, by the true label at the point.
class LabelConfusion {
 public:
  void add(LabelId truth, LabelId estimate);
  void add(const LabelConfusion& other);

  /// One entry per true class that occurs, by id. Points of unknown true class are not judged.
  [[nodiscard]] std::vector<LabelScore> by_class() const;

  /// All classes together, with id 0.
  [[nodiscard]] LabelScore total() const;

 private:
  std::array<LabelScore, 256> scores_ = {};  // by id
};

/// Called from time to time with the current stage; `share` in [0, 1]. Called from the caller's
/// thread.
using MeshProgress = std::function<void(std::string_view stage, double share)>;

/// Options of mesh_error().
struct MeshErrorOptions {
  double samples_per_m2 = 1000.0;  ///< As in the Kimera-Multi paper.
  /// Largest number on either side; the density is reduced accordingly.
  std::size_t max_samples = 20'000'000;
  std::uint32_t seed = 1;
  /// Initial guess of the registration, or the whole of it without ICP.
  SE3 T_truth_estimate = SE3::Identity();
  bool icp = true;

  /// True points further from the estimate are not judged, because a true world is larger than the
  /// part that was seen. The error of an estimated point is at most crop_m. Half a metre is above
  /// the remaining drift of a corrected map. A larger value would include the unseen backs of walls
  /// and furniture.
  double crop_m = 0.5;

  /// A point is judged by the label of the nearest face on the other side only if the nearest
  /// sample there is within this distance: two voxels of 10 cm. (The nearest sample itself is used
  /// more often. With it, the simulated room compared with itself has 97.3 % of its labels right,
  /// because samples across a border between classes interfere.)
  double label_distance_m = 0.2;
};

/// One estimated mesh, which must outlive the call. All estimates are in one frame.
struct MeshInput {
  std::string name;
  const LabelledMesh& mesh;
};

/// Comparison from one surface's points to the other surface.
struct SurfaceComparison {
  DistanceSummary point;  ///< Distance to the nearest sample: the paper's definition.
  /// Distance to the surface there, without the lower limit that sampling causes.
  DistanceSummary surface;
  LabelConfusion labels;  ///< Labels of the points within label_distance_m.
};

/// Difference of one estimate, or of all together, from the truth.
struct MeshError {
  std::string name;
  double area_m2 = 0.0;   ///< Area of the estimate.
  std::size_t faces = 0;  ///< Faces of the estimate.
  double coverage = 0.0;  ///< Share of the true surface within crop_m of the estimate.
  /// Share of the true surface with the estimate within crop_m and in front.
  double seen_coverage = 0.0;
  double beyond = 0.0;      ///< Share of the estimate further than crop_m from the truth.
  SurfaceComparison truth;  ///< Distances from true points within crop_m to the estimate.
  SurfaceComparison seen;   ///< Part of `truth` with the estimate in front, see mesh_error().
  /// From estimated points to the truth; a distance beyond crop_m counts as crop_m.
  SurfaceComparison estimate;
};

struct [[nodiscard]] MeshReport {
  Registration registration;  ///< Common transform of all estimates.
  double moved_m = 0.0;       ///< Largest motion by ICP of a corner of the estimates' box.
  /// Below the requested density if max_samples would be exceeded.
  double samples_per_m2 = 0.0;
  bool has_labels = false;        ///< True if truth and every estimate have labels.
  std::vector<MeshError> robots;  ///< In the order of the inputs.
  /// All estimates as one; equal to a single robot's if there is only one.
  MeshError merged;
  std::vector<std::string> notes;  ///< Remarks for the reader, one line each.
};

/// Compares estimated meshes with the true one as Chang et al. do ("Kimera-Multi: a System for
/// Distributed Multi-Robot Metric-Semantic Simultaneous Localization and Mapping", 2021). Both are
/// sampled and registered by ICP, and the error is the distance from each true point to the nearest
/// estimated one. Further results exclude true points that the estimate cannot have seen, use the
/// opposite direction, and compare labels. All estimates are moved by one transform, so that robots
/// are judged in their common frame.
///
/// A true point has the estimate in front unless the nearest estimated face ends there or faces the
/// opposite way. Otherwise it may be on surface that no robot saw, such as the ground below a car
/// or the back of a wall.
///
/// Throws std::invalid_argument with the name of the mesh if it has no faces or if faces name
/// missing vertices. Throws it also if there are no estimates, for options out of range, and if no
/// part of the truth is near the estimates. Uses OpenCV's threads; the result does not depend on
/// their number. Memory about 60 bytes per sample, besides the meshes and a copy of the estimates.
MeshReport mesh_error(const LabelledMesh& truth, std::span<const MeshInput> estimates,
                      const MeshErrorOptions& options = {}, const MeshProgress& progress = {});

/// Two states of the meshes of the same robots, for instance before and after a correction.
struct MeshChange {
  MeshReport before, after;
};

/// mesh_error() of two states on the same true points. One transform registers both states
/// together. A true point counts for both states if it is within crop_m of either, and as seen if
/// either has it in front. The distance to the other state then counts as at most crop_m, and its
/// label beyond label_distance_m as unknown. A state can therefore not become better by losing
/// surface. `before` and `after` have one mesh for each robot, in the same order. Throws as
/// mesh_error().
MeshChange mesh_change(const LabelledMesh& truth, std::span<const MeshInput> before,
                       std::span<const MeshInput> after, const MeshErrorOptions& options = {});

/// Throws std::invalid_argument, beginning with `name`, for a label that the palette `palette_name`
/// lacks. The palette may lack the unknown label (0).
void check_labels(const LabelledMesh& mesh, const std::string& name, const LabelPalette& palette,
                  const std::string& palette_name);

}  // namespace km
