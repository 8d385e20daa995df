#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "modules/core/camera/camera.hpp"
#include "modules/core/camera/frame.hpp"
#include "modules/core/geometry/geometry.hpp"
#include "modules/core/geometry/pose_spacing.hpp"
#include "modules/core/ids.hpp"

namespace km {

/// Noise of depth z: a standard deviation of sqrt(base_m^2 + (per_m z^2)^2), as in
/// SemanticMappingConfig.
struct DepthNoise {
  double base_m = 0.01;
  double per_m = 0.003;
};

/// The nearest depth in each cell of one depth image: up to there the camera saw free space. A cell
/// has a side of about 0.02 rad.
struct CoarseView {
  KeyframeIndex keyframe = 0;        ///< Last keyframe of the robot at that time.
  SE3 T_odom_cam = SE3::Identity();  ///< Pose of the camera in the odometry frame.
  int columns = 0, rows = 0;
  Eigen::Vector2f focal = Eigen::Vector2f::Zero();   ///< [cells]
  Eigen::Vector2f center = Eigen::Vector2f::Zero();  ///< Principal point [cells].
  DepthNoise noise;
  std::vector<std::uint16_t> nearest_mm;  ///< Row-major; 0: the cell has too few depths.
  float farthest_m = 0.0F;                ///< The greatest of nearest_mm.
};

/// Standard deviations of the pose of a view relative to the pose from which a surface was mapped.
struct PoseSigma {
  float translation_m = 0.0F;
  float rotation_rad = 0.0F;
};

/// Relation of a view to a small piece of surface.
enum class Sight {
  kUnknown,  ///< It is outside the view, too near, behind something, or near the end of a ray.
  kSurface,  ///< There is surface at this place.
  kThrough,  ///< The camera saw through it: all rays beside it end behind it.
};

/// Judges a piece of surface of radius `patch_m` at `p_cam`, in the camera frame.
///
/// The camera saw through it if each cell within patch_m, and within three standard deviations of
/// the pose, has a depth that is certainly greater. The margin along the ray is two patches and
/// three standard deviations of depth and pose. So neither a thin structure nor a surface at a
/// grazing angle is seen through: some cell beside it shows it or what is before it. The bound of
/// the depth comes from that of its inverse, 1 / z + 3 per_m, because disparity has the noise.
[[nodiscard]] Sight sight_of(const CoarseView& view, const Eigen::Vector3f& p_cam, float patch_m,
                             const PoseSigma& sigma);

/// Keeps coarse views of one camera: an image from each new place or in each new direction (see
/// PoseSpacing). Beyond kMaxViews every second one of the older half is dropped. Not thread-safe.
class CoarseViews {
 public:
  /// About 7 kB each.
  static constexpr std::size_t kMaxViews = 1024;

  /// `camera` takes the images; depths below `min_range_m` count as missing. Throws
  /// std::invalid_argument for a camera without pixels or focal length.
  CoarseViews(const Camera& camera, const DepthNoise& noise, double min_range_m);

  /// Precondition: the image has the camera's size, and the pose is finite.
  void add(const DepthImage& depth, const SE3& T_odom_cam, KeyframeIndex keyframe);

  /// The views in order of time.
  [[nodiscard]] const std::vector<std::shared_ptr<const CoarseView>>& views() const {
    return views_;
  }

 private:
  [[nodiscard]] CoarseView reduced(const DepthImage& depth) const;
  void drop_old();

  CoarseView empty_;                   // layout of a view
  std::vector<std::uint32_t> cell_;    // cell of each pixel; the number of cells: none
  std::vector<std::uint16_t> pixels_;  // number of pixels in each cell
  std::uint16_t least_mm_;
  PoseSpacing spacing_;
  std::vector<std::shared_ptr<const CoarseView>> views_;
};

}  // namespace km
