#include <nlohmann/json.hpp>

#include "apps/robot/results.hpp"
#include "apps/robot/run_summary.hpp"
#include "apps/robot/status.hpp"
#include "test/support/temporary_folder.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

// Gives every field, also future ones, a different value that is not its default.
struct Filler {
  int next = 1;

  template <typename T>
  void field(const char* name, std::optional<T>& value) {
    field(name, value.emplace());
  }
  template <typename T>
  void field(const char* /*name*/, T& value) {
    const int number = next++;
    if constexpr (std::is_same_v<T, std::vector<Finding>>)
      value = {{"a.b", Severity::kWarning, "7 of 9", "x", "y"},
               {"c.d", Severity::kNote, "8", "", ""}};
    else if constexpr (requires { value.visit_fields(*this); })
      value.visit_fields(*this);
    else if constexpr (requires { visit_fields(value, *this); })
      visit_fields(value, *this);
    else if constexpr (std::is_arithmetic_v<T>)
      value = static_cast<T>(std::is_floating_point_v<T> ? number / 7.0 : number);
    else if constexpr (requires { value.append("x"); })
      value = "text \"" + std::to_string(number) + "\"\n";
    else if constexpr (requires { value["x"].append("x"); })
      value["x"] = "text";
    else if constexpr (requires { value["x"]; })
      value["x"] = static_cast<typename T::mapped_type>(std::numeric_limits<std::uint64_t>::max() -
                                                        static_cast<std::uint64_t>(number));
    else
      value = {static_cast<typename T::value_type>(number), 65535};
  }
};

RunSummary full_summary() {
  RunSummary summary;
  Filler filler;
  summary.visit_fields(filler);
  return summary;
}

}  // namespace

TEST_CASE("A summary with all possible values is read as it was written") {
  const TemporaryFolder folder;
  const std::string full = json_text(full_summary()), least = json_text(RunSummary{});
  CHECK(json_text(read_summary(folder.write("full.json", full))) == full);
  CHECK(json_text(read_summary(folder.write("default.json", least))) == least);
  CHECK(json_text(read_summary(folder.write("empty.json", "{}"))) == least);
}

TEST_CASE("summary.json has the keys that others read") {
  const Json json = Json(full_summary()).flatten();
  std::string keys;
  for (const auto& [key, value] : json.items()) keys += key + ' ';
  CHECK(keys ==
        "/robot /name /version /commit "
        "/keyframes /keypoints /frames /frames_skipped /paused_s "
        "/sensor_faults/x /peer_keyframes/keyframes /peer_keyframes/keypoints "
        "/closures/candidates /closures/verified /closures/inliers "
        "/pgo/rounds /pgo/seconds /pgo/cost /pgo/gradient_norm /pgo/anchor /pgo/settled "
        "/pgo/members/0 /pgo/members/1 /pgo/tentative/0 /pgo/tentative/1 "
        "/pgo/not_joined/0 /pgo/not_joined/1 "
        "/pgo/odometry_rotation_noise /pgo/odometry_translation_noise "
        "/pgo/odometry_breaks "
        "/odometry/inertial_sensor /odometry/starts /odometry/divergences /odometry/inertial_gaps "
        "/odometry/refused_images "
        "/odometry/refused_samples /odometry/images_without_pose /odometry/vision_losses "
        "/odometry/blind_seconds "
        "/localization/map /localization/localised /localization/after_s /localization/compared "
        "/localization/matched "
        "/absolute_fixes/located /absolute_fixes/after_s /absolute_fixes/used "
        "/absolute_fixes/rejected "
        "/absolute_fixes/residual_m /absolute_fixes/rotation_sigma_rad /absolute_fixes/received "
        "/absolute_fixes/not_used/x /absolute_fixes/datum/0 /absolute_fixes/datum/1 "
        "/absolute_fixes/odometry_frame/0 /absolute_fixes/odometry_frame/1 "
        "/holes/count /holes/seconds /holes/longest_s /holes/longest_from_s "
        "/correction/largest_m /correction/normalised_square "
        "/cameras/offset_s /cameras/offset_sigma_s /cameras/rotation_x_rad /cameras/rotation_y_rad "
        "/cameras/rotation_z_rad /cameras/rotation_sigma_rad /cameras/translation_x_m "
        "/cameras/translation_y_m /cameras/translation_z_m /cameras/translation_sigma_m "
        "/cameras/readout_s /cameras/readout_sigma_s "
        "/mapping/frames /mapping/dropped_under_load /mapping/skipped_wrong_size "
        "/mapping/skipped_bad_pose "
        "/mapping/skipped_too_late /mapping/without_labels /mapping/label_pixels_outside_palette "
        "/mapping/blocks_refused /mapping/blocks /mapping/vertices /mapping/faces "
        "/mapping/superseded_faces_dropped /mapping/corrections "
        "/mapping/correction_seconds /mapping/unbound_vertices "
        "/traffic/x /held_back/delayed/messages/x /held_back/delayed/bytes/x "
        "/held_back/superseded/messages/x /held_back/superseded/bytes/x "
        "/held_back/dropped/messages/x /held_back/dropped/bytes/x /process/cpu_s "
        "/process/system_s /process/page_faults /process/peak_memory_bytes "
        "/process/memory_at_start_bytes "
        "/process/memory_at_end_bytes /process/memory_growth_bytes_per_minute "
        "/seconds /lost_peers/x /apart_peers/x /unmet_peers/x "
        "/forged_announcements /other_vocabulary/x /other_network/x "
        "/noticed/0/id /noticed/0/severity /noticed/0/what /noticed/0/means /noticed/0/to_do "
        "/noticed/1/id /noticed/1/severity /noticed/1/what /noticed/1/means /noticed/1/to_do "
        "/exit_reason "
        "/findings/0/id /findings/0/severity /findings/0/what /findings/0/means /findings/0/to_do "
        "/findings/1/id /findings/1/severity /findings/1/what /findings/1/means "
        "/findings/1/to_do ");
  const Json least = RunSummary{};
  CHECK_FALSE(least.contains("mapping"));  // an absent value has no key
  CHECK_FALSE(least.contains("cameras"));
  CHECK_FALSE(least.contains("held_back"));
}

