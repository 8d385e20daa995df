#include <type_traits>

#include "apps/robot/robot_config.hpp"
#include "apps/robot/robot_input.hpp"
#include "apps/shipped_file.hpp"
#include "runtime/config_text.hpp"
#include "test/support/temporary_folder.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

// Converts to every member of an aggregate.
struct Anything {
  template <typename T>
  operator T() const {  // NOLINT(google-explicit-constructor)
    return T();
  }
};

// Number of members of an aggregate.
template <typename Config, typename... Members>
constexpr std::size_t member_count() {
  if constexpr (requires { Config{Members{}..., Anything{}}; })
    return member_count<Config, Members..., Anything>();
  else
    return sizeof...(Members);
}

struct FieldCounter : FieldVisitor<FieldCounter> {
  std::size_t count = 0;
  void visit(const char* key, const auto& /*value*/, const auto& /*accepted*/,
             const std::string& text) {
    CAPTURE(key);
    CHECK_FALSE(text.empty());
    ++count;
  }
};

TEST_CASE("Every member of every section is a key, and has a text") {
  RobotConfig config;
  std::size_t sections = 0;
  config.visit_sections([&](auto& section) {
    using Section = std::remove_cvref_t<decltype(section)>;
    CAPTURE(Section::kSection);
    FieldCounter fields;
    section.visit_fields(fields);
    CHECK(fields.count == member_count<Section>());
    ++sections;
  });
  CHECK(sections == member_count<RobotConfig>() - 1);  // beside `effective`
}

TEST_CASE("config/robot.yaml shows every key with its default") {
  std::ifstream stream("config/robot.yaml");
  const std::string shipped(std::istreambuf_iterator<char>(stream), {});
  RobotConfig defaults;
  std::string expected;
  defaults.visit_sections([&](auto& section) {
    if (&section != static_cast<void*>(&defaults.dds)) expected += '\n' + to_yaml(section);
  });
  CHECK(shipped.substr(shipped.find("\n\n") + 1) == expected);
}

TEST_CASE("The effective configuration gives the same configuration again") {
  RobotOptions options;
  options.configs = {"config/datasets/tunnels.yaml"};
  options.settings = {"vio.start_s=1", "dds.team=blue"};
  const std::string effective = load_robot_config(options).effective;
  const TemporaryFolder folder;
  RobotOptions again;
  again.configs = {folder.write("effective.yaml", effective)};
  CHECK(load_robot_config(again).effective == effective);
}

TEST_CASE("Later sources have priority: profile, files, settings, options") {
  RobotOptions options;
  options.link = "wifi";
  options.settings = {"dds.domain=7", "dds.lease_s=33", "dds.interface=eth9"};
  options.domain = 9;
  const RobotConfig config = load_robot_config(options);
  CHECK(config.run.link == "wifi");
  CHECK(config.dds.max_message_bytes < 1500);  // from the profile
  CHECK(config.dds.lease_s == 33.0);
  CHECK(config.dds.interface == "eth9");
  CHECK(config.dds.domain == 9);
  CHECK_FALSE(config.view.on);  // only if the owner asks for it
  options.view = true;
  CHECK(load_robot_config(options).view.on);
  options.peers = {"10.0.0.2"};
  CHECK(load_robot_config(options).dds.discovery == Discovery::kPeers);
}

TEST_CASE("Every shipped configuration loads") {
  std::vector<std::string> files = {"config/robot.yaml"};
  for (const auto& entry : fs::directory_iterator("config/datasets"))
    files.push_back(entry.path().string());
  CHECK(files.size() > 3);
  for (const std::string& file : files)
    for (const char* link : {"wired", "wifi", "intermittent"}) {
      CAPTURE(file, link);
      RobotOptions options;
      options.configs = {file};
      options.link = link;
      CHECK_NOTHROW(load_robot_config(options));
    }
}

TEST_CASE("A link profile that does not exist is named with the places looked at") {
  RobotOptions options;
  options.link = "pigeon";
  CHECK_THROWS_WITH(load_robot_config(options),
                    Contains("qos/pigeon.yaml") && Contains("config/qos/pigeon.yaml"));
}

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

TEST_CASE("A shipped file is found by its name") {
  CHECK(find_named_file("datasets", "euroc") == "config/datasets/euroc.yaml");
  CHECK(find_named_file("rigs", "d455") == "config/rigs/realsense_d455.yaml");
  CHECK(find_named_file("rigs", "config/datasets/euroc.yaml") == "config/datasets/euroc.yaml");
  CHECK_THROWS_WITH(find_named_file("rigs", "d500"),
                    "no file d500, and none of this name in rigs: oak_d, realsense_d435i, "
                    "realsense_d455, zed2");
}

TEST_CASE("Off is no plan, metric takes depth alone") {
  const Recording recording({"cam0", "cam1", "depth0", "label0"});
  CHECK_FALSE(recording.plan({}).has_value());
  const auto plan = recording.plan({.mode = MappingMode::kMetric});
  REQUIRE(plan.has_value());
  CHECK(plan->reads_depth());
  CHECK_FALSE(plan->reads_labels());
  CHECK(plan->palette.classes().empty());
}

TEST_CASE("Recorded depth and labels are preferred, others computed") {
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

TEST_CASE("Noise of depth follows from the camera that measures it") {
  const StereoRig rig = rgbd_rig({.fx = 500.0, .fy = 500.0}, 0.1);
  MappingPlan plan;
  plan.sensor.depth = DepthFrom::kStereo;
  CHECK(depth_sigma_per_m(rig, plan) == Approx(0.36 / 50.0));
  plan.sensor.depth = DepthFrom::kImages;
  CHECK(depth_sigma_per_m(rig, plan) == Approx(0.125 / 50.0));
  plan.depth_baseline_m = 0.25;  // beside a stereo pair
  CHECK(depth_sigma_per_m(rig, plan) == Approx(0.001));
}

TEST_CASE("A bag has the images that its rig file names") {
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
                    Contains("no label images in rig.yaml"));
}

TEST_CASE("A map that is not possible is refused with the missing inputs") {
  const Recording stereo({"cam0", "cam1"});
  const Recording depth({"cam0", "depth0", "label0"});
  const auto refused = [](const Recording& recording, const MappingConfig& config,
                          const std::string& words) {
    CAPTURE(words);
    CHECK_THROWS_AS(recording.plan(config), ConfigError);
    CHECK_THROWS_WITH(recording.plan(config), Contains(words));
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
  CHECK_THROWS_WITH(plan_mapping({.mode = MappingMode::kMetric}, {}, {}, {}), Contains("--graph"));
}

}  // namespace
}  // namespace km
