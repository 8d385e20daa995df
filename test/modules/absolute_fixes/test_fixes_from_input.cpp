#include "modules/absolute_fixes/fix_association.hpp"
#include "modules/absolute_fixes/geodetic.hpp"
#include "modules/absolute_fixes/node/fixes_node.hpp"
#include "modules/core/geometry/lie.hpp"
#include "modules/recordings/ros_messages.hpp"
#include "test/support/temporary_folder.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

const GeodeticPoint kDatum{42.0, -82.0, 200.0};

AbsoluteFixesConfig gnss_config() {
  AbsoluteFixesConfig config;
  config.source = FixSource::kGnss;
  config.topic = "/fix";
  config.datum = {kDatum.latitude_deg, kDatum.longitude_deg, kDatum.altitude_m};
  return config;
}

RosNavSatFix nav_sat_fix(Stamp stamp) {
  RosNavSatFix fix{.header = {.stamp = stamp, .frame_id = "gps"},
                   .latitude = kDatum.latitude_deg,
                   .longitude = kDatum.longitude_deg,
                   .altitude = kDatum.altitude_m + 2.0};
  fix.position_covariance[0] = fix.position_covariance[4] = 0.25;
  fix.position_covariance[8] = 1.0;
  fix.position_covariance_type = 2;
  return fix;
}

template <typename Message>
std::optional<TimedPosition> read(FixReader& reader, const Message& message) {
  const auto fix =
      reader.decode({"/fix", std::string(Message::kType), "cdr", 0}, {0, 0, encode_ros(message)});
  return fix ? reader.accept(*fix) : std::nullopt;
}

// The numbers are those of the tests of pymap3d (github.com/geospace-code/pymap3d).
TEST_CASE("positions in WGS 84 become east, north, up about the datum") {
  constexpr double kRounding_m = 1e-4;
  CHECK((ecef_of(kDatum) - Eigen::Vector3d(660675.2518247, -4700948.68316, 4245737.66222)).norm() <
        kRounding_m);
  // 1 km away at azimuth 33 and elevation 70 degrees. The coordinates are rounded to 1e-6 degrees.
  const Eigen::Vector3d enu = EnuFrame(kDatum).position_of({42.002582, -81.997752, 1.1397018e3});
  CHECK((enu - Eigen::Vector3d(186.277521, 286.84222, 939.69262)).norm() < 0.2);
  CHECK(EnuFrame(kDatum).position_of(kDatum).norm() < 1e-8);
  for (const double latitude : {-90.0, 90.0})
    CHECK(std::abs(std::abs(ecef_of({latitude, 15.0, 0.0}).z()) - 6356752.3142) < kRounding_m);
}

TEST_CASE("unusable fixes are counted by reason") {
  FixReader reader(gnss_config());
  const auto good = read(reader, nav_sat_fix(100));
  REQUIRE(good);
  CHECK((good->p_datum - Eigen::Vector3d(0.0, 0.0, 2.0)).norm() < 1e-8);
  CHECK(good->sigma_m == Approx(std::sqrt(0.5)));
  RosNavSatFix bad = nav_sat_fix(200);
  bad.status.status = -1;
  CHECK_FALSE(read(reader, bad));
  bad = nav_sat_fix(200);
  bad.altitude = std::numeric_limits<double>::quiet_NaN();
  CHECK_FALSE(read(reader, bad));
  bad = nav_sat_fix(200);
  bad.position_covariance[4] = std::numeric_limits<double>::quiet_NaN();
  CHECK_FALSE(read(reader, bad));
  bad = nav_sat_fix(200);
  bad.position_covariance[8] = 1e6;
  CHECK_FALSE(read(reader, bad));
  CHECK_FALSE(read(reader, nav_sat_fix(100)));
  CHECK_FALSE(read(reader, RosPoseStamped{}));
  bad = nav_sat_fix(200);
  bad.latitude += 1.0;  // 111 km
  CHECK_FALSE(read(reader, bad));
  RosNavSatFix unknown = nav_sat_fix(300);
  unknown.position_covariance_type = kRosUnknownCovariance;
  const auto usual = read(reader, unknown);
  REQUIRE(usual);
  CHECK(usual->sigma_m == 3.0);
  const FixCounts& counts = reader.counts();
  CHECK(counts.received == 9);
  CHECK(counts.without_position == 1);
  CHECK(counts.not_finite == 2);
  CHECK(counts.too_uncertain == 1);
  CHECK(counts.out_of_order == 1);
  CHECK(counts.malformed == 1);
  CHECK(counts.far_from_datum == 1);
}

TEST_CASE("without a configured datum the first fix is the datum") {
  AbsoluteFixesConfig config = gnss_config();
  FixReader configured(config);
  config.datum.clear();
  FixReader first(config);
  CHECK(first.datum_id() == 0);
  REQUIRE(read(first, nav_sat_fix(1)));
  CHECK(first.datum()->altitude_m == kDatum.altitude_m + 2.0);
  CHECK(first.datum_id() != configured.datum_id());
}

