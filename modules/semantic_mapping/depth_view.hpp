#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "modules/core/camera/camera.hpp"
#include "modules/core/camera/color_image.hpp"
#include "modules/core/camera/frame.hpp"
#include "modules/core/map/label_palette.hpp"

namespace km {

/// A depth image with labels in a layout onto which voxels are projected: seen by a camera without
/// distortion, depths out of range removed, unknown labels 0.
struct DepthView {
  static constexpr int kTileSide = 16;  ///< [px]

  int width = 0, height = 0;                         ///< [px]
  float fx = 0.0F, fy = 0.0F, cx = 0.0F, cy = 0.0F;  ///< [px]

  /// Depth [mm] in the low 16 bits (0: none), label in the 8 bits above; row-major. One more pixel
  /// at the end is 0 and stands for points outside.
  std::vector<std::uint32_t> pixels;

  /// Smallest and greatest depth [mm] of the tiles of 16 x 16 pixels, row-major. Smallest 0: some
  /// pixel has no depth. Greatest 0: no pixel has a depth.
  std::vector<std::uint16_t> nearest, farthest;
  int tile_columns = 0, tile_rows = 0;

  /// Colour of each of `pixels`, or empty.
  std::vector<ColorImage::Pixel> colors;

  std::size_t off_palette_pixels = 0;  ///< Pixels whose label the palette lacks.
  bool labelled = false;

  [[nodiscard]] std::size_t outside() const { return pixels.size() - 1; }
  static float depth_m(std::uint32_t pixel) { return 0.001F * static_cast<float>(pixel & 0xFFFFU); }
  static LabelId label(std::uint32_t pixel) { return static_cast<LabelId>(pixel >> 16U); }
};

/// Makes depth views of one camera's images. If the camera has distortion, a table maps each pixel
/// of an ideal camera of the same focal lengths to a pixel of the real one. The ideal image covers
/// the whole view, but is at most twice as wide and high as the real one.
class DepthViewMaker {
 public:
  /// Throws std::invalid_argument for a camera without pixels or focal length.
  DepthViewMaker(const Camera& camera, double min_range_m, double max_range_m,
                 const LabelPalette& palette);

  /// The view of these images, valid until the next call. Precondition: both have the camera's
  /// size; labels and colours may be null.
  const DepthView& make(const DepthImage& depth, const LabelImage* labels,
                        const ColorImage* color = nullptr);

 private:
  void plan_rectification(const Camera& camera);
  std::size_t make_strip(int row, const DepthImage& depth, const LabelImage* labels);
  std::size_t fill(std::size_t begin, std::size_t end, const DepthImage& depth,
                   const LabelImage* labels);
  void summarise(int row);

  DepthView view_;
  std::uint32_t min_mm_ = 0, max_mm_ = 0;
  std::array<std::uint32_t, 256> codes_ = {};  // by label: known ones << 16, others kOutside
  std::vector<std::uint32_t> source_;          // source of each ideal pixel; empty: identity
  std::vector<std::size_t> off_palette_;       // pixels of each strip of tiles
};

}  // namespace km
