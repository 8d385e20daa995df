#include <opencv2/core.hpp>

#include "modules/images/image_codec.hpp"
#include "modules/sensors/bag_dataset.hpp"
#include "modules/sensors/sensor_messages.hpp"
#include "test/modules/sensors/euroc_folder.hpp"
#include "test/modules/sensors/listed_bag.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

constexpr Stamp kFirst = 10'000'000'000;
constexpr Stamp kFramePeriod = 50'000'000, kSamplePeriod = 5'000'000;
constexpr int kWidth = 6, kHeight = 4;

Rig small_rig() {
  Rig rig;
  rig.topics = {
      .left = "/left", .right = "/right", .depth = {}, .imu = "/imu", .gyro = {}, .accel = {}};
  for (Camera& camera : rig.sensors.stereo.cameras)
    camera = {.width = kWidth, .height = kHeight, .fx = 5, .fy = 5, .cx = 3, .cy = 2};
  rig.sensors.stereo.cameras[1].T_body_cam.translation().x() = 0.1;
  return rig;
}

RosImage image(Stamp stamp, std::uint8_t grey) {
  return mono_image({stamp, "camera"}, kWidth, kHeight, grey);
}

RosImu imu(Stamp stamp) {
  RosImu message;
  message.header.stamp = stamp;
  message.angular_velocity = {1e-9 * static_cast<double>(stamp - kFirst), 0, 0};
  message.linear_acceleration = {0, 0, 9.81};
  return message;
}

struct Plan {
  int frames = 40;
  Stamp right_late = 0;  // after the left stamp
  std::vector<int> rights_lost = {};
  bool has_imu = true;
  Stamp sample_period = kSamplePeriod;
};

std::unique_ptr<ListedBag> recording(const Plan& plan) {
  auto bag = std::make_unique<ListedBag>();
  const Stamp end = kFirst + plan.frames * kFramePeriod;
  for (Stamp stamp = kFirst - 1'500'000'000; stamp <= end; stamp += plan.sample_period) {
    if (plan.has_imu) bag->add("/imu", imu(stamp));
    const auto frame = static_cast<int>((stamp - kFirst) / kFramePeriod);
    if (stamp < kFirst || (stamp - kFirst) % kFramePeriod != 0 || frame == plan.frames) continue;
    bag->add("/left", image(stamp, static_cast<std::uint8_t>(frame)));
    if (std::ranges::find(plan.rights_lost, frame) == plan.rights_lost.end())
      bag->add("/right", image(stamp + plan.right_late, static_cast<std::uint8_t>(100 + frame)));
  }
  return bag;
}

TEST_CASE("Messages of a bag become packets without a hole between them") {
  BagDataset dataset("test.bag", recording({}), small_rig());
  CHECK(dataset.pair_count() == 40);
  const auto packets = packets_of(dataset);
  REQUIRE(packets.size() == 40);
  for (std::size_t k = 0; k < packets.size(); ++k) {
    const SensorPacket& packet = packets[k];
    const Stamp stamp = kFirst + static_cast<Stamp>(k) * kFramePeriod;
    CAPTURE(k);
    CHECK(packet.frame->stamp == stamp);
    CHECK(packet.frame->left.pixels == std::vector<std::uint8_t>(24, static_cast<std::uint8_t>(k)));
    CHECK(packet.frame->right.pixels.front() == 100 + k);
    CHECK(packet.imu.size() == (k == 0 ? 201U : 11U));  // a second before the first frame
    CHECK(packet.imu.back().stamp == stamp);
    CHECK(packet.imu.back().gyro.x() == Approx(0.05 * static_cast<double>(k)).margin(1e-12));
  }
  CHECK(dataset.report().empty());
  CHECK(dataset.remarks().empty());
}

TEST_CASE("Inertial samples at a lower rate than stated have no gaps") {
  const Stamp period = GENERATE(10'000'000, 25'000'000, 50'000'000);
  BagDataset dataset("test.bag", recording({.sample_period = period}), small_rig());
  CHECK(packets_of(dataset).size() == 40);
  CHECK(dataset.report().empty());
}

