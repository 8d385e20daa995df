#include "modules/core/geometry/lie.hpp"
#include "modules/core/stamp.hpp"
#include "modules/sensors/sample_streams.hpp"
#include "modules/sensors/stream_stamps.hpp"
#include "modules/sensors/usual_numbers.hpp"
#include "test/modules/sensors/euroc_folder.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

constexpr StampVerdict kGood = StampVerdict::kGood, kRepeated = StampVerdict::kRepeated,
                       kUnordered = StampVerdict::kUnordered, kJump = StampVerdict::kJump;
constexpr Stamp kDay = 86'400'000'000'000;
using Verdicts = std::vector<StampVerdict>;

TEST_CASE("One wrong stamp at any place affects no other stamp") {
  const std::size_t place = GENERATE(0U, 1U, 5U, 8U, 9U);
  const Stamp offset = GENERATE(values<Stamp>({kDay, -kDay, 25, -25}));
  std::vector<Stamp> stamps;
  for (int i = 0; i < 10; ++i) stamps.push_back(2 * kDay + 10 * i);
  stamps[place] += offset;
  CAPTURE(place, offset);
  const Verdicts verdicts = judge_stamps(stamps);
  const bool still_in_order = (place == 0 && offset == -25) || (place == 9 && offset == 25);
  CHECK(std::count(verdicts.begin(), verdicts.end(), kGood) == (still_in_order ? 10 : 9));
  CHECK((verdicts[place] == kGood) == still_in_order);
}

TEST_CASE("After a clock was set the part with the most stamps is kept") {
  CHECK(judge_stamps(std::vector<Stamp>{1, 2, kDay, kDay + 1, kDay + 2}) ==
        Verdicts{kJump, kJump, kGood, kGood, kGood});
  CHECK(judge_stamps(std::vector<Stamp>{kDay, kDay + 1, 1, 2, 3}) ==
        Verdicts{kUnordered, kUnordered, kGood, kGood, kGood});
  CHECK(judge_stamps(std::vector<Stamp>{1, kDay}) == Verdicts{kGood, kJump});
  const Stamp minute = 60'000'000'000;  // a pause of a minute belongs to a recording
  CHECK(judge_stamps(std::vector<Stamp>{1, 2, 2, minute, minute + 1}) ==
        Verdicts{kGood, kGood, kRepeated, kGood, kGood});
}

TEST_CASE("No other choice of stamps in order keeps more of them") {
  CHECK(judge_stamps({}).empty());
  const unsigned seed = GENERATE(range(0U, 50U));
  CAPTURE(seed);
  std::mt19937 rng(seed);
  std::vector<Stamp> stamps(10);
  for (Stamp& stamp : stamps) stamp = std::uniform_int_distribution<Stamp>(1, 12)(rng);
  int most = 0;
  for (unsigned subset = 0; subset < 1U << stamps.size(); ++subset) {
    Stamp last = 0;
    int size = 0;
    for (std::size_t i = 0; i < stamps.size() && size >= 0; ++i) {
      if ((subset >> i & 1U) == 0) continue;
      size = stamps[i] > last ? size + 1 : -1;
      last = stamps[i];
    }
    most = std::max(most, size);
  }
  const Verdicts verdicts = judge_stamps(stamps);
  Stamp last = 0;
  for (std::size_t i = 0; i < stamps.size(); ++i) {
    if (verdicts[i] != kGood) continue;
    CHECK(stamps[i] > last);
    last = stamps[i];
  }
  CHECK(std::count(verdicts.begin(), verdicts.end(), kGood) == most);
}

Verdicts judged_as_they_come(const std::vector<Stamp>& stamps) {
  StampOrder order;
  Verdicts verdicts;
  for (const Stamp stamp : stamps) verdicts.push_back(order.judge(stamp));
  return verdicts;
}

