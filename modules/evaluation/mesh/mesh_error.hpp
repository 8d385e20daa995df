#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "modules/core/geometry.hpp"
#include "modules/core/label_palette.hpp"
#include "modules/evaluation/mesh/mesh_registration.hpp"
#include "modules/evaluation/mesh/sampled_surface.hpp"
#include "modules/mesh/labelled_mesh.hpp"

namespace km {

/// Of distances from one surface to another.
struct DistanceSummary {
  std::size_t count = 0;
  double mean_m = 0.0;  ///< These and the shares are NaN for a count of 0.
  double median_m = 0.0;
  double p95_m = 0.0;
  double within_5cm = 0.0;  ///< Share, 0 to 1.
  double within_10cm = 0.0;
};

/// How the estimate labels the points of one true class.
struct LabelScore {
  LabelId id = 0;
  std::size_t right = 0;
  std::size_t wrong = 0;    ///< Another known class.
  std::size_t unknown = 0;  ///< Labelled 0.

  [[nodiscard]] std::size_t points() const { return right + wrong + unknown; }

  /// Share of right labels among all points, unknown included, or among the known only. NaN for
  /// none.
  [[nodiscard]] double accuracy() const;
  [[nodiscard]] double accuracy_of_known() const;
  void add(const LabelScore& other);
};

/// Scores of estimated labels, by the true one in their place.
class LabelConfusion {
 public:
  void add(LabelId truth, LabelId estimate);
  void add(const LabelConfusion& other);

  /// One entry per true class that occurs, by id; points whose true class is unknown are not
  /// judged.
  [[nodiscard]] std::vector<LabelScore> by_class() const;

  /// All classes together, with id 0.
  [[nodiscard]] LabelScore total() const;

 private:
  std::array<LabelScore, 256> scores_ = {};  // by id
};

/// Called now and then with what is being done; `share` in [0, 1]. From the caller's thread.
using MeshProgress = std::function<void(std::string_view stage, double share)>;

/// How meshes are compared.
struct MeshErrorOptions {
  double samples_per_m2 = 1000.0;        ///< As in the Kimera-Multi paper.
  std::size_t max_samples = 20'000'000;  ///< Of either side; the density sinks to stay below.
  std::uint32_t seed = 1;
  SE3 T_truth_estimate = SE3::Identity();  ///< Where registration starts, or all of it.
  bool icp = true;
  RegistrationOptions registration;

  /// True points further from the estimate are not judged: a true world is larger than what was
  /// seen of it. Also the largest error that counts. Half a metre is above what drift leaves in a
  /// corrected map; more would take in the unseen backs of walls and furniture.
  double crop_m = 0.5;

  /// A point is judged by the label of the nearest face on the other side only if the nearest
  /// sample there is within this distance: two voxels of 10 cm. (By the nearest sample, as is more
  /// usual, the simulated room compared with itself has 97.3 % of its labels right: samples across
  /// a border between classes come in between.)
  double label_distance_m = 0.2;
};

/// One estimated mesh; outlives the call. All estimates are in one frame.
struct MeshInput {
  std::string name;
  const LabelledMesh& mesh;
};

/// From one surface's points to the other's.
struct SurfaceComparison {
  DistanceSummary point;    ///< To the nearest sample: the paper's definition.
  DistanceSummary surface;  ///< To the surface there: free of the floor that sampling sets.
  LabelConfusion labels;    ///< Of the points within label_distance_m.
};

/// How one estimate, or all together, differ from the truth.
struct MeshError {
  std::string name;
  double area_m2 = 0.0;        ///< Of the estimate.
  std::size_t faces = 0;       ///< Of the estimate.
  double coverage = 0.0;       ///< Share of the true surface within crop_m of the estimate.
  double seen_coverage = 0.0;  ///< And of it that has the estimate in front.
  double beyond = 0.0;         ///< Share of the estimate further than crop_m from the truth.
  SurfaceComparison truth;     ///< From true points within crop_m to the estimate.
  SurfaceComparison seen;      ///< Of these, with the estimate in front, see below.
  SurfaceComparison estimate;  ///< From estimated points to the truth; beyond crop_m as crop_m.
};

struct [[nodiscard]] MeshReport {
  Registration registration;       ///< One transform for all estimates.
  double moved_m = 0.0;            ///< By ICP: the largest way of a corner of the estimates' box.
  double samples_per_m2 = 0.0;     ///< Below what was asked for if max_samples would be exceeded.
  bool has_labels = false;         ///< Truth and every estimate carry labels.
  std::vector<MeshError> robots;   ///< In the order of the inputs.
  MeshError merged;                ///< All estimates as one; that of the robot if there is one.
  std::vector<std::string> notes;  ///< One line each: what a reader should know.
};

/// Compares estimated meshes with the true one as Chang et al. do ("Kimera-Multi: a System for
/// Distributed Multi-Robot Metric-Semantic Simultaneous Localization and Mapping", 2021): both
/// sampled, registered by ICP, distance from each true point to the nearest estimated one; also
/// without true points that the estimate cannot have seen, the other way round, and labels. All
/// estimates are moved by ONE transform, so that robots are judged in their common frame.
///
/// A true point has the estimate in front unless the nearest estimated face ends there or faces the
/// opposite way: else it may lie on what no robot saw, the ground below a car, the back of a wall.
///
/// Throws std::invalid_argument, naming the mesh, for one without faces or whose faces name
/// vertices there are not, for no estimates, for options out of range, and if nothing of the truth
/// is near the estimates. Uses OpenCV's threads; the result does not depend on how many. Memory
/// about 60 bytes per sample, besides the meshes and a copy of the estimates.
MeshReport mesh_error(const LabelledMesh& truth, std::span<const MeshInput> estimates,
                      const MeshErrorOptions& options = {}, const MeshProgress& progress = {});

/// Throws std::invalid_argument, beginning with `name`, for a label that the palette, called
/// `palette_name`, does not have. Unknown (0) it need not have.
void check_labels(const LabelledMesh& mesh, const std::string& name, const LabelPalette& palette,
                  const std::string& palette_name);

}  // namespace km
