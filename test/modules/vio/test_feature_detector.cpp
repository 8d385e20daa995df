#include "modules/vio/feature_detector.hpp"

#include <catch2/catch.hpp>

#include "textured_plane.hpp"

namespace km {
namespace {

// White squares of 20 px every 40 px on black from (first, first) on. Their shading varies a
// little, because with equal levels a corner would tie with its neighbours.
GrayImage squares(int width, int height, int first) {
  GrayImage image{width, height, {}};
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const bool inside =
          x >= first && y >= first && (x - first) % 40 < 20 && (y - first) % 40 < 20;
      const int shading = (7 * x + 13 * y) % 11;
      image.pixels.push_back(static_cast<std::uint8_t>((inside ? 230 : 20) + shading));
    }
  }
  return image;
}

TEST_CASE("Detected corners are at the true corners", "[vio]") {
  TrackerConfig config;
  config.max_features = 1000;
  config.min_distance_px = 8;
  const ImagePyramid image(squares(240, 160, 30), 2, true);
  FeatureDetector detector(config);
  const auto corners = detector.detect(image, {}, 1000);
  // 6 x 4 squares, the last row and column cut: four corners each in 30..229 x 30..149.
  CHECK(corners.size() >= 4 * 5 * 3);
  for (const Eigen::Vector2f& px : corners) {
    const auto off = [](float v) {
      const float phase = std::fmod(v - 30.0F + 0.5F, 20.0F);  // Edges are between pixels.
      return std::min(phase, 20.0F - phase);
    };
    CAPTURE(px.transpose());
    CHECK(off(px.x()) < 3.0F);
    CHECK(off(px.y()) < 3.0F);
  }
}

TEST_CASE("Corners keep their distance, avoid occupied places and cover the image", "[vio]") {
  const StereoRig rig = test_rig();
  const GrayImage picture = TexturedPlane{}.render(rig.cameras[0], SE3::Identity());
  TrackerConfig config;
  config.max_features = 60;
  config.min_distance_px = 15;
  const ImagePyramid image(picture, 2, true);
  FeatureDetector detector(config);
  const std::vector<Eigen::Vector2f> occupied = {{100, 100}, {200, 50}, {103, 108}};
  const auto corners = detector.detect(image, occupied, 57);
  REQUIRE(corners.size() > 40);
  REQUIRE(corners.size() <= 57);
  std::vector<int> quadrants(4, 0);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    for (const Eigen::Vector2f& px : occupied) CHECK((corners[i] - px).norm() >= 15.0F);
    for (std::size_t j = 0; j < i; ++j) CHECK((corners[i] - corners[j]).norm() >= 15.0F);
    ++quadrants[(corners[i].x() > 188 ? 1U : 0U) + (corners[i].y() > 120 ? 2U : 0U)];
  }
  for (const int count : quadrants) CHECK(count >= 8);
}

}  // namespace
}  // namespace km