TEST_CASE("Stamps of a stream are judged one by one") {
  CHECK(judged_as_they_come({10, 20, 20, 15, 30}) ==
        Verdicts{kGood, kGood, kRepeated, kUnordered, kGood});
  CHECK(judged_as_they_come({10, 20, kDay, 30, -kDay, 40}) ==
        Verdicts{kGood, kGood, kJump, kGood, kJump, kGood});
  const Stamp least = std::numeric_limits<Stamp>::min(), most = std::numeric_limits<Stamp>::max();
  CHECK(judged_as_they_come({10, least, most, 20}) == Verdicts{kGood, kJump, kJump, kGood});
}

TEST_CASE("The clock of a stream may be set but not back to times already used") {
  // Forward, as by a time server, and also if it began with an invalid stamp.
  CHECK(judged_as_they_come({10, 20, 30, 40, kDay, kDay + 1, kDay + 2, kDay + 3}) ==
        Verdicts{kGood, kGood, kGood, kGood, kJump, kJump, kGood, kGood});
  CHECK(judged_as_they_come({kDay, 10, 20, 30, 40}) == Verdicts{kGood, kJump, kJump, kGood, kGood});
  CHECK(judged_as_they_come({kDay, kDay + 1, kDay + 2, 10, 20, 30, 40, kDay + 3}) ==
        Verdicts{kGood, kGood, kGood, kJump, kJump, kJump, kJump, kGood});
}

constexpr Stamp kInterval = 50'000'000;

TEST_CASE("Missing images are counted at any jitter") {
  const unsigned seed = GENERATE(range(0U, 5U));
  CAPTURE(seed);
  std::mt19937 rng(seed);
  std::uniform_int_distribution<Stamp> jitter(-kInterval / 10, kInterval / 10);
  std::bernoulli_distribution is_lost(0.1);
  MissingImages missing;
  std::size_t lost = 0, counted = 0;
  for (int k = 0; k < 1000; ++k) {
    const bool can_be_lost = k > 2 * static_cast<int>(MissingImages::kFewest) && k < 999;
    if (can_be_lost && is_lost(rng))
      ++lost;
    else
      counted += missing.before(k * kInterval + jitter(rng)).missing;
  }
  CHECK(lost > 50);
  CHECK(counted == lost);
}

TEST_CASE("A new stream or a new rate reports missing images only briefly") {
  MissingImages missing;
  CHECK(missing.before(kInterval).missing == 0);
  CHECK(missing.before(9 * kInterval).missing == 0);  // the interval is not known yet
  Stamp stamp = 9 * kInterval;
  for (int k = 0; k < 50; ++k) CHECK(missing.before(stamp += kInterval).missing == 0);
  CHECK(missing.before(stamp += 40 * kInterval).missing == 39);
  const ImageGap restart = missing.before(stamp += 41 * kInterval);
  CHECK(restart.missing == 0);
  CHECK(restart.pause_s == Approx(2.05));
  std::size_t counted = 0;
  for (int k = 0; k < 100; ++k) counted += missing.before(stamp += 2 * kInterval).missing;
  CHECK(counted <= MissingImages::kIntervals / 2 + 1);
}

const SE3 kStart = se3_exp((Vector6() << 0.1, 0.2, 0.3, 1, 2, 3).finished());
const Vector6 kTwist = (Vector6() << 0.2, -0.1, 0.4, 0.5, 0.2, -0.3).finished();  // [1/s]

SE3 pose_at(double t_s) {
  return kStart * se3_exp(t_s * kTwist);
}

TEST_CASE("Between poses the body moves at constant velocity") {
  PoseStream poses;
  for (const double t_s : {10.0, 10.4, 11.0})
    poses.add(nanoseconds(t_s), {pose_at(t_s), t_s * Matrix6::Identity()});
  CHECK(poses.why_not(nanoseconds(9.9)) == "start 0.1 s after it");
  CHECK(poses.why_not(nanoseconds(10.0)).empty());
  CHECK(poses.why_not(nanoseconds(48.0)) == "end 37.0 s before it: are the clocks different?");
  CHECK_THAT(poses.why_not(nanoseconds(1e9)), Contains("another clock, unit or column"));
  CHECK(!poses.at(nanoseconds(9.9)));
  for (const double t_s : {10.0, 10.1, 10.4, 10.75, 11.0}) {
    CAPTURE(t_s);
    REQUIRE(poses.reaches(nanoseconds(t_s)));
    const auto pose = poses.at(nanoseconds(t_s));
    REQUIRE(pose);
    CHECK(pose->T_odom_body.isApprox(pose_at(t_s), 1e-9));
    CHECK(pose->covariance(2, 2) == Approx(t_s));
  }
  CHECK(!poses.reaches(nanoseconds(11.1)));
  CHECK(!poses.at(nanoseconds(11.1)));
  poses.add(nanoseconds(12.5), {pose_at(12.5)});  // further away than the longest step
  CHECK(!poses.at(nanoseconds(12.0)));
  CHECK(poses.at(nanoseconds(12.5)));
}

