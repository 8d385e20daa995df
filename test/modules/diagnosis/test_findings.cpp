#include <nlohmann/json.hpp>

#include "modules/diagnosis/examine_sensors.hpp"
#include "modules/diagnosis/finding.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

Finding finding_of(const char* id, Severity severity) {
  return {.id = id, .severity = severity, .what = "7 of 9", .means = "m", .to_do = "t"};
}

}  // namespace

TEST_CASE("Findings are sorted by severity, and the most severe gives the exit code") {
  std::vector<Finding> findings = {
      finding_of("a", Severity::kNote), finding_of("b", Severity::kError),
      finding_of("c", Severity::kNote), finding_of("d", Severity::kWarning),
      finding_of("e", Severity::kError)};
  sort_by_severity(findings);
  std::string order;
  for (const Finding& finding : findings) order += finding.id;
  CHECK(order == "bedac");
  CHECK(exit_code_of(findings) == 2);
  CHECK(exit_code_of(std::span(findings).last(3)) == 1);
  CHECK(exit_code_of(std::span(findings).last(2)) == 0);
  CHECK(exit_code_of({}) == 0);
}

TEST_CASE("A finding is three lines for people") {
  Finding finding = finding_of("stereo.swapped", Severity::kWarning);
  CHECK(to_text(std::span(&finding, 1)) ==
        "warning stereo.swapped: 7 of 9\n  means: m\n  to do: t\n");
  finding.to_do.clear();
  CHECK(to_text(std::span(&finding, 1)) == "warning stereo.swapped: 7 of 9\n  means: m\n");
  CHECK(to_text(std::vector<Finding>()).empty());
}

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

}  // namespace

TEST_CASE("Rates and gaps of a recording are found") {
  struct Case {
    std::string ids;
    void (*change)(SensorSample&);
  };
  const Case c =
      GENERATE(Case{"", [](auto&) {}},
               Case{"warning frames.gap ",
                    [](auto& sample) {
                      sample.frames.erase(sample.frames.begin() + 50, sample.frames.begin() + 60);
                    }},
               Case{"",  // one missing image is no gap
                    [](auto& sample) { sample.frames.erase(sample.frames.begin() + 50); }},
               Case{"warning frames.rate ",
                    [](auto& sample) {
                      std::erase_if(sample.frames, [k = 0](Stamp) mutable { return k++ % 4 != 0; });
                    }},
               Case{"warning frames.rate ",  // images of one instant have no rate
                    [](auto& sample) {
                      sample.frames = {5, 5, 5};
                    }},
               Case{"warning imu.gap ",
                    [](auto& sample) {
                      sample.imu.erase(sample.imu.begin() + 500, sample.imu.begin() + 520);
                    }},
               Case{"warning imu.rate ",  // 20 Hz without a gap
                    [](auto& sample) {
                      std::erase_if(sample.imu, [k = 0](auto&) mutable { return k++ % 10 != 0; });
                    }},
               Case{"error frames.stamps ",  // microseconds as nanoseconds of a second
                    [](auto& sample) {
                      for (Stamp& t : sample.frames) t -= t % 1'000'000'000 / 1000 * 999;
                    }},
               Case{"warning frames.clock ",  // from 1970 to today
                    [](auto& sample) {
                      for (std::size_t k = 50; k < sample.frames.size(); ++k)
                        sample.frames[k] += 1'700'000'000'000'000'000;
                    }},
               Case{"error recording.no_frames ", [](auto& sample) { sample.frames.clear(); }});
  CAPTURE(c.ids);
  SensorSample sample = regular();
  c.change(sample);
  const Examination result = examine_streams(sample, {});
  CHECK(ids_of(result) == c.ids);
  if (c.ids == "warning frames.gap ")
    CHECK_THAT(result.findings[0].what, EndsWith("0.55 s, 2.5 s after the first image"));
}

TEST_CASE("Faults of a reader become findings by their share") {
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
  CHECK_THAT(ids_of(examine_streams(sample, report)), StartsWith("note recording."));
  ReaderReport of_samples;  // half of 4000 samples, all depth images of half the frames
  of_samples.add(ReaderFault::kUnorderedSample, "imu0/data.csv line 9", 2000);
  of_samples.add(ReaderFault::kWrongImageFormat, "depth0/1.png", 100);
  const Examination found = examine_streams(sample, of_samples);
  CHECK_THAT(found.findings.at(0).what, StartsWith("2000 inertial samples out of order, 50 %"));
  CHECK(finding_of(ReaderFault::kUnorderedSample, {715, "here"}, 1401).severity ==
        Severity::kWarning);
  CHECK_THAT(finding_of(ReaderFault::kRepeatedSample, {1072, "here"}, 1430).means,
             Contains("uses the first sample of each stamp"));
  CHECK(finding_of(ReaderFault::kRepeatedSample, {1429, "here"}, 1430).severity ==
        Severity::kError);
  CHECK(finding_of(ReaderFault::kClockSetBack, {1, "here"}, 1400).severity == Severity::kWarning);
  CHECK_THAT(found.findings.at(1).what, StartsWith("100 images of the wrong format, 50 %"));
  SensorSample stereo = sample;
  stereo.right_size = {752, 480};
  ReaderReport missing;
  missing.add(ReaderFault::kMissingBetween, "here", 20);  // 10 of each of two cameras
  CHECK_THAT(examine_streams(stereo, missing).findings.at(0).what,
             Contains("20 images missing between others, 4.8 %"));
}

TEST_CASE("Images that are dark, bright, blurred or empty are found") {
  const auto looks_of = [](double level, double saturated, double sharpness, std::size_t corners) {
    SensorSample sample;
    sample.qualities.assign(10, {level, saturated, sharpness, corners});
    return ids_of(examine_images(sample));
  };
  CHECK(looks_of(110.0, 0.05, 0.8, 2000).empty());
  CHECK(looks_of(12.0, 0.05, 0.8, 2000) == "warning images.dark ");
  CHECK(looks_of(110.0, 0.5, 0.8, 2000) == "warning images.bright ");
  CHECK(looks_of(110.0, 0.05, 0.52, 2000) == "warning images.blurred ");
  CHECK(looks_of(110.0, 0.05, 0.8, 40) == "warning images.few_corners ");
  CHECK(ids_of(examine_images({})).empty());
}

TEST_CASE("Gravity shows the unit of the accelerometer") {
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
  CHECK(with(32.2) == "warning imu.gravity ");
}

TEST_CASE("A vocabulary that maps all features to few words is found") {
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
  CHECK_THAT(varied, Contains("words distinguish 4000 features, of 256"));
}

}  // namespace km