TEST_CASE("Poses of an odometry replace inertial samples") {
  const bool is_live_late = GENERATE(false, true);  // logged after their frame
  CAPTURE(is_live_late);
  Rig rig = small_rig();
  rig.topics.imu.clear();
  rig.topics.odometry = "/odom";
  rig.T_child_body.translation().z() = 0.5;
  auto bag = std::make_unique<ListedBag>();
  for (int k = 0; k < 20; ++k) {
    const Stamp stamp = kFirst + k * kFramePeriod;
    RosOdometry odometry;
    odometry.header.stamp = stamp - kFramePeriod / 2;
    odometry.pose.pose.position.x() = k - 0.5;
    if (!is_live_late && k != 7) bag->add("/odom", odometry);
    bag->add("/left", image(stamp, static_cast<std::uint8_t>(k)));
    bag->add("/right", image(stamp, static_cast<std::uint8_t>(k)));
    if (is_live_late && k != 7) bag->add("/odom", odometry);
  }
  BagDataset dataset("test.bag", std::move(bag), rig);
  CHECK(dataset.gives_poses());
  const auto packets = packets_of(dataset);
  REQUIRE(packets.size() == 19);  // no pose follows the last image
  for (std::size_t k = 0; k < packets.size(); ++k) {
    CAPTURE(k);
    CHECK(packets[k].imu.empty());
    REQUIRE(packets[k].pose);
    CHECK(packets[k].pose->T_odom_body.translation().isApprox(
        Eigen::Vector3d(static_cast<double>(k), 0, 0.5), 1e-9));
  }
  CHECK(dataset.report().count(ReaderFault::kFrameWithoutPose) == 1);
  rig.topics.odometry = "/left";
  auto other = std::make_unique<ListedBag>();
  other->add("/left", image(kFirst, 1));
  other->add("/right", image(kFirst, 1));
  CHECK_THROWS_WITH(BagDataset("test.bag", std::move(other), rig),
                    Contains("not of nav_msgs/Odometry"));
}

TEST_CASE("A frame without its right image is counted and the other frames stay") {
  const std::vector<int> lost =
      GENERATE(std::vector{0}, std::vector{7}, std::vector{30, 31}, std::vector{39});
  const Stamp late = GENERATE(0, 2'000'000);
  BagDataset dataset("test.bag", recording({.right_late = late, .rights_lost = lost}), small_rig());
  const auto packets = packets_of(dataset);
  CHECK(packets.size() == 40 - lost.size());
  for (const SensorPacket& packet : packets)
    CHECK(packet.frame->right.pixels[0] == packet.frame->left.pixels[0] + 100);
  CHECK(dataset.report().count(ReaderFault::kLeftWithoutRight) == lost.size());
  // A missing image is detected by its stamp only with images after it and enough images before it.
  const bool is_between = lost == std::vector{30, 31};
  CHECK(dataset.report().count(ReaderFault::kMissingBetween) == (is_between ? lost.size() : 0));
  CHECK(dataset.report().entries().size() == (is_between ? 2 : 1));
  // A constant offset of a camera is reported.
  CHECK(dataset.remarks() ==
        (late > 0 ? std::vector<std::string>{"the right image is stamped 2.00 ms after the left "
                                             "one, within 1.00 ms"}
                  : std::vector<std::string>{}));
}

TEST_CASE("A window of a bag begins with the second before it") {
  BagDataset dataset("test.bag", recording({}), small_rig(), {.from_s = 0.5, .to_s = 1.0});
  const auto packets = packets_of(dataset);
  REQUIRE(packets.size() == 10);
  CHECK(packets.front().frame->stamp == kFirst + 10 * kFramePeriod);
  CHECK(packets.front().imu.size() == 201);
  CHECK(!dataset.next());
  BagDataset resumed("test.bag", recording({}), small_rig(),
                     {.not_before = kFirst + 30 * kFramePeriod});
  CHECK(packets_of(resumed).size() == 10);
  for (const RecordingPart& part :
       {RecordingPart{.from_s = std::nan("")}, RecordingPart{.to_s = std::nan("")},
        RecordingPart{.from_s = 1.0, .to_s = 1.0}})
    CHECK_THROWS_AS(BagDataset("test.bag", recording({}), small_rig(), part),
                    std::invalid_argument);
  CHECK_THROWS_WITH(BagDataset("test.bag", recording({}), small_rig(), {.from_s = 50.0}),
                    StartsWith("test.bag: no frame") && Contains("from 50 s"));
}

