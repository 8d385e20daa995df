#pragma once

#include <memory>
#include <optional>
#include <span>

#include "modules/core/camera/frame.hpp"
#include "modules/core/config.hpp"
#include "modules/semantic_mapping/block_map.hpp"

namespace km {

/// Parameters of SemanticMapper.
struct SemanticMappingConfig {
  static constexpr const char* kSection = "semantic_mapping";

  std::optional<double> voxel_size_m = {};
  double min_range_m = 0.3;
  double max_range_m = 20.0;
  std::optional<double> depth_sigma_per_m = {};
  int min_views = 3;
  double window_m = 8.0;
  int max_blocks = 20000;

  /// Truncation distance on both sides of a surface [voxels]. The two sides of a thinner wall
  /// have errors. Below three times the depth error, surfaces get holes.
  static constexpr double kTruncation_voxels = 4.0;

  /// Bound on the sum of weights of a voxel. A lower one follows changes faster, a higher one
  /// averages more.
  static constexpr double kMaxWeight = 100.0;

  /// The standard deviation of depth z is sqrt(kDepthSigma_m^2 + (depth_sigma_per_m z^2)^2). A
  /// measurement has the weight kDepthSigma_m^2 divided by its square.
  static constexpr double kDepthSigma_m = 0.01;

  /// depth_sigma_per_m if there is none: that of usual RGB-D cameras.
  static constexpr double kDepthSigma_per_m = 0.003;

  void visit_fields(auto& visitor) {
    visitor.field("voxel_size_m", voxel_size_m, {0.005, 1.0},
                  "[m] side of the smallest voxels; half of it needs up to four times the memory, "
                  "time and triangles; left out: 0.02 to 0.1 by the depths of the first images. "
                  "Farther surface has voxels of twice this size, four times, and so on, so that "
                  "four voxels are at least two standard deviations of depth");
    visitor.field("min_range_m", min_range_m, {0.0, 10.0},
                  "[m along the optical axis] smallest depth that is used");
    visitor.field("max_range_m", max_range_m, {0.5, 65.0}, "[m] largest depth that is used");
    visitor.field(
        "depth_sigma_per_m", depth_sigma_per_m, {0.0, 1.0},
        "[1/m] standard deviation of depth z is sqrt(0.01^2 + (this z^2)^2) m; s / (f b) for "
        "stereo with focal length f [px], baseline b [m] and a "
        "matching error of s px; left out: s is 0.36 for stereo depth and 0.125 for depth images, "
        "with the baseline of the depth camera");
    visitor.field("min_views", min_views, {1, 255},
                  "number of images that must show a surface before it is meshed; excludes single "
                  "wrong depths. More are needed until the standard deviation of their mean depth "
                  "is below half a voxel");
    visitor.field("window_m", window_m, {0.1, 1e6},
                  "[m] distance travelled after which an unseen block becomes final mesh and its "
                  "voxels are discarded; on return it is mapped again; the drift of odometry over "
                  "this distance should be less than a voxel");
    visitor.field("max_blocks", max_blocks, {64, 4000000},
                  "largest number of blocks of 8 x 8 x 8 voxels, 8.5 kB each, 15 kB with surface; "
                  "beyond it the blocks unseen for longest become final mesh");
  }
};

/// Voxels of side `voxel_m` are known once min_views images have observed them, and the standard
/// deviation of the mean of their depths is below half a voxel.
[[nodiscard]] inline KnownFrom known_from(const SemanticMappingConfig& config, double voxel_m) {
  const double share = 2.0 * SemanticMappingConfig::kDepthSigma_m / voxel_m;
  return {static_cast<std::uint8_t>(config.min_views), static_cast<float>(share * share)};
}

/// The side of the smallest voxels that fits a camera's first depth images: 0.02, 0.03, 0.05 or
/// 0.1 m, by the lower quartile of the depths. It is 2.2 to 3.1 m in nine simulated rooms, and 3.3
/// to 4.1 m in 33 streets and fields. The limit of 3.15 m was chosen on 24 of them.
[[nodiscard]] double fitting_voxel_m(const SemanticMappingConfig& config,
                                     std::span<const std::shared_ptr<const DepthImage>> images);

}  // namespace km
