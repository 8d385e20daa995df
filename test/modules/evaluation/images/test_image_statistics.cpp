#include "modules/evaluation/images/image_statistics.hpp"

#include <catch2/catch.hpp>

#include "test/modules/evaluation/images/synthetic_images.hpp"

namespace km {
namespace {

GrayImage gray(const cv::Mat& image) {
  return {image.cols, image.rows, {image.datastart, image.dataend}};
}

StereoRig rig(int width, int height) {
  PinholeCamera camera;
  camera.width = width;
  camera.height = height;
  camera.fx = camera.fy = width;
  camera.cx = 0.5 * width;
  camera.cy = 0.5 * height;
  StereoRig result;
  result.cameras = {camera, camera};
  result.cameras[1].T_body_cam.translation().x() = 0.1;
  return result;
}

}  // namespace

TEST_CASE("One pass gives every section, the same every time", "[image_statistics]") {
  const auto [width, height] = GENERATE(table<int, int>({{320, 240}, {376, 241}}));
  const cv::Mat surface = texture(width + 40, height, 2);
  const auto run = [&, w = width, h = height] {
    ImageStatistics statistics(rig(w, h), {.stride = 2});
    for (int i = 0; i < 6; ++i)
      statistics.add({50'000'000 * (i + 1), gray(view_of(surface, 4 * i, 0, w, h)),
                      gray(view_of(surface, 4 * i + 8, 0, w, h))});
    CHECK(statistics.frames() == 6);
    return statistics.figures();
  };
  const auto figures = run();
  CHECK(figure(figures, "sequence", "frames") == 6);
  CHECK(figure(figures, "KLT survival", "1 frames") > 0.95);
  CHECK(figure(figures, "KLT, left to right", "depth [m] median") ==
        Approx(0.1 * width / 8).epsilon(0.02));
  CHECK(figure(figures, "grey levels", "image mean") == Approx(128).margin(3));
  CHECK(figure(figures, "standing still", "pairs of images") == 0);
  const auto again = run();
  REQUIRE(again.size() == figures.size());
  for (std::size_t i = 0; i < figures.size(); ++i) {
    CAPTURE(figures[i].section, figures[i].name);
    CHECK((figures[i].value == again[i].value ||
           (std::isnan(figures[i].value) && std::isnan(again[i].value))));
  }
}

TEST_CASE("Images without a corner leave gaps, not errors", "[image_statistics]") {
  const GrayImage wall{64, 48, std::vector<std::uint8_t>(64 * 48, 90)};
  ImageStatistics statistics(rig(64, 48));
  for (int i = 0; i < 3; ++i) statistics.add({50'000'000 * (i + 1), wall, wall});
  const auto figures = statistics.figures();
  CHECK(figure(figures, "corners", "mean") == 0);
  CHECK(std::isnan(figure(figures, "KLT survival", "1 frames")));
  CHECK(figure(figures, "gradient", "mean") == 0);
}

TEST_CASE("Options out of range are refused", "[image_statistics]") {
  CHECK_THROWS_AS(ImageStatistics(rig(64, 48), {.stride = 0}), std::invalid_argument);
  CHECK_THROWS_AS(ImageStatistics(rig(64, 48), {.max_step_s = 0.0}), std::invalid_argument);
}

}  // namespace km
