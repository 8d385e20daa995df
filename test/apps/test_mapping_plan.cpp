#include <catch2/catch.hpp>

#include "apps/robot/mapping_plan.hpp"
#include "test/support/temporary_folder.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

constexpr const char* kPalette = "name,red,green,blue,alpha,id\nroad,1,2,3,255,1\n";

// A recording's folders, empty except for the palette.
struct Recording {
  TemporaryFolder folder;

  Recording(std::initializer_list<const char*> sensors) {
    for (const char* sensor : sensors) fs::create_directories(folder.path() / "mav0" / sensor);
    folder.write("mav0/label_palette.csv", kPalette);
  }
  [[nodiscard]] std::optional<MappingPlan> plan(const MappingConfig& config,
                                                const SegmentationConfig& network = {}) const {
    return plan_mapping(config, {}, network, image_sources(folder.path()));
  }
};

TEST_CASE("Off is no plan, metric takes depth alone", "[robot][mapping]") {
  const Recording recording({"cam0", "cam1", "depth0", "label0"});
  CHECK_FALSE(recording.plan({}).has_value());
  const auto plan = recording.plan({.mode = MappingMode::kMetric});
  REQUIRE(plan.has_value());
  CHECK(plan->reads_depth());
  CHECK_FALSE(plan->reads_labels());
  CHECK(plan->palette.classes().empty());
}

TEST_CASE("Recorded depth and labels are preferred, others computed", "[robot][mapping]") {
  const Recording full({"cam0", "cam1", "depth0", "label0"});
  const Recording stereo({"cam0", "cam1"});
  MappingConfig config{.mode = MappingMode::kSemantic};
  const auto recorded = full.plan(config);
  CHECK(recorded->reads_depth());
  CHECK(recorded->reads_labels());
  CHECK(recorded->palette.find(1)->name == "road");

  SegmentationConfig network;
  network.network = "net.onnx";
  const auto computed = stereo.plan(config, network);
  CHECK(computed->sensor.depth == DepthFrom::kStereo);
  CHECK(computed->sensor.labels == LabelsFrom::kNetwork);
  network.palette = full.folder.write("own.csv", "name,red,green,blue,alpha,id\nsky,1,2,3,255,9\n");
  CHECK(stereo.plan(config, network)->palette.find(9)->name == "sky");
  CHECK(full.plan(config, network)->palette.find(1)->name == "road");  // name of a recorded label
  config.depth = DenseSource::kComputed;
  config.labels = DenseSource::kComputed;
  CHECK(full.plan(config, network)->sensor.depth == DepthFrom::kStereo);
  CHECK(full.plan(config, network)->sensor.labels == LabelsFrom::kNetwork);
}

TEST_CASE("Depth is used up to the range at which it is accurate enough", "[robot][mapping]") {
  Camera camera;
  camera.fx = 500.0;
  const StereoRig rig = rgbd_rig(camera, 0.1);
  const double range_m = usable_range_m(rig, 0.2);
  CHECK(range_m == Approx(6.3246).epsilon(1e-4));
  CHECK(depth_sigma_per_m(rig) * range_m * range_m == Approx(0.2));
  // A quarter of a pixel further away it is off by 0.2 m, to first order.
  const double disparity_px = 50.0 / range_m;
  CHECK(50.0 / (disparity_px - 0.25) - range_m == Approx(0.2).epsilon(0.05));
}

TEST_CASE("A bag has the images that its rig file names", "[robot][mapping]") {
  const MappingConfig metric{.mode = MappingMode::kMetric};
  const auto plan = [&](const SensorTopicNames& topics, const MappingConfig& config) {
    return plan_mapping(config, {}, {}, image_sources(topics, "rig.yaml"));
  };
  SensorTopicNames topics;
  topics.right = "/right";
  CHECK(plan(topics, metric)->sensor.depth == DepthFrom::kStereo);
  topics.depth = "/depth";
  CHECK(plan(topics, metric)->reads_depth());
  CHECK_THROWS_WITH(plan(topics, {.mode = MappingMode::kSemantic}),
                    Catch::Contains("no label images in rig.yaml"));
}

TEST_CASE("A map that is not possible is refused with the missing inputs", "[robot][mapping]") {
  const Recording stereo({"cam0", "cam1"});
  const Recording depth({"cam0", "depth0", "label0"});
  const auto refused = [](const Recording& recording, const MappingConfig& config,
                          const std::string& words) {
    CAPTURE(words);
    CHECK_THROWS_AS(recording.plan(config), ConfigError);
    CHECK_THROWS_WITH(recording.plan(config), Catch::Contains(words));
  };
  refused(stereo, {.mode = MappingMode::kMetric, .depth = DenseSource::kRecorded},
          "no depth images");
  refused(depth, {.mode = MappingMode::kMetric, .depth = DenseSource::kComputed},
          "no right camera");
  refused(stereo, {.mode = MappingMode::kSemantic}, "metric does without");
  refused(stereo, {.mode = MappingMode::kSemantic, .labels = DenseSource::kRecorded},
          "no label images");
  refused(depth, {.mode = MappingMode::kSemantic, .labels = DenseSource::kComputed},
          "segmentation.network names no file");
  depth.folder.write("mav0/label_palette.csv", "what is this");
  refused(depth, {.mode = MappingMode::kSemantic}, "label_palette.csv");
  fs::remove(depth.folder.path() / "mav0" / "label_palette.csv");
  refused(depth, {.mode = MappingMode::kSemantic}, "needs a table of the labels");
  CHECK_THROWS_WITH(plan_mapping({.mode = MappingMode::kMetric}, {}, {}, {}),
                    Catch::Contains("--graph"));
}

}  // namespace
}  // namespace km
