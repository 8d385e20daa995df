#include <catch2/catch.hpp>
#include <limits>
#include <nlohmann/json.hpp>
#include <sstream>

#include "modules/evaluation/images/image_figure.hpp"
#include "modules/evaluation/images/image_statistics.hpp"
#include "modules/sensors/node/euroc_rig.hpp"
#include "test/modules/evaluation/images/synthetic_images.hpp"
#include "test/support/shared_data.hpp"

// Figures of MH_01_easy that an independent implementation measured on all images of 0 to 15 s.
// Here few images are used, so that the figures vary by chance.

namespace km {
namespace {

GrayImage gray(const cv::Mat& image) {
  return {image.cols, image.rows, {image.datastart, image.dataend}};
}

TEST_CASE("One pass gives every section and always the same figures", "[image_statistics]") {
  const auto [width, height] = GENERATE(table<int, int>({{320, 240}, {376, 241}}));
  const cv::Mat surface = texture(width + 40, height, 2);
  const auto run = [&, w = width, h = height] {
    ImageStatistics statistics(aligned_rig(w, h, w), {.stride = 2});
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

TEST_CASE("Images without a corner give missing figures and no errors", "[image_statistics]") {
  const GrayImage wall{64, 48, std::vector<std::uint8_t>(64 * 48, 90)};
  ImageStatistics statistics(aligned_rig(64, 48, 64));
  for (int i = 0; i < 3; ++i) statistics.add({50'000'000 * (i + 1), wall, wall});
  const auto figures = statistics.figures();
  CHECK(figure(figures, "corners", "mean") == 0);
  CHECK(std::isnan(figure(figures, "KLT survival", "1 frames")));
  CHECK(figure(figures, "gradient", "mean") == 0);
}

TEST_CASE("Options out of range are refused", "[image_statistics]") {
  CHECK_THROWS_AS(ImageStatistics(aligned_rig(64, 48, 64), {.stride = 0}), std::invalid_argument);
  CHECK_THROWS_AS(ImageStatistics(aligned_rig(64, 48, 64), {.max_step_s = 0.0}),
                  std::invalid_argument);
}

void check_near(const std::vector<ImageFigure>& figures, const std::string& section,
                const std::string& name, double recorded, double share) {
  CAPTURE(section, name);
  CHECK(figure(figures, section, name) == Approx(recorded).epsilon(share));
}

TEST_CASE("Recorded images give their recorded figures", "[image_statistics]") {
  const auto dataset = shared_data("euroc/MH_01_easy");
  if (!dataset) return;
  EurocReader reader = open_euroc(*dataset, {.from_s = 0.0, .to_s = 15.0});
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
  EurocReader reader = open_euroc(*dataset, {.from_s = 0.0, .to_s = 7.5});
  TrackStatistics tracks(30, 0.25);
  std::vector<ImageFigure> figures;
  while (const auto packet = reader.next()) {
    GrayImage left = packet->frame->left;
    const KltImage image =
        make_klt_image(cv::Mat(left.height, left.width, CV_8UC1, left.pixels.data()));
    tracks.add(packet->frame->stamp, image, corners_of(image.image));
  }
  tracks.append_to(figures);
  check_near(figures, "corners", "mean", 485, 0.005);  // all images are used
  const double few_starts = 0.06;                      // 5 of 22
  check_near(figures, "KLT survival", "1 frames", 0.943, few_starts);
  check_near(figures, "KLT survival", "10 frames", 0.780, few_starts);
  check_near(figures, "KLT survival", "20 frames", 0.625, few_starts);
}

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

const std::vector<ImageFigure> kReference = {
    {"corners", "mean", 100.0, 0},    {"corners", "p5", 50.0, 0},
    {"step", "frames, flow", 9.0, 0}, {"step", "survive, flow 3-6 px", 0.9, 3},
    {"step", "never had", kNone, 3},  {"step", "only here", 1.0, 3}};
const std::vector<ImageFigure> kOther = {{"corners", "mean", 120.0, 0},
                                         {"corners", "p5", 20.0, 0},
                                         {"step", "frames, flow", 1.0, 0},
                                         {"step", "survive, flow 3-6 px", 0.675, 3},
                                         {"step", "never had", 0.5, 3}};

TEST_CASE("A table has a row for each figure below its heading", "[image_statistics]") {
  const std::string text = to_table(kReference);
  CHECK_THAT(text, Catch::StartsWith("corners\n  mean ") && Catch::Contains(" 100\n") &&
                       Catch::Contains("\n\nstep\n") && Catch::Contains(" 0.900\n") &&
                       Catch::Contains(" -\n"));
}

TEST_CASE("A comparison marks figures that differ by more than a quarter", "[image_statistics]") {
  const std::string text = to_comparison(kReference, kOther, "recorded", "rendered");
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    CAPTURE(line);
    const bool marked = line.ends_with("<--");
    CHECK(marked == (line.find("  p5 ") != line.npos));  // exactly a quarter is not marked
    CHECK(line.find("only here") == line.npos);
  }
  CHECK_THAT(text, Catch::Contains("1.20") && Catch::Contains("0.75") &&
                       Catch::EndsWith(
                           "1 of 3 rows differ by more than 25 %; of those at like flow 0 of 1\n"));
}

TEST_CASE("The JSON of a comparison has ratio and verdict in each row", "[image_statistics]") {
  const std::string text = json_text(comparison_json(kReference, kOther));
  std::string flat;
  for (const char c : text)
    if (c != ' ' && c != '\n') flat += c;
  CHECK_THAT(flat,
             Catch::Contains(R"("other":120.0,"ratio":1.2,"differs":false)") &&
                 Catch::Contains(R"("other":20.0,"ratio":0.4,"differs":true)") &&
                 Catch::Contains(R"("reference":null,"other":0.5,"ratio":null,"differs":null)") &&
                 !Catch::Contains("onlyhere") && Catch::EndsWith(R"("compared":3,"differing":1})"));
}

TEST_CASE("The JSON nests figures in their sections with null for a missing figure",
          "[image_statistics]") {
  const std::string text = json_text(to_json(kReference));
  CHECK_THAT(text, Catch::Contains("\"corners\": {") && Catch::Contains("\"p5\": 50") &&
                       Catch::Contains("\"never had\": null"));
}

}  // namespace
}  // namespace km
