#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>

#include "apps/lab/simulation/dataset/recording.hpp"
#include "apps/lab/simulation/motion/default_rig.hpp"
#include "apps/lab/simulation/motion/flight_trajectory.hpp"
#include "apps/lab/simulation/rendering/sensor_effects.hpp"
#include "modules/core/io/text_rows.hpp"
#include "modules/evaluation/trajectory_file.hpp"
#include "test/support/image_file.hpp"
#include "test/support/shared_data.hpp"
#include "test/support/test.hpp"

// The Vicon room, seen from the poses of EuRoC's V1_01_easy: same lens and same motion, furniture
// of the same kind in other places.

namespace km {
namespace {

constexpr std::size_t kEvery = 10;  // step through the 100 recorded images

std::vector<Stamp> recorded_stamps(const fs::path& keyframes) {
  std::ifstream file(keyframes / "pairs.csv");
  std::string line;
  std::vector<Stamp> stamps;
  for (std::size_t i = 0; std::getline(file, line);) {
    const auto stamp = parse_int64(line.substr(0, line.find(',')));
    if (stamp && i++ % kEvery == 0) stamps.push_back(*stamp);
  }
  return stamps;
}

// The left camera of the recording, in the room.
class RoomCamera {
 public:
  // Encoded as JPEG, like the recorded images.
  cv::Mat take(const BodyMotion& motion) const {
    ExposureControl control({}, 20.0);
    Shot shot;
    shot.exposure = control.next(renderer_.render(meter_, motion.T_world_body, {}));
    shot.body_velocity << motion.angular_velocity_body,
        motion.T_world_body.linear().transpose() * motion.velocity_world;
    const RenderedView seen = renderer_.render(rays_, motion.T_world_body, effects_.request());
    return decoded(encode_gray(effects_.gray(seen, shot)), DecodedPixels::kGray);
  }

 private:
  World world_ = make_vicon_room(1);
  Renderer renderer_{world_};
  PixelRays rays_{default_rig(RigKind::kFlying, 752, 480).stereo.cameras[0]};
  PixelRays meter_{shrunk(rays_.camera(), ExposureControl::kMeterShrink)};
  SensorEffects effects_{rays_, {}};
};

// Sums of each figure over the images.
using Figures = std::map<std::string, double>;

void add(const cv::Mat& image, Figures& sums) {
  std::vector<cv::Point2f> corners;
  cv::goodFeaturesToTrack(image, corners, 0, 0.01, 15.0);
  std::vector<cv::KeyPoint> fast;
  cv::FAST(image, fast, 20);
  cv::Mat dx, dy, gradient;
  cv::Sobel(image, dx, CV_32F, 1, 0, 3, 1.0 / 8.0);
  cv::Sobel(image, dy, CV_32F, 0, 1, 3, 1.0 / 8.0);
  cv::magnitude(dx, dy, gradient);
  cv::Scalar mean, deviation;
  cv::meanStdDev(image, mean, deviation);
  sums["corners"] += static_cast<double>(corners.size());
  sums["FAST corners"] += static_cast<double>(fast.size());
  sums["grey level"] += mean[0];
  sums["grey level, standard deviation"] += deviation[0];
  sums["gradient"] += cv::mean(gradient)[0];
  sums["gradient, pixels above 10"] += cv::countNonZero(gradient > 10.0);
}

TEST_CASE("Rendered images of the Vicon room are like those recorded in it") {
  const auto recording = shared_data("euroc/V1_01_easy");
  if (!recording) return;
  const fs::path keyframes = *recording / "keyframes";
  const auto truth = read_trajectory(*recording / "mav0/state_groundtruth_estimate0");
  const Stamp epoch = truth.front().stamp;
  const SplineTrajectory flight = fit_recording(truth, epoch);
  const RoomCamera camera;
  Figures recorded, rendered;
  for (const Stamp stamp : recorded_stamps(keyframes)) {
    add(read_pixels(keyframes / (std::to_string(stamp) + "_0.jpg"), DecodedPixels::kGray),
        recorded);
    add(camera.take(flight.motion(seconds_between(epoch, stamp))), rendered);
  }
  REQUIRE(recorded.size() == 6);
  // The furniture stands elsewhere, so single views differ by more.
  constexpr double kShare = 0.25;
  for (const auto& [name, sum] : recorded) {
    CAPTURE(name);
    CHECK(rendered.at(name) == Approx(sum).epsilon(kShare));
  }
}

}  // namespace
}  // namespace km