TEST_CASE("A pause of the cameras bounds the samples and poses that wait") {
  constexpr double kPause_s = 780.0, kRate_hz = 100.0;
  ImuStream imu;
  for (int k = 0; k <= kPause_s * kRate_hz; ++k) imu.add({.stamp = nanoseconds(k / kRate_hz)});
  (void)imu.until(nanoseconds(1.0));
  const auto packet = imu.until(nanoseconds(kPause_s));
  CHECK(packet.back().stamp == nanoseconds(kPause_s));
  CHECK(packet.back().stamp - packet.front().stamp == nanoseconds(ImuStream::kLongest_s));

  PoseStream poses;
  poses.add(0, {pose_at(0.0), Matrix6::Zero()});
  poses.add(nanoseconds(1.0), {pose_at(1.0), Matrix6::Zero()});
  poses.drop_before(nanoseconds(1.0));
  CHECK(!poses.at(nanoseconds(0.5)));
  CHECK(poses.at(nanoseconds(1.0)));

  // The gyroscope continues without an accelerometer.
  ImuJoiner joiner;
  for (int k = 0; k <= kPause_s; ++k) joiner.add_gyro({.stamp = nanoseconds(k)});
  CHECK(joiner.lost() == static_cast<std::size_t>(kPause_s - ImuStream::kLongest_s));
}

TEST_CASE("A covariance of ROS becomes that of the body's perturbation") {
  const SE3 T_odom_child = pose_at(1.0);
  const SE3 T_child_body = se3_exp((Vector6() << -0.3, 0.5, 0.2, 0.7, -0.4, 0.9).finished());
  const int axis = GENERATE(0, 1, 2, 3, 4, 5);  // axis of ROS: x, y, z, and rotations about them
  CAPTURE(axis);
  Vector6 one = Vector6::Zero();
  one[axis] = 1.0;
  const MeasuredPose pose = measured_pose(T_odom_child, one * one.transpose(), T_child_body);
  CHECK(pose.T_odom_body.isApprox(T_odom_child * T_child_body, 1e-12));
  // The child moved and rotated a little along the axes of odom, about its own origin.
  constexpr double kStep = 1e-6;
  SE3 moved = T_odom_child;
  moved.translation() += kStep * one.head<3>();
  moved.linear() = so3_exp(kStep * one.tail<3>()) * T_odom_child.linear();
  const Vector6 xi = se3_log(pose.T_odom_body.inverse() * moved * T_child_body) / kStep;
  CHECK(pose.covariance.isApprox(xi * xi.transpose(), 1e-5));
}

TEST_CASE("A message of an odometry without a valid pose is refused") {
  RosOdometry message;
  message.pose.pose.position = {1, 2, 3};
  message.pose.covariance[0] = 0.25;
  REQUIRE(measured_pose(message, SE3::Identity()));
  CHECK(measured_pose(message, SE3::Identity())->covariance(3, 3) == 0.25);
  message.pose.covariance[0] = -1.0;  // unknown
  CHECK(measured_pose(message, SE3::Identity())->covariance.isZero());
  message.pose.pose.orientation.coeffs().setZero();
  CHECK(!measured_pose(message, SE3::Identity()));
  message.pose.pose.orientation.setIdentity();
  message.pose.pose.position.x() = std::nan("");
  CHECK(!measured_pose(message, SE3::Identity()));
}