TEST_CASE("Missing topics are refused and the existing topics are listed") {
  Rig rig = small_rig();
  rig.topics.right = "/rihgt";
  CHECK_THROWS_WITH(BagDataset("test.bag", recording({}), rig),
                    "test.bag: no topic /rihgt; topics with images: /left, /right");
  rig.topics.right = "/imu";
  CHECK_THROWS_WITH(BagDataset("test.bag", recording({}), rig),
                    Contains("/imu has messages of sensor_msgs/Imu"));
  CHECK_THROWS_WITH(BagDataset("test.bag", recording({.has_imu = false}), small_rig()),
                    "test.bag: no topic /imu; topics with inertial samples: none");
}

// A bag with parts that cannot be read.
class DamagedBag final : public BagReader {
 public:
  explicit DamagedBag(std::unique_ptr<ListedBag> rest) : rest_(std::move(rest)) {}

  const std::vector<BagChannel>& channels() const override { return rest_->channels(); }
  std::optional<BagMessage> next() override { return rest_->next(); }
  BagReport report() const override {
    BagReport report;
    report.add(BagFault::kCompression, "test.bag byte 77: compression lz5", 3);
    report.add(BagFault::kTruncated, "test.bag byte 990: the file has no end");
    return report;
  }

 private:
  std::unique_ptr<ListedBag> rest_;
};

TEST_CASE("Unreadable parts of a bag are counted with their place") {
  const auto damaged = [](std::unique_ptr<ListedBag> rest) {
    return std::make_unique<DamagedBag>(std::move(rest));
  };
  BagDataset dataset("test.bag", damaged(recording({})), small_rig());
  CHECK(packets_of(dataset).size() == 40);
  CHECK(dataset.report().count(ReaderFault::kDamagedBag) == 4);
  CHECK_THAT(dataset.report().entries().at(ReaderFault::kDamagedBag).first,
             Contains("test.bag byte"));
  // If nothing is left, the damage may be the cause.
  CHECK_THROWS_WITH(BagDataset("test.bag", damaged(std::make_unique<ListedBag>()), small_rig()),
                    Contains("no topic /left; topics with images: none") &&
                        Contains("4 damaged pieces of the recording, first: ") &&
                        Contains("test.bag byte"));
  auto bag = std::make_unique<ListedBag>();
  for (const char* topic : {"/left", "/right"}) bag->describe(topic, RosImage::kType);
  bag->describe("/imu", RosImu::kType);
  CHECK_THROWS_WITH(BagDataset("test.bag", damaged(std::move(bag)), small_rig()),
                    Contains("no message on /left; no message on /right; no message on /imu") &&
                        Contains("damaged pieces"));
}

