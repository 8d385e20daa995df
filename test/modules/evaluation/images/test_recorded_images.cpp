#include <catch2/catch.hpp>

#include "modules/evaluation/images/image_statistics.hpp"
#include "modules/sensors/euroc_reader.hpp"
#include "test/modules/evaluation/images/synthetic_images.hpp"
#include "test/support/shared_data.hpp"

// Figures of MH_01_easy as an independent implementation measured them on all images of 0 to 15 s;
// here on few, so that chance has a say.

namespace km {
namespace {

void check_near(const std::vector<ImageFigure>& figures, const std::string& section,
                const std::string& name, double recorded, double share) {
  CAPTURE(section, name);
  CHECK(figure(figures, section, name) == Approx(recorded).epsilon(share));
}

}  // namespace

TEST_CASE("Recorded images give the figures recorded of them", "[image_statistics]") {
  const auto dataset = shared_data("euroc/MH_01_easy");
  if (!dataset) return;
  EurocReader reader(*dataset, {.from_s = 0.0, .to_s = 15.0});
  ImageStatistics statistics(reader.rig().stereo, {.stride = 1});
  for (int i = 0; const auto packet = reader.next(); ++i)
    if (i % 12 == 0) statistics.add(*packet->frame);
  const auto figures = statistics.figures();
  REQUIRE(statistics.frames() == 25);
  const double few = 0.04;  // 25 of 300 images, mean of a quantity that varies by a fifth or less
  check_near(figures, "corners", "mean", 458, few);
  check_near(figures, "other corners", "Shi-Tomasi, right, mean", 445, few);
  check_near(figures, "other corners", "FAST at 20, left, mean", 2393, few);
  check_near(figures, "grey", "image mean", 129, few);
  check_near(figures, "grey", "image standard deviation", 83, few);
  check_near(figures, "gradient", "mean", 7.7, few);
  check_near(figures, "gradient", "median", 4.2, few);
  check_near(figures, "gradient", "share above 10", 0.23, few);
  check_near(figures, "exposure", "right over left, mean", 0.98, few);
  check_near(figures, "noise", "within one image, flat pixels", 0.44, few);
  check_near(figures, "ORB, left to right", "share within 1.5 px of the epipolar line", 0.715, few);
  const double varied = 0.12;  // vary by more than a third
  check_near(figures, "motion blur", "all frames, median", 331, varied);
  check_near(figures, "ORB, left to right", "matches", 206, varied);
  check_near(figures, "KLT, left to right", "pass, share of corners", 0.368, varied);
  check_near(figures, "KLT, left to right", "also within 1.5 px of the epipolar line", 0.306,
             varied);
  check_near(figures, "KLT, left to right", "epipolar error [px] median", 0.25, varied);
  check_near(figures, "KLT, left to right", "depth [m] median", 2.7, varied);
}

TEST_CASE("Recorded corners survive as recorded", "[image_statistics]") {
  const auto dataset = shared_data("euroc/MH_01_easy");
  if (!dataset) return;
  EurocReader reader(*dataset, {.from_s = 0.0, .to_s = 7.5});
  TrackStatistics tracks(30, 0.25);
  std::vector<ImageFigure> figures;
  while (const auto packet = reader.next()) {
    GrayImage left = packet->frame->left;
    const KltImage image =
        make_klt_image(cv::Mat(left.height, left.width, CV_8UC1, left.pixels.data()));
    tracks.add(packet->frame->stamp, image, corners_of(image.image));
  }
  tracks.append_to(figures);
  check_near(figures, "corners", "mean", 485, 0.005);  // all images were looked at
  const double few_starts = 0.06;                      // 5 of 22
  check_near(figures, "KLT survival", "1 frames", 0.943, few_starts);
  check_near(figures, "KLT survival", "10 frames", 0.780, few_starts);
  check_near(figures, "KLT survival", "20 frames", 0.625, few_starts);
}

}  // namespace km