TEST_CASE("A cost that is no number is null, and none again") {
  const TemporaryFolder folder;
  RunSummary summary;
  summary.pgo.cost = std::numeric_limits<double>::quiet_NaN();
  const std::string text = json_text(summary);
  CHECK_THAT(text, Contains("\"cost\": null"));
  CHECK(std::isnan(read_summary(folder.write("summary.json", text)).pgo.cost));
}

TEST_CASE("A summary that is missing or broken is named, with the key") {
  const TemporaryFolder folder;
  CHECK_THROWS_WITH(read_summary(folder.path() / "x.json"), EndsWith("x.json: no such file"));
  for (const auto& [text, words] :
       {std::pair("[1, 2", "y.json: "),
        {"7", "y.json: not a JSON object"},
        {R"({"closures": {"verified": "many"}})", "y.json: closures: verified: "},
        {R"({"pgo": []})", "y.json: pgo: not a JSON object"},
        {R"({"findings": [{"severity": "bad"}]})", "findings: severity: bad"},
        {R"({"findings": [7]})", "findings: "},
        {R"({"pgo": {"members": [1, "a"]}})", "members"}}) {
    CAPTURE(text);
    CHECK_THROWS_WITH(read_summary(folder.write("y.json", text)), Contains(words));
  }
}

namespace {

std::vector<StampedPose> poses_at(const std::vector<double>& times_s) {
  std::vector<StampedPose> poses;
  for (const double time_s : times_s) poses.push_back({nanoseconds(time_s), SE3::Identity()});
  return poses;
}

std::vector<double> every(double interval_s, int count) {
  std::vector<double> times_s;
  for (int k = 0; k < count; ++k) times_s.push_back(interval_s * k);
  return times_s;
}

}  // namespace

TEST_CASE("A hole is an interval between poses that is far longer than usual") {
  CHECK(pose_holes({}).empty());
  CHECK(pose_holes(poses_at({7.0})).empty());
  CHECK(pose_holes(poses_at(every(0.05, 100))).empty());
  CHECK(pose_holes(poses_at(every(2.0, 100))).empty());  // as it is throughout
  std::vector<double> times_s = every(0.05, 21);
  times_s.insert(times_s.end(), {1.9, 1.95, 8.25, 8.3});
  const auto holes = pose_holes(poses_at(times_s));
  REQUIRE(holes.size() == 1);
  CHECK(holes[0].from == nanoseconds(1.95));
  CHECK(holes[0].to == nanoseconds(8.25));
}