TEST_CASE("A bad message of a bag affects no other message") {
  auto bag = recording({.frames = 0});
  for (int k = 0; k < 30; ++k) {
    const Stamp stamp = kFirst + k * kFramePeriod;
    for (Stamp at = stamp + kSamplePeriod; at <= stamp + kFramePeriod; at += kSamplePeriod)
      bag->add("/imu", imu(at));
    RosImage left = image(stamp, 1);
    if (k == 3) left.width = 5;
    if (k == 4) left.encoding = "nv21";
    if (k == 5) left.header.stamp -= 10 * kFramePeriod;
    if (k == 6) left.header.stamp += 86'400'000'000'000;
    bag->add("/left", left, k == 6 ? -86'400.0 : 0.0);
    bag->add("/right", image(stamp, 2));
    if (k == 8) bag->add_bytes("/left", RosImage::kType, stamp, {0, 1, 0, 0, 7});
    if (k != 9) continue;
    RosImu corrupted = imu(stamp + kFramePeriod + 1);
    corrupted.linear_acceleration.x() = std::numeric_limits<double>::quiet_NaN();
    bag->add("/imu", corrupted);
    corrupted.linear_acceleration.x() = 1e30;
    corrupted.header.stamp += 1;
    bag->add("/imu", corrupted);
    bag->add("/imu", corrupted);
    corrupted.header.stamp -= 100'000'000;
    bag->add("/imu", corrupted);
    corrupted.header.stamp += 86'400'000'000'000;
    bag->add("/imu", corrupted, -86'400.0);
    bag->add_bytes("/imu", RosImu::kType, stamp + kFramePeriod + 3, {0, 1, 0, 0, 7});
  }
  BagDataset dataset("test.bag", std::move(bag), small_rig());
  CHECK(packets_of(dataset).size() == 26);
  const ReaderReport report = dataset.report();
  for (const ReaderFault fault :
       {ReaderFault::kWrongImageSize, ReaderFault::kWrongImageFormat, ReaderFault::kUnorderedStamp,
        ReaderFault::kJumpingStamp, ReaderFault::kMalformedMessage, ReaderFault::kNotFinite,
        ReaderFault::kImplausible, ReaderFault::kMalformedSample, ReaderFault::kUnorderedSample,
        ReaderFault::kRepeatedSample, ReaderFault::kJumpingSample}) {
    CAPTURE(to_string(fault));
    CHECK(report.count(fault) == 1);
  }
  CHECK(report.count(ReaderFault::kRightWithoutLeft) == 2);
  CHECK(to_string(report).find("test.bag: /left recorded at 10150000000: 5x4 px") !=
        std::string::npos);
}

TEST_CASE("Gyroscope and accelerometer with their own stamps are joined") {
  auto bag = std::make_unique<ListedBag>();
  constexpr Stamp kGyroPeriod = 2'500'000, kAccelPeriod = 16'000'000;
  for (Stamp at = 0; at < 3'000'000'000; at += 500'000) {
    const Stamp stamp = kFirst + at;
    const double t = 1e-9 * static_cast<double>(at);
    RosImu message;
    message.header.stamp = stamp;
    message.angular_velocity.y() = t;
    message.linear_acceleration.z() = 9.81 + 2.0 * t;
    if (at % kGyroPeriod == 0) bag->add("/gyro", message);
    if (at % kAccelPeriod == 3'000'000) bag->add("/accel", message);
    if (at % kFramePeriod != 0) continue;
    bag->add("/left", image(stamp, 1));
    bag->add("/right", image(stamp, 2));
  }
  Rig rig = small_rig();
  rig.topics.imu.clear();
  rig.topics.gyro = "/gyro";
  rig.topics.accel = "/accel";
  BagDataset dataset("test.bag", std::move(bag), rig);
  const auto packets = packets_of(dataset);
  CHECK(packets.size() == 59);  // the first frame is before the first acceleration
  for (const SensorPacket& packet : packets)
    for (const ImuSample& sample : packet.imu) {
      const double t = seconds_between(kFirst, sample.stamp);
      CHECK(sample.gyro.y() == Approx(t));
      CHECK(sample.accel.z() == Approx(9.81 + 2.0 * t).epsilon(1e-12));
    }
  CHECK(dataset.report().count(ReaderFault::kNoAcceleration) == 2);
  CHECK(dataset.report().count(ReaderFault::kPairWithoutImu) == 1);
}

TEST_CASE("Depth of a bag joins its frame, at a lower rate too") {
  Rig rig = small_rig();
  rig.topics.right.clear();
  rig.topics.depth = "/depth";
  rig.sensors.stereo = rgbd_rig(rig.sensors.stereo.cameras[0], 0.1);
  rig.sensors.depth = DepthRange{};
  const bool in_metres = GENERATE(false, true);
  auto bag = std::make_unique<ListedBag>();
  for (int k = 0; k < 40; ++k) {
    const Stamp stamp = kFirst + k * kFramePeriod;
    bag->add("/imu", imu(stamp));
    bag->add("/left", image(stamp, 1));
    if (k % 4 != 0) continue;
    RosImage depth = image(stamp + 8'000'000, 0);
    if (in_metres) {
      const float value = 1.5F;
      depth.encoding = "32FC1";
      depth.step = 4 * kWidth;
      depth.data.resize(std::size_t{4} * kWidth * kHeight);
      for (std::size_t i = 0; i < depth.data.size(); i += 4)
        std::memcpy(depth.data.data() + i, &value, 4);
    } else {
      depth.encoding = "16UC1";
      depth.step = 2 * kWidth;
      depth.is_bigendian = true;
      depth.data.clear();
      for (int i = 0; i < kWidth * kHeight; ++i)
        depth.data.insert(depth.data.end(), {1500 / 256, 1500 % 256});
    }
    bag->add("/depth", depth, 0.02);
  }
  BagDataset dataset("test.bag", std::move(bag), rig);
  const auto packets = packets_of(dataset);
  REQUIRE(packets.size() == 40);
  for (std::size_t k = 0; k < packets.size(); ++k) {
    CAPTURE(k);
    REQUIRE((packets[k].frame->depth != nullptr) == (k % 4 == 0));
    if (packets[k].frame->depth)
      CHECK(packets[k].frame->depth->millimetres == std::vector<std::uint16_t>(24, 1500));
  }
  CHECK(dataset.remarks().size() == 1);
}

TEST_CASE("Images of every common encoding become the same grey") {
  struct Kind {
    const char* encoding;
    std::vector<std::uint8_t> pixel;  // one grey level, 90; mono16 of 16 and 12 bits
  };
  const Kind kind = GENERATE(
      Kind{"mono8", {90}}, Kind{"8UC1", {90}}, Kind{"bgr8", {90, 90, 90}},
      Kind{"rgb8", {90, 90, 90}}, Kind{"bgra8", {90, 90, 90, 7}}, Kind{"rgba8", {90, 90, 90, 7}},
      Kind{"8UC3", {90, 90, 90}}, Kind{"bayer_rggb8", {90}}, Kind{"bayer_bggr8", {90}},
      Kind{"bayer_gbrg8", {90}}, Kind{"bayer_grbg8", {90}}, Kind{"mono16", {1, 90}},
      Kind{"mono16", {0xa1, 5}}, Kind{"yuv422", {128, 90}}, Kind{"yuv422_yuy2", {90, 128}});
  CAPTURE(kind.encoding);
  RosImage message = image(kFirst, 0);
  message.encoding = kind.encoding;
  message.step = static_cast<std::uint32_t>(kWidth * kind.pixel.size() + 3);  // padded rows
  message.data.clear();
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x)
      message.data.insert(message.data.end(), kind.pixel.begin(), kind.pixel.end());
    message.data.insert(message.data.end(), {1, 2, 3});
  }
  const BagChannel channel{"/left", "sensor_msgs/msg/Image", "cdr", 1};
  const ImageResult gray =
      gray_of_message(channel, {0, kFirst, encode_ros(message)}, "here", {kWidth, kHeight});
  CAPTURE(gray.problem);
  REQUIRE(!gray.fault);
  CHECK(gray.image.pixels == std::vector<std::uint8_t>(kWidth * kHeight, 90));

  const cv::Mat pixels(kHeight, kWidth, CV_8UC1, cv::Scalar(90));
  for (const auto& file : {encode_png(pixels), encode_jpeg(pixels, 95)}) {
    const RosCompressedImage compressed{{kFirst, "camera"}, "", file};
    const ImageResult same =
        gray_of_message({"/left", "sensor_msgs/CompressedImage", "cdr", 1},
                        {0, kFirst, encode_ros(compressed)}, "here", {kWidth, kHeight});
    CHECK(same.image.pixels == gray.image.pixels);
  }
}