TEST_CASE("a configuration that names no source of fixes or two is refused") {
  AbsoluteFixesConfig config = gnss_config();
  config.file = "fixes.csv";
  CHECK_THROWS_WITH(FixReader(config), Contains("either topic or file"));
  config = gnss_config();
  config.datum = {47.0, 8.0};
  CHECK_THROWS_WITH(FixReader(config), Contains("latitude, longitude and altitude"));
}

TEST_CASE("files of motion captures have stamps in s, or in ns in a .csv file") {
  const TemporaryFolder folder;
  AbsoluteFixesConfig config;
  config.source = FixSource::kMotionCapture;
  const bool is_csv = GENERATE(true, false);
  config.file = folder.path() / (is_csv ? "data.csv" : "poses.tum");
  std::ofstream(config.file) << (is_csv ? "#timestamp [ns], x, y, z\n1500000000, 1, 2, 3\n2, 1, 2\n"
                                        : "# t x y z q\n1.5 1 2 3 0 0 0 1\n1.4 1 2 3 0 0 0 1\n");
  FixReader reader(config);
  const auto fixes = reader.read(config.file);
  REQUIRE(fixes.size() == 1);
  CHECK(fixes[0].stamp == 1500000000);
  CHECK(fixes[0].p_datum == Eigen::Vector3d(1.0, 2.0, 3.0));
  CHECK(reader.counts().malformed + reader.counts().out_of_order == 1);
}

// Messages of two topics.
class TwoTopics final : public BagReader {
 public:
  explicit TwoTopics(std::vector<RosPoseStamped> poses) : poses_(std::move(poses)) {}
  const std::vector<BagChannel>& channels() const override { return channels_; }
  std::optional<BagMessage> next() override {
    if (next_ == 2 * poses_.size()) return std::nullopt;
    const RosPoseStamped& pose = poses_[next_ / 2];
    return BagMessage{next_++ % 2, pose.header.stamp, encode_ros(pose)};
  }
  BagReport report() const override { return {}; }

 private:
  std::vector<BagChannel> channels_ = {{"/other", "geometry_msgs/msg/PoseStamped", "cdr", 0},
                                       {"/pose", "geometry_msgs/msg/PoseStamped", "cdr", 0}};
  std::vector<RosPoseStamped> poses_;
  std::size_t next_ = 0;
};

AbsoluteFixesConfig motion_capture_config(const std::string& topic) {
  AbsoluteFixesConfig config;
  config.source = FixSource::kMotionCapture;
  config.topic = topic;
  return config;
}

RosPoseStamped pose_stamped(Stamp stamp) {
  RosPoseStamped pose;
  pose.header.stamp = stamp;
  pose.pose.position = {seconds_between(0, stamp), 0.0, 0.0};
  return pose;
}

TEST_CASE("fixes are read from one topic of a recording") {
  TwoTopics bag({pose_stamped(1), pose_stamped(2)});
  FixReader reader(motion_capture_config("/pose"));
  CHECK(reader.read(bag).size() == 2);
  TwoTopics again({pose_stamped(1)});
  FixReader missing(motion_capture_config("/none"));
  CHECK_THROWS_WITH(missing.read(again), Contains("/none"));
}

TEST_CASE("the node publishes live fixes") {
  constexpr Stamp kSecond_ns = 1'000'000'000;
  Topic<OdometryState> states, restored;
  Topic<KeyframeOdometry> keyframes;
  Topic<PositionFix> fixes;
  std::vector<Stamp> journaled;
  std::vector<PositionFix> published;
  fixes.subscribe([&](const auto& fix) { published.push_back(*fix); });
  FixesNode node({.reader = FixReader(motion_capture_config("/pose")),
                  .live = std::make_unique<TwoTopics>(std::vector{pose_stamped(1)})},
                 {states, restored, keyframes, fixes,
                  [&](const ReceivedFix& fix) { journaled.push_back(fix.stamp); }});
  for (Stamp t = 0; t <= 4; ++t) {
    OdometryState state{.stamp = t * kSecond_ns};
    state.T_odom_body.translation().x() = static_cast<double>(t);
    node.step(std::make_shared<const OdometryState>(state));
    KeyframeOdometry keyframe;
    keyframe.id = {0, static_cast<KeyframeIndex>(t + 1)};
    keyframe.stamp = state.stamp;
    node.step(std::make_shared<const KeyframeOdometry>(keyframe));
    const RosPoseStamped pose = pose_stamped(state.stamp + kSecond_ns / 4);
    for (int copy = 0; copy < 2; ++copy)  // the second one is not later than the first
      node.step(std::make_shared<const BagMessage>(BagMessage{1, 0, encode_ros(pose)}));
  }
  REQUIRE(published.size() >= 3);
  CHECK(published[1].keyframe.index == 2);
  CHECK((published[1].p_datum - Eigen::Vector3d(1.25, 0.0, 0.0)).norm() < 1e-12);
  CHECK((published[1].p_kf - Eigen::Vector3d(0.25, 0.0, 0.0)).norm() < 1e-12);
  CHECK(node.counts().received == 10);
  REQUIRE(journaled.size() == 5);
  CHECK(journaled[1] == kSecond_ns + kSecond_ns / 4);
}

