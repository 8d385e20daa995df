#include <catch2/catch.hpp>

#include <random>

#include "modules/diagnosis/examine_sensors.hpp"
#include "modules/diagnosis/examine_words.hpp"

namespace km {
namespace {

std::string ids_of(const Examination& result) {
  std::string ids;
  for (const Finding& finding : result.findings)
    ids += std::string(to_string(finding.severity)) + ' ' + finding.id + ' ';
  return ids;
}

// Images at 20 Hz, samples at 200 Hz, for ten seconds.
SensorSample regular() {
  SensorSample sample;
  for (Stamp k = 0; k < 200; ++k) sample.frames.push_back(k * 50'000'000);
  for (Stamp k = 0; k < 2000; ++k)
    sample.imu.push_back({.stamp = k * 5'000'000, .accel = {0.0, 0.0, 9.81}});
  return sample;
}

ImageQuality good_look() {
  return {.mean_level = 110.0, .saturated_share = 0.05, .sharpness = 0.8, .corners = 2000};
}

std::string looks_of(const ImageQuality& look) {
  SensorSample sample;
  sample.qualities.assign(10, look);
  return ids_of(examine_images(sample));
}

}  // namespace

TEST_CASE("Rates and gaps of a recording are found", "[diagnosis]") {
  SensorSample sample = regular();
  CHECK(ids_of(examine_streams(sample, {})).empty());
  SECTION("a gap of the images") {
    sample.frames.erase(sample.frames.begin() + 50, sample.frames.begin() + 60);
    CHECK(ids_of(examine_streams(sample, {})) == "warning frames.gap ");
  }
  SECTION("one missing image is no gap") {
    sample.frames.erase(sample.frames.begin() + 50);
    CHECK(ids_of(examine_streams(sample, {})).empty());
  }
  SECTION("few images") {
    std::vector<Stamp> few;
    for (std::size_t k = 0; k < sample.frames.size(); k += 4) few.push_back(sample.frames[k]);
    sample.frames = few;
    CHECK(ids_of(examine_streams(sample, {})) == "warning frames.rate ");
  }
  SECTION("a gap of the samples") {
    sample.imu.erase(sample.imu.begin() + 500, sample.imu.begin() + 520);
    CHECK(ids_of(examine_streams(sample, {})) == "warning imu.gap ");
  }
  SECTION("images missing between others") {
    sample.right_size = {752, 480};
    ReaderReport report;
    report.add(ReaderFault::kMissingBetween, "here", 20);  // 10 of each of two cameras
    const auto findings = examine_streams(sample, report).findings;
    REQUIRE(findings.size() == 1);
    CHECK_THAT(findings[0].what, Catch::Contains("20 images missing between others, 4.8 %"));
  }
  SECTION("no images") {
    sample.frames.clear();
    CHECK(ids_of(examine_streams(sample, {})) == "error recording.no_frames ");
  }
}

TEST_CASE("Faults of a reader become findings by their share", "[diagnosis]") {
  const SensorSample sample = regular();
  const auto with = [&](std::size_t count) {
    ReaderReport report;
    report.add(ReaderFault::kMissingImage, "cam1/data.csv line 7", count);
    return ids_of(examine_streams(sample, report));
  };
  CHECK(with(1) == "note recording.missing_images ");
  CHECK(with(20) == "warning recording.missing_images ");
  CHECK(with(300) == "error recording.missing_images ");
  ReaderReport report;
  report.add(ReaderFault::kNotFinite, "imu0/data.csv line 9", 15);
  CHECK_THAT(ids_of(examine_streams(sample, report)), Catch::StartsWith("note recording."));
}

TEST_CASE("Images that are dark, bright, blurred or empty are found", "[diagnosis]") {
  CHECK(looks_of(good_look()).empty());
  ImageQuality look = good_look();
  SECTION("dark") {
    look.mean_level = 12.0;
    CHECK(looks_of(look) == "warning images.dark ");
  }
  SECTION("bright") {
    look.saturated_share = 0.5;
    CHECK(looks_of(look) == "warning images.bright ");
  }
  SECTION("blurred") {
    look.sharpness = 0.52;
    CHECK(looks_of(look) == "warning images.blurred ");
  }
  SECTION("empty") {
    look.corners = 40;
    CHECK(looks_of(look) == "warning images.few_corners ");
  }
  CHECK(ids_of(examine_images({})).empty());
}

TEST_CASE("Gravity shows the unit of the accelerometer", "[diagnosis]") {
  const auto with = [](double norm) {
    SensorSample sample = regular();
    for (ImuSample& measured : sample.imu) measured.accel = {0.0, norm, 0.0};
    return ids_of(examine_inertial(sample, {}));
  };
  CHECK(with(9.81).empty());
  CHECK(with(10.5).empty());
  CHECK(with(1.0) == "error imu.accel_in_g ");
  CHECK(with(1002.0) == "error imu.accel_in_g ");
  CHECK(with(0.1) == "error imu.no_gravity ");
  CHECK(with(32.2) == "error imu.gravity ");
}

TEST_CASE("A vocabulary that maps all features to few words is found", "[diagnosis]") {
  // A word for each of 256 first bytes, in two levels of 16.
  VocabularyData tree{.branching = 16, .depth = 2};
  const auto descriptor = [](int byte) {
    BinaryDescriptor center{};
    center[0] = static_cast<std::uint8_t>(byte);
    for (std::size_t k = 1; k < center.size(); ++k)  // far from each other
      center[k] = static_cast<std::uint8_t>(byte * 37 + static_cast<int>(k) * byte * byte);
    return center;
  };
  tree.children = {16};
  tree.centers = {BinaryDescriptor{}};
  for (int k = 0; k < 16; ++k) tree.children.push_back(16), tree.centers.push_back(descriptor(k));
  for (int k = 0; k < 256; ++k) tree.children.push_back(0), tree.centers.push_back(descriptor(k));
  tree.idf.assign(256, 1.0F);
  const Vocabulary vocabulary(tree);
  std::mt19937 rng(1);
  std::vector<std::vector<BinaryDescriptor>> images(4, std::vector<BinaryDescriptor>(1000));
  const std::vector<std::vector<BinaryDescriptor>> alike = images;
  for (auto& image : images)
    for (BinaryDescriptor& one : image)
      for (std::uint8_t& byte : one) byte = static_cast<std::uint8_t>(rng());
  CHECK(ids_of(examine_words(alike, vocabulary)) == "warning vocabulary.coverage ");
  CHECK(ids_of(examine_words({}, vocabulary)).empty());
  const std::string varied = to_text(examine_words(images, vocabulary).figures);
  CHECK_THAT(varied, Catch::Contains("words distinguish 4000 features, of 256"));
}

}  // namespace km