TEST_CASE("Colours of every common encoding are those of the scene") {
  const auto color_of = [](const char* encoding, const std::vector<std::uint8_t>& pixels) {
    RosImage message = image(kFirst, 0);
    message.encoding = encoding;
    message.step = static_cast<std::uint32_t>(kWidth * pixels.size() / 4);
    message.data.clear();
    for (int y = 0; y < kHeight; y += 2)  // `pixels`: two by two of them
      for (const std::size_t row : {std::size_t{0}, pixels.size() / 2})
        for (int x = 0; x < kWidth; x += 2)
          message.data.insert(message.data.end(), pixels.begin() + static_cast<long>(row),
                              pixels.begin() + static_cast<long>(row + pixels.size() / 2));
    return color_of_message({"/left", "sensor_msgs/msg/Image", "cdr", 1},
                            {0, kFirst, encode_ros(message)}, {kWidth, kHeight});
  };
  const auto repeated = [](std::vector<std::uint8_t> pixel) {
    std::vector<std::uint8_t> four;
    for (int k = 0; k < 4; ++k) four.insert(four.end(), pixel.begin(), pixel.end());
    return four;
  };
  const ColorImage::Pixel orange{200, 100, 20};
  const auto is_orange = [&](const ColorImage& color) {
    return color.width == kWidth && color.height == kHeight &&
           color.pixels.at(2 * kWidth + 2) == orange && color.pixels.at(3 * kWidth + 3) == orange;
  };
  CHECK(is_orange(color_of("rgb8", repeated({200, 100, 20}))));
  CHECK(is_orange(color_of("bgr8", repeated({20, 100, 200}))));
  CHECK(is_orange(color_of("rgba8", repeated({200, 100, 20, 7}))));
  CHECK(is_orange(color_of("bgra8", repeated({20, 100, 200, 7}))));
  CHECK(is_orange(color_of("bayer_rggb8", {200, 100, 100, 20})));
  CHECK(is_orange(color_of("bayer_bggr8", {20, 100, 100, 200})));
  CHECK(is_orange(color_of("bayer_grbg8", {100, 200, 20, 100})));
  CHECK(is_orange(color_of("bayer_gbrg8", {100, 20, 200, 100})));
  CHECK(color_of("mono8", repeated({90})).pixels.empty());

  const RosCompressedImage compressed{
      {kFirst, "camera"},
      "",
      encode_png(cv::Mat(kHeight, kWidth, CV_8UC3, cv::Scalar(20, 100, 200)))};
  CHECK(is_orange(color_of_message({"/left", "sensor_msgs/CompressedImage", "cdr", 1},
                                   {0, kFirst, encode_ros(compressed)}, {kWidth, kHeight})));
}