// A body that turns and moves at constant velocity, with images every 50 ms and a keyframe every
// 0.5 s.
TEST_CASE("a fix between images measures the nearest keyframe") {
  constexpr Stamp kImage_ns = 50'000'000, kFix_ns = 130'000'000, kFirstFix_ns = 7'000'000;
  const Vector6 velocity{0.3, -0.2, 0.5, 1.0, 0.4, -0.1};
  const Eigen::Vector3d antenna(0.3, -0.2, 0.5);
  const auto T_odom_body = [&](Stamp t) { return se3_exp(seconds_between(0, t) * velocity); };
  FixAssociation association(antenna);
  std::vector<PositionFix> taken;
  Stamp next_fix = kFirstFix_ns;
  const bool is_recorded = GENERATE(true, false);
  const auto add_fixes_until = [&](Stamp end) {
    for (; next_fix <= end; next_fix += kFix_ns)
      association.add(TimedPosition{next_fix, T_odom_body(next_fix) * antenna, 0.1});
  };
  if (is_recorded) add_fixes_until(20'000'000'000);
  for (Stamp t = 0; t < 10'000'000'000; t += kImage_ns) {
    if (!is_recorded) add_fixes_until(t - 300'000'000);  // live fixes are late
    OdometryState state{.stamp = t, .T_odom_body = T_odom_body(t)};
    association.add(state);
    if (t % (10 * kImage_ns) != 0) continue;
    KeyframeOdometry keyframe;
    keyframe.id = {3, static_cast<KeyframeIndex>(1 + t / (10 * kImage_ns))};
    keyframe.stamp = t;
    association.add(keyframe);
    for (const PositionFix& fix : association.take(5)) taken.push_back(fix);
  }
  REQUIRE(taken.size() >= 18);
  for (std::size_t k = 0; k < taken.size(); ++k) {
    const PositionFix& fix = taken[k];
    CHECK(fix.keyframe.index == k + 1);
    const Stamp keyframe_ns = static_cast<Stamp>(fix.keyframe.index - 1) * 10 * kImage_ns;
    CHECK((T_odom_body(keyframe_ns) * fix.p_kf - fix.p_datum).norm() < 1e-9);
    // No other fix is nearer: they are 130 ms apart.
    CHECK((fix.p_kf - antenna).norm() < 2.0 * 0.065);
  }
  CHECK(association.unused() > 2 * taken.size());
}

TEST_CASE("a robot that rests for an hour stores a minute") {
  constexpr Stamp kSecond_ns = 1'000'000'000, kHour_ns = 3600 * kSecond_ns;
  FixAssociation association(Eigen::Vector3d::Zero());
  KeyframeOdometry keyframe;
  const bool has_keyframe = GENERATE(true, false);  // before the rest
  keyframe.stamp = 2 * kSecond_ns;
  keyframe.id = {3, 1};
  if (has_keyframe) association.add(keyframe);
  std::size_t most = 0;
  for (Stamp t = 0; t < kHour_ns; t += kSecond_ns / 20) {
    OdometryState state{.stamp = t};
    association.add(state);
    if (t % (kSecond_ns / 5) == 0)
      association.add(TimedPosition{t + 7, {seconds_between(0, t), 0.0, 0.0}, 0.1});
    REQUIRE(association.take(5).empty());
    most = std::max(most, association.stored());
  }
  CHECK(most <= 61 * (20 + 5));
  keyframe.stamp = kHour_ns - kSecond_ns / 20;
  keyframe.id.index = 2;
  association.add(keyframe);
  KeyframeOdometry next = keyframe;
  next.id.index = 3;
  next.stamp = kHour_ns + kSecond_ns;
  association.add(next);
  std::vector<PositionFix> taken;
  for (Stamp t = kHour_ns; t <= kHour_ns + 5 * kSecond_ns; t += kSecond_ns / 20) {
    OdometryState state{.stamp = t};
    association.add(state);
    for (const PositionFix& fix : association.take(5)) taken.push_back(fix);
  }
  // Each keyframe has the nearest fix.
  REQUIRE(taken.size() == (has_keyframe ? 2 : 1));
  if (has_keyframe) CHECK(taken[0].p_datum.x() == Approx(2.0));
  CHECK(taken.back().keyframe.index == 2);
  CHECK(taken.back().p_datum.x() == Approx(3599.8));
}

TEST_CASE("fixes without odometry are stored in a bounded number") {
  FixAssociation association(Eigen::Vector3d::Zero());
  for (std::size_t i = 0; i < FixAssociation::kMaxAhead + 10; ++i)
    association.add(TimedPosition{static_cast<Stamp>(i), Eigen::Vector3d::Zero(), 0.1});
  CHECK(association.stored() == FixAssociation::kMaxAhead);
  CHECK(association.unused() == 10);
}

}  // namespace
}  // namespace km