TEST_CASE("Packets get the poses of a file and frames without one are counted") {
  const EurocFolder folder;  // eight frames from 10 s on, at 20 Hz
  UncertainTrajectory poses;
  const auto add = [&poses](double t_s, double x, double variance) {
    poses.poses.push_back({nanoseconds(t_s), SE3(Eigen::Translation3d(x, 0, 0))});
    poses.covariances.emplace_back(variance * Matrix6::Identity());
    poses.lines.push_back(static_cast<int>(poses.lines.size()) + 1);
  };
  add(10.025, 0, 0);
  add(10.075, 1, 0.5);
  add(10.06, 7, 0);      // out of order
  add(10.225, 4, -0.5);  // negative variances are unknown
  const auto reader_of = [&](const ReaderReport& faults) {
    return PoseFileReader(std::make_unique<FolderReader>(open_folder(folder.root())),
                          folder.mav0() / "poses.tum", poses, faults);
  };
  PoseFileReader reader = reader_of({});
  CHECK(reader.gives_poses());
  std::vector<MeasuredPose> read;
  while (const auto packet = reader.next()) read.push_back(*packet->pose);
  REQUIRE(read.size() == 4);
  CHECK(read[0].T_odom_body.translation().x() == Approx(0.5));
  CHECK(read[0].covariance.isApprox(0.25 * Matrix6::Identity()));
  CHECK(read[3].T_odom_body.translation().x() == Approx(3.5));
  CHECK(read[3].covariance.isApprox(0.5 / 6.0 * Matrix6::Identity()));
  CHECK(reader.report().count(ReaderFault::kFrameWithoutPose) == 4);
  CHECK_THAT(reader.report().entries().at(ReaderFault::kUnorderedStamp).first,
             Contains("poses.tum line 3: "));
  poses = {};
  ReaderReport faults;
  faults.add(ReaderFault::kMalformedRow, "poses.tum line 1: 3 fields, expected 8");
  CHECK_THROWS_WITH(reader_of(faults), Contains("poses.tum: no pose in it; ") &&
                                           EndsWith("line 1: 3 fields, expected 8"));
}

TEST_CASE("Numbers of sensors outside the usual range are named by their confusions") {
  struct Case {
    UsualNumber number;
    double value;
    const char *id, *words;
  };
  const Case c = GENERATE(
      Case{UsualNumber::kBaseline_m, 11.0, "stereo.baseline", "0.11 m if in centimetres"},
      Case{UsualNumber::kBaseline_m, 110.0, "stereo.baseline", "0.11 m if in millimetres"},
      Case{UsualNumber::kBaseline_m, 1e-4, "stereo.baseline", "usually 0.01 to 1 m"},
      Case{UsualNumber::kLever_m, 65.0, "extrinsics.lever", "0.065 m if in millimetres"},
      Case{UsualNumber::kImageRate_hz, 2e4, "frames.stamps", "20 Hz if of stamps in microseconds"},
      Case{UsualNumber::kImuRate_hz, 2e5, "imu.stamps", "200 Hz if of stamps in microseconds"},
      Case{UsualNumber::kGravity_mps2, 0.99, "imu.accel_in_g", "9.709 m/s^2 if in g"},
      Case{UsualNumber::kGravity_mps2, 1001.0, "imu.accel_in_g", "if in thousandths of g"},
      Case{UsualNumber::kGravity_mps2, 0.3, "imu.no_gravity", "subtracts gravity"},
      Case{UsualNumber::kGravity_mps2, 20.0, "imu.gravity", "usually 8.3 to 11.3"},
      Case{UsualNumber::kDepthShare, 0.001, "depth.share", "a share of 0.001 of the pixels"},
      Case{UsualNumber::kDepth_m, 1800.0, "depth.size", "1.8 m if in millimetres"},
      Case{UsualNumber::kDepth_m, 0.06, "depth.size", "0.6 m if in centimetres"},
      Case{UsualNumber::kDepthPower, 1.0, "depth.ray", "power of 1, usually -0.5 to 0.5"});
  CAPTURE(c.id, c.value);
  const auto found = doubt(c.number, c.value);
  REQUIRE(found);
  CHECK(found->id == c.id);
  CHECK_THAT(found->what, Contains(c.words));
  CHECK_FALSE(doubt(UsualNumber::kBaseline_m, 0.54));  // KITTI
  CHECK_FALSE(doubt(UsualNumber::kImageRate_hz, std::nan("")));
  CHECK_FALSE(doubt(UsualNumber::kDepth_m, 0.5));  // a desk
  CHECK(doubt(UsualNumber::kDepth_m, 0.06)->is_explained);
  const auto question = doubt(UsualNumber::kDepth_m, 0.18);
  REQUIRE(question);
  CHECK_FALSE(question->is_explained);
  const auto exchanged = gravity_doubt({{1, {0.0, 9.8, 0.0}, {0.1, 0.0, 0.0}}});
  REQUIRE(exchanged);
  CHECK(exchanged->id == "imu.exchanged");
}

