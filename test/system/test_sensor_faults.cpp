#include "modules/evaluation/trajectory_error.hpp"
#include "modules/evaluation/trajectory_file.hpp"
#include "test/support/euroc_copy.hpp"
#include "test/support/process.hpp"
#include "test/support/shared_data.hpp"
#include "test/support/test.hpp"
#include "test/system/live_run.hpp"
#include "test/system/team_run.hpp"

namespace km {
namespace {

// A robot without peers.
std::string lone_robot(const std::string& options) {
  static const int domain = random_domain();
  return euroc_robot(0, "--serve-limit 0 --interface lo " + options, domain);
}

// `dataset` and `output` are in `folder`.
CommandResult run_robot(const TemporaryFolder& folder, const std::string& dataset,
                        const std::string& output, const std::string& options = {},
                        const std::string& output_option = "--output") {
  return run_command(lone_robot("--rate max --dataset " + (folder.path() / dataset).string() + ' ' +
                                output_option + ' ' + (folder.path() / output).string() + ' ' +
                                options));
}

// The cameras as a run on the recording "late" estimates them.
CamerasSummary estimated_cameras(const TemporaryFolder& folder, const std::string& output,
                                 const std::string& options,
                                 const std::string& output_option = "--output") {
  const CommandResult run = succeeded(run_robot(folder, "late", output, options, output_option));
  return read_summary(folder.path() / output / "summary.json").cameras.value();
}

// The first `length_s` of a recording, from its first image on.
EurocCopy first_seconds(const fs::path& recording, double length_s) {
  EurocCopy copy(recording);
  const Stamp end = copy.cameras[0].front().stamp + nanoseconds(length_s);
  for (auto& images : copy.cameras)
    std::erase_if(images, [&](const auto& image) { return image.stamp >= end; });
  std::erase_if(copy.samples,
                [&](const auto& sample) { return sample.stamp >= end + nanoseconds(0.5); });
  return copy;
}

constexpr double kLength_s = 14.0;  // length of the part of the recording that is used
constexpr double kBegin_s = 5.0;    // begin of the fault

// A way in which sensors fail for a while.
struct SensorFault {
  std::string name;
  double lasts_s = 0.0;
  std::function<void(EurocCopy&, Stamp begin, Stamp end)> corrupt;  // from `begin` to before `end`
  std::string event = {};  // text in the log of a robot with this fault
  double bound_m = 0.1;    // bound on the position error, during the fault and after it
  bool is_blind = false;   // for a while no image holds the pose
};

template <typename Item, typename Change>
void for_each_within(std::vector<Item>& items, Stamp begin, Stamp end, Change change) {
  for (Item& item : items)
    if (item.stamp >= begin && item.stamp < end) change(item);
}

void darken(EurocCopy& copy, Stamp begin, Stamp end) {
  for (auto& images : copy.cameras)
    for_each_within(images, begin, end, [](EurocCopy::Image& image) { image.gain = 0.0; });
}

// Overexposed pixels become white.
void jump_exposure(EurocCopy& copy, Stamp begin, Stamp end) {
  for (auto& images : copy.cameras)
    for_each_within(images, begin, end, [&](EurocCopy::Image& image) {
      image.gain = (image.stamp - begin) / nanoseconds(1.0) % 2 == 0 ? 0.4 : 2.5;
    });
}

void move_samples(EurocCopy& copy, Stamp begin, Stamp end) {
  for_each_within(copy.samples, begin, end,
                  [](EurocCopy::Sample& sample) { sample.stamp += nanoseconds(1.0); });
}

void delay_right(EurocCopy& copy, Stamp /*begin*/, Stamp /*end*/) {
  for (EurocCopy::Image& image : copy.cameras[1]) image.stamp += nanoseconds(0.002);
}

void drop_everything(EurocCopy& copy, Stamp begin, Stamp end) {
  const auto is_within = [&](const auto& item) { return item.stamp >= begin && item.stamp < end; };
  std::erase_if(copy.samples, is_within);
  for (auto& images : copy.cameras) std::erase_if(images, is_within);
}

const std::vector<SensorFault>& sensor_faults() {
  static const std::vector<SensorFault> faults = {
      {"no light", 5.0, darken, "vision lost since", 1.0, true},  // by inertial sensing alone
      {"exposure jumps", 5.0, jump_exposure},
      {"samples 1 s ahead", 0.2, move_samples, "inertial samples out of order"},
      {"right images 2 ms late", 5.0, delay_right, "2.00 ms after"},
      // 3 m: distance of the flight during the restart
      {"drivers restart", 2.0, drop_everything, "gaps between inertial samples", 3.0, true},
  };
  return faults;
}

struct FaultyRun {
  int exit_code = -1;
  std::string output;
  RunSummary summary;
  // Position errors, in the frame that fits the poses before the fault.
  double worst_m = 0.0, last_m = 0.0;
  std::optional<double> back_s;  // after the fault
};

double error_m(const PosePair& pair, const SE3& T_truth_estimate) {
  return ((T_truth_estimate * pair.T_estimate_body).translation() - pair.T_truth_body.translation())
      .norm();
}

template <typename Accepts>
double rms_m(const std::vector<PosePair>& pairs, const SE3& T_truth_estimate, Accepts accepts) {
  double sum = 0.0, count = 0.0;
  for (const PosePair& pair : pairs)
    if (accepts(pair.stamp)) sum += std::pow(error_m(pair, T_truth_estimate), 2), count += 1.0;
  return std::sqrt(sum / count);
}

// From then on the pose is right: over no second the motion error exceeds this value, beyond
// corrections of the position. New images show the smoother the true speed during the blind time,
// and it moves the body accordingly.
std::optional<double> back_after_s(const std::vector<PosePair>& pairs, const SE3& T_truth_estimate,
                                   Stamp end) {
  constexpr double kRight_m = 0.03, kOver_s = 1.0;
  std::optional<Stamp> back;
  for (std::size_t i = 0, j = 0; i < pairs.size(); ++i) {
    if (pairs[i].stamp < end) continue;
    while (j < pairs.size() && seconds_between(pairs[i].stamp, pairs[j].stamp) < kOver_s) ++j;
    if (j == pairs.size()) break;
    const SE3 truth = pairs[i].T_truth_body.inverse() * pairs[j].T_truth_body;
    const SE3 estimate = pairs[i].T_estimate_body.inverse() * pairs[j].T_estimate_body;
    const double corrected_m =
        error_m(pairs[i], T_truth_estimate) - error_m(pairs[j], T_truth_estimate);
    if ((truth.inverse() * estimate).translation().norm() - std::max(corrected_m, 0.0) > kRight_m)
      back.reset();
    else if (!back)
      back = pairs[i].stamp;
  }
  return back ? std::optional(seconds_between(end, *back)) : std::nullopt;
}

FaultyRun meet(const fs::path& recording, const SensorFault& fault) {
  const TemporaryFolder folder;
  EurocCopy copy = first_seconds(recording, kLength_s);
  const Stamp first = copy.cameras[0].front().stamp;
  const Stamp begin = first + nanoseconds(kBegin_s);
  const Stamp end = begin + nanoseconds(fault.lasts_s);
  fault.corrupt(copy, begin, end);
  copy.write(folder.path() / "recording");
  const CommandResult run = run_robot(folder, "recording", "results");
  FaultyRun outcome;
  outcome.exit_code = run.exit_code;
  outcome.output = run.output;
  if (run.exit_code != 0) return outcome;
  outcome.summary = read_summary(folder.path() / "results/summary.json");
  const auto estimate = read_trajectory(folder.path() / "results/odometry.tum");
  const auto truth = read_trajectory(recording);
  const auto pairs = associate(truth, estimate, {first, estimate.back().stamp});
  std::vector<PosePair> fitted;
  for (const PosePair& pair : pairs)
    if (pair.stamp < begin) fitted.push_back(pair);
  const SE3 T_truth_estimate = align(fitted);
  for (const PosePair& pair : pairs)
    if (pair.stamp >= begin && pair.stamp < end + nanoseconds(1.0))
      outcome.worst_m = std::max(outcome.worst_m, error_m(pair, T_truth_estimate));
  const Stamp last = pairs.back().stamp - nanoseconds(3.0);
  outcome.last_m = rms_m(pairs, T_truth_estimate, [last](Stamp stamp) { return stamp >= last; });
  outcome.back_s = back_after_s(pairs, T_truth_estimate, end);
  return outcome;
}

}  // namespace

TEST_CASE("A robot survives what happens to its sensors", "[faults]") {
  const auto recording = shared_data("euroc/MH_01_easy");
  if (!recording) return;
  for (const SensorFault& fault : sensor_faults()) {
    const FaultyRun outcome = meet(fs::absolute(*recording), fault);
    CAPTURE(fault.name, fault.lasts_s, outcome.output);
    CHECK(outcome.exit_code == 0);
    CHECK_THAT(outcome.output, Contains(fault.event));
    CHECK(outcome.worst_m < fault.bound_m);
    CHECK(outcome.last_m < fault.bound_m);
    CHECK(outcome.back_s.value_or(1e9) <= 1.0);
    REQUIRE(outcome.summary.odometry);
    CHECK((outcome.summary.odometry->vision_losses > 0) == fault.is_blind);
  }
}

TEST_CASE("A run names the unit and the sign that made its odometry fail", "[faults]") {
  const auto recording = shared_data("euroc/MH_01_easy");
  if (!recording) return;
  const TemporaryFolder folder;
  EurocCopy copy = first_seconds(fs::absolute(*recording), 12.0);
  for (EurocCopy::Sample& sample : copy.samples) {
    std::istringstream fields(sample.values);
    std::string text, field;
    for (int k = 0; std::getline(fields, field, ','); ++k)
      text += (k == 0 ? "" : ",") + (k < 3 ? field : std::to_string(-std::stod(field)));
    sample.values = text;
  }
  copy.write(folder.path() / "negated");
  const CommandResult run = run_robot(folder, "negated", "out");
  CAPTURE(run.output);
  const auto findings = read_summary(folder.path() / "out/summary.json").findings;
  const auto found = std::ranges::find(findings, "imu.accel_negated", &Finding::id);
  REQUIRE(found != findings.end());
  CHECK(found->severity == Severity::kError);
  CHECK_THAT(found->what, Contains("its sign is inverted"));
}

TEST_CASE("A driver that restarts does not end a live robot", "[faults]") {
  const auto recording = shared_data("euroc/MH_01_easy");
  if (!recording) return;
  const TemporaryFolder folder;
  const fs::path rig = folder.write("rig.yaml", euroc_rig(*recording));
  const EurocCopy whole = first_seconds(fs::absolute(*recording), 12.0);
  const Stamp first = whole.cameras[0].front().stamp;
  const Stamp silent = first + nanoseconds(5.0), again = first + nanoseconds(7.0);
  const int domain = random_domain();
  Process robot(words_of(
      lone_robot("--live " + rig.string() + " --output " + (folder.path() / "results").string() +
                 " --set ros.interface=lo --set sensors.max_lag_s=30 --set ros.domain=" +
                 std::to_string(domain))));
  for (const bool is_first : {true, false}) {
    EurocCopy part = whole;
    const auto is_outside = [&](const auto& item) {
      return is_first ? item.stamp >= silent : item.stamp < again;
    };
    for (auto& images : part.cameras) std::erase_if(images, is_outside);
    std::erase_if(part.samples, is_outside);
    const fs::path played = folder.path() / (is_first ? "before" : "after");
    part.write(played);
    Process driver(driver_command(played, domain, "--reliable --rate 0.7"));
    CHECK(driver.wait() == 0);
  }
  CHECK(robot.wait_until(is_beyond(7.5)));
  robot.kill(SIGINT);
  CHECK(robot.wait() == 0);
  const auto poses = read_trajectory(folder.path() / "results/odometry.tum");
  CHECK(std::ranges::count_if(poses, [&](const auto& pose) { return pose.stamp < silent; }) > 50);
  CHECK(std::ranges::count_if(poses, [&](const auto& pose) { return pose.stamp >= again; }) > 20);
  const RunSummary summary = read_summary(folder.path() / "results/summary.json");
  REQUIRE(summary.odometry);
  // On a busy machine samples at other times are lost, too.
  CHECK(summary.odometry->starts >= 2);
  CHECK(summary.odometry->gaps >= 1);
}

TEST_CASE(
    "The camera calibration that a run has estimated is known to the next run and to a resumed one",
    "[faults]") {
  const auto recording = shared_data("euroc/MH_01_easy");
  if (!recording) return;
  constexpr double kLate_s = 0.02;
  const TemporaryFolder folder;
  EurocCopy copy = first_seconds(fs::absolute(*recording), 11.0);
  for (auto& sample : copy.samples) sample.stamp += nanoseconds(kLate_s);
  copy.write(folder.path() / "late");
  const std::string corrected_rig = " --rig " + (folder.path() / "run/rig_estimated.yaml").string();
  const CamerasSummary before = estimated_cameras(folder, "run", "--to 10");
  CHECK(before.offset_s == Approx(kLate_s).margin(0.003));
  const CamerasSummary next = estimated_cameras(folder, "next", "--to 10" + corrected_rig);
  CHECK(std::abs(next.offset_s) < 0.001);
  CHECK(std::abs(next.rotation_x_rad) < 0.5 * 0.01);
  const auto resumed = [&](const std::string& as, const std::string& options) {
    fs::copy(folder.path() / "run", folder.path() / as);
    return estimated_cameras(folder, as, options, "--resume");
  };
  const CamerasSummary after = resumed("taken_up", "");
  CHECK(after.offset_s == Approx(before.offset_s).margin(1e-3));
  CHECK(after.offset_sigma_s < 1.05 * before.offset_sigma_s);
  // A rig that has this correction already needs no further one.
  const CamerasSummary corrected = resumed("corrected", corrected_rig);
  CHECK(std::abs(corrected.offset_s) < 1e-3);
  CHECK(corrected.offset_sigma_s < 1.05 * before.offset_sigma_s);
}

TEST_CASE("A robot without an inertial sensor uses an external odometry", "[faults]") {
  const auto recording = shared_data("euroc/MH_01_easy");
  if (!recording) return;
  const TemporaryFolder folder;
  first_seconds(fs::absolute(*recording), 3.0).write(folder.path() / "bare");
  REQUIRE(run_robot(folder, "bare", "own").exit_code == 0);
  fs::remove_all(folder.path() / "bare/mav0/imu0");
  const std::string poses = (folder.path() / "own/odometry.tum").string();
  const CommandResult run = succeeded(run_robot(folder, "bare", "outside", "--odometry " + poses));
  CHECK(read_trajectory(folder.path() / "outside/odometry.tum").size() ==
        read_trajectory(poses).size());
  CHECK(!fs::exists(folder.path() / "outside/rig_estimated.yaml"));
}

}  // namespace km
