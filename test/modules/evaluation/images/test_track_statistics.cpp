#include "modules/evaluation/images/track_statistics.hpp"

#include <catch2/catch.hpp>

#include "test/modules/evaluation/images/synthetic_images.hpp"

namespace km {
namespace {

constexpr int kTrackWidth = 320;
constexpr int kTrackHeight = 240;
constexpr Stamp kPeriod = 50'000'000;

// A camera that moves over a surface along x by `step_px` per frame.
void pass_over(TrackStatistics& statistics, int frames, int step_px) {
  const cv::Mat surface = texture(kTrackWidth + frames * step_px, kTrackHeight, 7);
  for (int i = 0; i < frames; ++i) {
    const KltImage image =
        make_klt_image(view_of(surface, i * step_px, 0, kTrackWidth, kTrackHeight));
    const double flow_px = statistics.add((i + 1) * kPeriod, image, corners_of(image.image));
    if (i == 0) CHECK(std::isnan(flow_px));
    if (i > 0) CHECK(flow_px == Approx(step_px).margin(0.05));
  }
}

}  // namespace

TEST_CASE("Corners of a shifted image survive until they leave it", "[image_statistics]") {
  const int step_px = 4;
  TrackStatistics statistics(1, 0.25);
  pass_over(statistics, 12, step_px);
  const auto figures = figures_of(statistics);
  // Corners are evenly distributed over the width: step * n / width of them leave in n frames. Two
  // percent are random (there are about 250). Some corners whose window extends over the rim fail
  // at once.
  const double chance = 0.02;
  const double at_rim = 0.03;
  for (const int n : {1, 2, 5, 10}) {
    CAPTURE(n);
    const double inside = 1.0 - step_px * n / double{kTrackWidth};
    const double survival = figure(figures, "KLT survival", std::to_string(n) + " frames");
    CHECK(survival < inside + chance);
    CHECK(survival > inside - chance - at_rim);
  }
  CHECK(std::isnan(figure(figures, "KLT survival", "20 frames")));
  CHECK(figure(figures, "KLT, one step", "fail otherwise") < 0.01);
  CHECK(figure(figures, "KLT, one step", "frames, flow 3-6 px") == 11);
  CHECK(figure(figures, "KLT, one step", "survive, flow 3-6 px") > 0.95);
  CHECK(std::isnan(figure(figures, "KLT, one step", "survive, flow 6-10 px")));
  CHECK(figure(figures, "median flow", "median") == Approx(step_px).margin(0.05));
}

TEST_CASE("Nothing survives when the scene is replaced", "[image_statistics]") {
  TrackStatistics statistics(1, 0.25);
  for (unsigned i = 0; i < 3; ++i) {
    const KltImage image = make_klt_image(texture(kTrackWidth, kTrackHeight, 100 + i));
    statistics.add((i + 1) * kPeriod, image, corners_of(image.image));
  }
  const double chance = 0.1;  // a corner may match something similar nearby
  CHECK(figure(figures_of(statistics), "KLT survival", "1 frames") < chance);
}

TEST_CASE("A missing frame is no step of one frame but tracks continue", "[image_statistics]") {
  TrackStatistics statistics(10, 0.25);
  const cv::Mat surface = texture(kTrackWidth + 40, kTrackHeight, 7);
  const int places[] = {0, 4, 8, 16};
  const Stamp times[] = {1, 2, 3, 5};
  double flow_px = 0.0;
  for (int i = 0; i < 4; ++i) {
    const KltImage image =
        make_klt_image(view_of(surface, places[i], 0, kTrackWidth, kTrackHeight));
    flow_px = statistics.add(times[i] * kPeriod, image, corners_of(image.image));
  }
  CHECK(std::isnan(flow_px));
  const auto figures = figures_of(statistics);
  CHECK(figure(figures, "median flow", "max") == Approx(4.0).margin(0.05));
  CHECK(figure(figures, "KLT survival", "2 frames") > 0.9);
}

TEST_CASE("A long gap ends all tracks", "[image_statistics]") {
  TrackStatistics statistics(1, 0.25);
  const KltImage image = make_klt_image(texture(kTrackWidth, kTrackHeight, 7));
  const auto corners = corners_of(image.image);
  statistics.add(kPeriod, image, corners);
  CHECK(statistics.add(2 * kPeriod, image, corners) == Approx(0.0).margin(1e-6));
  CHECK(std::isnan(statistics.add(8 * kPeriod, image, corners)));
  const auto figures = figures_of(statistics);
  CHECK(std::isnan(figure(figures, "KLT survival", "2 frames")));
  CHECK(figure(figures, "corners", "mean") == static_cast<double>(corners.size()));
}

}  // namespace km
