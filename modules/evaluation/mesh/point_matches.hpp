#pragma once

#include <functional>
#include <string_view>
#include <vector>

#include "modules/core/label_palette.hpp"
#include "modules/evaluation/mesh/nearest_surface.hpp"
#include "modules/evaluation/mesh/surface_samples.hpp"
#include "modules/mesh/labelled_mesh.hpp"

namespace km {

/// Called now and then with what is being done; `share` in [0, 1]. From the caller's thread.
using MeshProgress = std::function<void(std::string_view stage, double share)>;

/// A mesh with points on it; both outlive this.
struct SampledMesh {
  const LabelledMesh& mesh;
  const SurfaceSamples& samples;

  [[nodiscard]] LabelId label(std::size_t sample) const {
    return mesh.face_label(samples.faces[sample]);
  }
};

/// What is nearest to each of a mesh's points on another mesh. All arrays are as long as there are
/// points.
struct PointMatches {
  std::vector<float> point_m;    ///< To the nearest sample; infinite if none is within reach.
  std::vector<float> surface_m;  ///< See NearestSample::surface_m; likewise.
  std::vector<LabelId> labels;   ///< Of the nearest face (NearestSample::face); 0 if none.

  /// Whether that face is in front of the point's: neither does the mesh end there, nor do the two
  /// face opposite ways. Else the point may lie on what the other mesh never saw: the ground below
  /// a car, the back of a wall.
  std::vector<bool> in_front;

  /// Takes what `other` has where it is nearer; in front of either is in front. Both are of the
  /// same points.
  void keep_nearer(const PointMatches& other);
};

/// Uses OpenCV's threads; the result does not depend on how many. `progress` is told `stage`.
[[nodiscard]] PointMatches match_points(const SampledMesh& from, const SampledMesh& to,
                                        const NearestSurface& nearest_to, double reach_m,
                                        std::string_view stage, const MeshProgress& progress);

}  // namespace km