TEST_CASE("The name of a Bayer pattern determines the place of its colours") {
  // A red scene: only red pixels are bright.
  RosImage message = image(kFirst, 0);
  message.encoding = "bayer_rggb8";
  for (std::size_t y = 0; y < kHeight; y += 2)
    for (std::size_t x = 0; x < kWidth; x += 2) message.data[y * kWidth + x] = 200;
  const BagChannel channel{"/left", "sensor_msgs/msg/Image", "cdr", 1};
  const auto inner_gray = [&](const char* encoding) {
    message.encoding = encoding;
    const auto gray =
        gray_of_message(channel, {0, kFirst, encode_ros(message)}, "here", {kWidth, kHeight});
    return static_cast<int>(gray.image.pixels[2 * kWidth + 2]);
  };
  CHECK(inner_gray("bayer_rggb8") == Approx(0.299 * 200).margin(1.0));  // ITU-R BT.601
  CHECK(inner_gray("bayer_bggr8") == Approx(0.114 * 200).margin(1.0));
}

TEST_CASE("Compressed depth is decoded by the format that its message states") {
  struct Case {
    std::string format;
    std::vector<std::uint8_t> bytes;  // after the header
    float A, B;                       // numbers of the quantisation
    std::vector<std::uint16_t> expected_mm;
  };
  cv::Mat stored(1, 4, CV_16UC1, cv::Scalar(0));
  stored.at<std::uint16_t>(0, 1) = 2000;
  stored.at<std::uint16_t>(0, 3) = 4040;
  const std::vector<std::uint8_t> png = encode_png(stored);
  // Width, height, and the nibbles 1 1 8CE7 1 1 8EF7 of two runs of one zero and one difference.
  const std::vector<std::uint8_t> rvl = {4,    0,    0,    0,    1, 0, 0,    0,
                                         0x11, 0xE7, 0x8C, 0x11, 0, 0, 0xF7, 0x8E};
  const Case c = GENERATE_COPY(
      Case{"16UC1; compressedDepth png", png, 0, 0, {0, 2000, 0, 4040}},
      Case{"16UC1; compressedDepth", png, 0, 0, {0, 2000, 0, 4040}},
      Case{"16UC1; compressedDepth rvl", rvl, 0, 0, {0, 2000, 0, 4040}},
      Case{"32FC1; compressedDepth rvl", rvl, 8080, 1980, {0, 0, 0, 3922}},  // 404 m is too far
      Case{"32FC1; compressedDepth png", png, 8080, 1980, {0, 0, 0, 3922}});
  CAPTURE(c.format);
  const auto depth_of = [&](std::size_t lost_bytes, const std::string& format) {
    RosCompressedImage image{{kFirst, "depth"}, format, std::vector<std::uint8_t>(12, 0)};
    std::memcpy(image.data.data() + 4, &c.A, 4);
    std::memcpy(image.data.data() + 8, &c.B, 4);
    image.data.insert(image.data.end(), c.bytes.begin(), c.bytes.end());
    image.data.resize(image.data.size() - lost_bytes);
    return depth_of_message({"/depth", "sensor_msgs/CompressedImage", "cdr", 1},
                            {0, kFirst, encode_ros(image)}, "here", {4, 1}, 1e-3, {0.0, 60.0});
  };
  CHECK(depth_of(0, c.format).image.millimetres == c.expected_mm);
  CHECK(depth_of(8, c.format).fault == ReaderFault::kUnreadableImage);
  CHECK_THAT(depth_of(c.bytes.size(), "h264").problem, Contains("states the format 'h264'"));
}