TEST_CASE("The first packets of a source show its rates and units once") {
  FirstPackets first;
  std::vector<Doubt> found;
  for (Stamp k = 0; k < 40; ++k) {
    auto frame = std::make_shared<StereoFrame>();
    frame->stamp = 50'000 * k;  // 20 Hz in microseconds
    frame->depth = std::make_shared<DepthImage>(
        DepthImage{64, 48, std::vector<std::uint16_t>(64U * 48U, 60'000)});
    SensorPacket packet{frame, {}};
    for (Stamp i = 0; i < 10; ++i)
      packet.imu.push_back({50'000 * k + 5'000 * i, Eigen::Vector3d::Zero(), {0, 0, 9.81}});
    for (const Doubt& doubt : first.add(packet, {64, 48, 50, 50, 32, 24})) found.push_back(doubt);
  }
  REQUIRE(found.size() == 3);
  CHECK_THAT(found[0].what, Contains("20000 Hz, usually 1 to 1000 Hz: 20 Hz if of stamps"));
  CHECK(found[2].id == "depth.size");
  CHECK(found[1].id == "imu.stamps");
}

TEST_CASE("Depth along the ray in place of z is found by the planes of the first packets") {
  const bool is_range = GENERATE(false, true);
  const Camera camera{.width = 320, .height = 240, .fx = 250, .fy = 250, .cx = 160, .cy = 120};
  std::mt19937 rng(7);
  std::normal_distribution<double> noise(0.0, 2e-3);  // relative to z^2 [1/m]
  FirstPackets first;
  std::vector<Doubt> found;
  for (std::size_t k = 0; k < FirstPackets::kFrames; ++k) {
    auto frame = std::make_shared<StereoFrame>();
    frame->stamp = 50'000'000 * static_cast<Stamp>(k);
    DepthImage depth{320, 240, {}};
    for (int v = 0; v < depth.height; ++v)
      for (int u = 0; u < depth.width; ++u) {  // two walls that meet in a corner
        const Eigen::Vector3d ray = camera.unproject({u, v})->homogeneous();
        const double z = 3.0 / std::max(1.0 - 0.3 * ray.x(), 1.2 + 0.5 * ray.x());
        depth.millimetres.push_back(static_cast<std::uint16_t>(1e3 * (z + z * z * noise(rng)) *
                                                               (is_range ? ray.norm() : 1.0)));
      }
    frame->depth = std::make_shared<DepthImage>(std::move(depth));
    for (const Doubt& doubt : first.add({frame, {}}, camera)) found.push_back(doubt);
  }
  REQUIRE(found.size() == (is_range ? 1 : 0));
  if (is_range) CHECK(found[0].id == "depth.ray");
}

TEST_CASE("Microseconds in a field of nanoseconds are named, and bursts of samples are none") {
  CHECK_THAT(rate_doubt(UsualNumber::kImageRate_hz, 20.0, 5e-5)->what,
             Contains("20000 Hz") && Contains("microseconds"));
  CHECK_FALSE(rate_doubt(UsualNumber::kImuRate_hz, 200.0, 1e-4));
  CHECK_FALSE(rate_doubt(UsualNumber::kImuRate_hz, 200.0, 0.0));
}

}  // namespace
}  // namespace km