TEST_CASE("The summary has the holes of the live trajectory") {
  RunRecord record(1);
  for (const StampedPose& pose : poses_at(every(0.05, 21))) record.add(OdometryState{pose.stamp});
  CHECK_FALSE(summary_of(record).holes.has_value());
  for (const double time_s : {7.0, 7.05, 9.05}) record.add(OdometryState{nanoseconds(time_s)});
  const auto holes = summary_of(record).holes;
  REQUIRE(holes.has_value());
  CHECK(holes->count == 2);
  CHECK(holes->seconds == Approx(8.0));
  CHECK(holes->longest_s == Approx(6.0));
  CHECK(holes->longest_from_s == Approx(1.0));
}

TEST_CASE("The summary compares the optimised keyframes with the uncertainty of odometry") {
  constexpr double kSigma_m = 0.1, kOff_m = 0.4;
  RunRecord record(1);
  Trajectory trajectory;
  trajectory.robot = trajectory.anchor = 1;
  for (KeyframeIndex k = 0; k < 3; ++k) {
    KeyframeOdometry keyframe;
    keyframe.id = {1, k};
    keyframe.stamp = nanoseconds(0.5 * k);
    keyframe.covariance = kSigma_m * kSigma_m * Matrix6::Identity();
    record.add(keyframe);
    trajectory.T_world_kf.push_back(SE3(Eigen::Translation3d(5.0, k == 2 ? kOff_m : 0.0, 0.0)));
  }
  CHECK_FALSE(summary_of(record).correction.has_value());
  record.add(trajectory);
  const auto correction = summary_of(record).correction;
  REQUIRE(correction.has_value());
  CHECK(correction->largest_m == Approx(kOff_m));
  CHECK(correction->normalised_square ==
        Approx(kOff_m * kOff_m / (2.0 * kSigma_m * kSigma_m * 6.0)));
}

namespace {

class BusyNode final : public Node {
 public:
  std::string_view name() const override { return "busy"; }
  void start() override {}
  void stop() noexcept override {}
  std::exception_ptr error() const override { return nullptr; }
  DurationHistogram timing() const override { return spent; }

  DurationHistogram spent;
};

TEST_CASE("Sensors that skip or corrupt frames are a warning, by kind") {
  CHECK(sensors_status(10, 0, {}).level == RosLevel::kOk);
  CHECK(sensors_status(10, 1, {}).level == RosLevel::kWarn);
  ReaderReport faults;
  faults.add(ReaderFault::kImuGap, "0.5 s after 7", 3);
  const RosDiagnosticStatus status = sensors_status(10, 1, faults);
  CHECK(status.level == RosLevel::kWarn);
  REQUIRE(status.values.size() == 3);
  CHECK(status.values[1].value == "1");
  CHECK(status.values[2].key == "gaps between inertial samples");
  CHECK(status.values[2].value == "3, first: 0.5 s after 7");
}

TEST_CASE("An uncertain place of a robot is a warning that names the robot") {
  OptimizerProgress progress{.anchor = 2, .members = {2, 4, 6}};
  CHECK(team_status(progress).level == RosLevel::kOk);
  progress.tentative = {4, 6};
  const RosDiagnosticStatus status = team_status(progress);
  CHECK(status.level == RosLevel::kWarn);
  CHECK(status.values.at(2).value == "4 6");
  progress.tentative.clear();
  progress.not_joined = {6};
  CHECK(team_status(progress).level == RosLevel::kWarn);
}

TEST_CASE("A module that hardly rests is a warning that names it") {
  BusyNode node;
  ModuleLoads loads({&node});
  CHECK(loads.status().level == RosLevel::kOk);
  node.spent.add(1e6);  // more than the possible time
  const RosDiagnosticStatus busy = loads.status();
  CHECK(busy.level == RosLevel::kWarn);
  CHECK(busy.message == "busy: busy");
  CHECK(busy.values.at(0).key == "busy busy [%]");
  CHECK(loads.status().level == RosLevel::kOk);  // since the last call
}

}  // namespace

}  // namespace km
