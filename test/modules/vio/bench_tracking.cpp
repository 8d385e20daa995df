// Quality and time of the feature tracker on MH_01_easy, 0 to 15 s; run bin/bench_tracking by hand.
#include <algorithm>
#include <catch2/catch.hpp>
#include <iomanip>
#include <iostream>
#include <opencv2/core/utility.hpp>

#include "recorded_tracking.hpp"
#include "test/support/shared_data.hpp"

namespace km {
namespace {

void print_statistics(const TrackingRun& run) {
  const auto mean = [&run](auto&& count) {
    double sum = 0.0;
    for (std::size_t i = 0; i < run.frames.size(); ++i) sum += static_cast<double>(count(i));
    return sum / static_cast<double>(run.frames.size());
  };
  const auto& s = run.statistics;
  std::cout << "a frame: features "
            << mean([&](std::size_t i) { return run.frames[i].features.size(); }) << ", stereo "
            << mean([&](std::size_t i) {
                 const auto& f = run.frames[i].features;
                 return std::count_if(f.begin(), f.end(),
                                      [](const auto& x) { return x.right.has_value(); });
               })
            << ", detected " << mean([&](std::size_t i) { return s[i].detected; })
            << "\n  dropped: lost " << mean([&](std::size_t i) { return s[i].lost; })
            << ", backward " << mean([&](std::size_t i) { return s[i].backward; }) << ", crowded "
            << mean([&](std::size_t i) { return s[i].crowded; }) << ", motion "
            << mean([&](std::size_t i) { return s[i].motion; }) << "\n  no right: start "
            << mean([&](std::size_t i) { return s[i].stereo.no_start; }) << ", dissimilar "
            << mean([&](std::size_t i) { return s[i].stereo.dissimilar; }) << ", epipolar "
            << mean([&](std::size_t i) { return s[i].stereo.epipolar; }) << ", motion "
            << mean([&](std::size_t i) { return s[i].stereo_motion; }) << '\n';
}

void print_errors(const char* name, const ErrorSummary& e) {
  std::cout << "  " << name << ": median " << e.median_px << ", p90 " << e.p90_px
            << " px, beyond 3 px " << 100.0 * e.outlier_share << " %, n " << e.count << '\n';
}

TEST_CASE("tracking MH_01_easy 0-15 s", "[!benchmark]") {
  const auto folder = shared_data("euroc/MH_01_easy");
  if (!folder) return;
  cv::setNumThreads(1);
  const Recording recording = read_recording(*folder, 0.0, 15.0);
  std::cout << std::fixed << std::setprecision(3);
  const TrackingRun run = run_tracker(recording, TrackerConfig{});
  print_statistics(run);
  std::cout << "survival:";
  for (const std::size_t gap : {1, 5, 10, 20, 40}) {
    std::cout << "  " << gap << ": " << survival(run, gap);
  }
  std::cout << '\n';
  print_errors("epipolar", epipolar_errors(recording, run));
  for (const std::size_t gap : {1, 5, 10, 20}) {
    const ReprojectionErrors errors = reprojection_errors(recording, run, gap);
    std::cout << gap << " images later; fit off by " << errors.fit_translation_mm << " mm, "
              << errors.fit_rotation_deg << " deg (median)\n";
    print_errors("left, true motion", errors.left);
    print_errors("right, true motion", errors.right);
    print_errors("left, fitted motion", errors.fitted_left);
  }
  std::vector<double> ms = run.milliseconds;
  std::sort(ms.begin(), ms.end());
  std::cout << "time of a stereo pair: median " << ms[ms.size() / 2] << ", p95 "
            << ms[ms.size() * 95 / 100] << ", max " << ms.back() << " ms\n";
}

}  // namespace
}  // namespace km
