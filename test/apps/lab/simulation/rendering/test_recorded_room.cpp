#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <map>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "apps/lab/simulation/dataset/image_encoding.hpp"
#include "apps/lab/simulation/motion/default_rig.hpp"
#include "apps/lab/simulation/motion/recorded_trajectory.hpp"
#include "apps/lab/simulation/rendering/sensor_effects.hpp"
#include "modules/core/text_rows.hpp"
#include "modules/evaluation/trajectory_file.hpp"
#include "modules/images/image_view.hpp"
#include "test/support/image_file.hpp"
#include "test/support/shared_data.hpp"

// The Vicon room, seen from the poses of EuRoC's V1_01_easy: same lens and same motion, furniture
// of the same kind in other places.

namespace km {
namespace {

constexpr std::size_t kEvery = 10;  // step through the 100 recorded pairs

std::vector<Stamp> recorded_stamps(const std::filesystem::path& keyframes) {
  std::ifstream file(keyframes / "pairs.csv");
  std::string line;
  std::vector<Stamp> stamps;
  for (std::size_t i = 0; std::getline(file, line);) {
    const auto stamp = parse_int64(line.substr(0, line.find(',')));
    if (stamp && i++ % kEvery == 0) stamps.push_back(*stamp);
  }
  return stamps;
}

GrayImage gray_image(const cv::Mat& image) {
  REQUIRE(image.isContinuous());
  return {image.cols, image.rows, {image.datastart, image.dataend}};
}

// The cameras of the recording, in the room.
class RoomCameras {
 public:
  explicit RoomCameras(const RecordedTrajectory& flight) : flight_(flight) {}

  StereoFrame take(Stamp stamp) const {
    const BodyMotion motion = motion_at(stamp);
    Shot shot;
    shot.exposure = exposure(stamp);
    shot.body_velocity << motion.angular_velocity_body,
        motion.T_world_body.linear().transpose() * motion.velocity_world;
    StereoFrame frame{stamp, {}, {}};
    frame.left = view(left_, left_effects_, motion.T_world_body, shot, 1);
    frame.right = view(right_, right_effects_, motion.T_world_body, shot, 2);
    return frame;
  }

 private:
  BodyMotion motion_at(Stamp stamp) const {
    return flight_.trajectory.motion(seconds_between(flight_.epoch, stamp));
  }

  // As of a camera that has been running for some seconds.
  Exposure exposure(Stamp stamp) const {
    ExposureControl control(config_, 20.0);
    Exposure exposure;
    for (int i = 40; i >= 0; --i) {
      const Stamp at = std::max(flight_.epoch, stamp - i * nanoseconds(0.05));
      exposure = control.next(renderer_.render(meter_, motion_at(at).T_world_body, {}));
    }
    return exposure;
  }

  // Encoded as JPEG, like the recorded ones.
  GrayImage view(const PixelRays& rays, const SensorEffects& effects, const SE3& T_world_body,
                 Shot shot, std::uint64_t camera) const {
    shot.noise_seed = camera;
    const RenderedView seen = renderer_.render(rays, T_world_body, effects.request(false));
    const auto bytes = encode_gray(effects.gray(seen, shot), ImageFormat::kJpeg);
    return gray_image(decoded(bytes, DecodedPixels::kGray));
  }

  const RecordedTrajectory& flight_;
  SensorEffectsConfig config_;
  World world_ = make_vicon_room(1);
  Renderer renderer_{world_};
  StereoRig rig_ = default_rig(RigKind::kFlying, 752, 480).stereo;
  PixelRays left_{rig_.cameras[0]};
  PixelRays right_{rig_.cameras[1]};
  SensorEffects left_effects_{left_, config_};
  SensorEffects right_effects_{right_, config_};
  PixelRays meter_{shrunk(rig_.cameras[0], ExposureControl::kMeterShrink)};
};

double corner_count(const cv::Mat& image) {
  std::vector<cv::Point2f> corners;
  cv::goodFeaturesToTrack(image, corners, 0, 0.01, 15.0);
  return static_cast<double>(corners.size());
}

// ORB features of the left image that clearly match one of the right image.
double orb_matches(const cv::Mat& left, const cv::Mat& right) {
  cv::Mat a, b;
  std::vector<cv::KeyPoint> keypoints;
  const auto orb = cv::ORB::create(1000);
  orb->detectAndCompute(left, cv::noArray(), keypoints, a);
  orb->detectAndCompute(right, cv::noArray(), keypoints, b);
  std::vector<std::vector<cv::DMatch>> best;
  cv::BFMatcher(cv::NORM_HAMMING).knnMatch(a, b, best, 2);
  return static_cast<double>(std::ranges::count_if(
      best, [](const auto& pair) { return pair[0].distance < 0.8F * pair[1].distance; }));
}

// Sums of each figure over the pairs of images.
using Figures = std::map<std::string, double>;

void add_pair(const StereoFrame& frame, Figures& sums) {
  const cv::Mat left = view(frame.left), right = view(frame.right);
  std::vector<cv::KeyPoint> fast;
  cv::FAST(left, fast, 20);
  cv::Mat dx, dy, gradient, laplacian;
  cv::Sobel(left, dx, CV_32F, 1, 0, 3, 1.0 / 8.0);
  cv::Sobel(left, dy, CV_32F, 0, 1, 3, 1.0 / 8.0);
  cv::magnitude(dx, dy, gradient);
  cv::Laplacian(left, laplacian, CV_32F);
  const auto deviation = [](const cv::Mat& image) {
    cv::Scalar mean, sigma;
    cv::meanStdDev(image, mean, sigma);
    return sigma[0];
  };
  sums["corners, left"] += corner_count(left);
  sums["corners, right"] += corner_count(right);
  sums["FAST corners"] += static_cast<double>(fast.size());
  sums["ORB matches, left to right"] += orb_matches(left, right);
  sums["grey level"] += cv::mean(left)[0];
  sums["grey level, standard deviation"] += deviation(left);
  sums["right over left"] += cv::mean(right)[0] / cv::mean(left)[0];
  sums["gradient"] += cv::mean(gradient)[0];
  sums["gradient, pixels above 10"] += cv::countNonZero(gradient > 10.0);
  sums["Laplacian, standard deviation"] += deviation(laplacian);
}

}  // namespace

TEST_CASE("Rendered images of the Vicon room are like those recorded in it",
          "[simulation][recorded][slow]") {
  const auto recording = shared_data("euroc/V1_01_easy");
  if (!recording) return;
  const auto keyframes = *recording / "keyframes";
  const auto truth = read_trajectory(*recording / "mav0/state_groundtruth_estimate0");
  const RecordedTrajectory flight = fit_recording(truth, truth.front().stamp);
  const RoomCameras cameras(flight);
  Figures recorded, rendered;
  for (const Stamp stamp : recorded_stamps(keyframes)) {
    const auto image = [&](const char* camera) {
      return gray_image(
          read_pixels(keyframes / (std::to_string(stamp) + camera), DecodedPixels::kGray));
    };
    add_pair({stamp, image("_0.jpg"), image("_1.jpg")}, recorded);
    add_pair(cameras.take(stamp), rendered);
  }
  REQUIRE(recorded.size() == 10);

  // The furniture stands elsewhere, so single views differ by more.
  constexpr double kShare = 0.25;
  for (const auto& [name, sum] : recorded) {
    CAPTURE(name);
    CHECK(rendered.at(name) == Approx(sum).epsilon(kShare));
  }
}

}  // namespace km