TEST_CASE("A recording continues after its clock was set") {
  // Back by more than the recording before it, or forward by years.
  const Stamp kStep = GENERATE(10'000'000'000, -1'600'000'000'000'000'000);
  CAPTURE(kStep);
  auto whole = recording({.frames = 80});
  auto bag = std::make_unique<ListedBag>();
  while (const auto message = whole->next()) {
    const BagChannel& channel = whole->channels()[message->channel];
    const Stamp by = message->log_time > kFirst + 40 * kFramePeriod ? kStep : 0;
    if (channel.topic == "/imu") {
      RosImu sample = imu(message->log_time);
      sample.header.stamp -= by;
      bag->add(channel.topic, sample, 1e-9 * static_cast<double>(by));
    } else {
      RosImage picture = image(message->log_time - by, 0);
      bag->add(channel.topic, picture, 1e-9 * static_cast<double>(by));
    }
  }
  BagDataset dataset("test.bag", std::move(bag), small_rig(), {.to_s = 60.0});
  const auto packets = packets_of(dataset);
  CHECK(packets.size() == 80);
  for (std::size_t k = 1; k < packets.size(); ++k) {
    const double step_s = seconds_between(packets[k - 1].frame->stamp, packets[k].frame->stamp);
    CHECK((k == 41 && kStep < 0 ? step_s > 1e9 : step_s == Approx(0.05)));
    CHECK(packets[k].imu.back().stamp == packets[k].frame->stamp);
  }
  const std::string report = to_string(dataset.report());
  CHECK(dataset.report().entries().size() == (kStep < 0 ? 0 : 1));
  if (kStep > 0) CHECK_THAT(report, Contains("the clock went back 10.0 s"));
}

}  // namespace
}  // namespace km
