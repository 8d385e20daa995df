#include "modules/simulation/dataset/sensor_yaml.hpp"

#include <sstream>

#include "modules/simulation/dataset/number_text.hpp"

namespace km {
namespace {

std::string heading(const char* type, const std::string& comment) {
  return std::string("sensor_type: ") + type + "\ncomment: " + comment + "\n\n";
}

// T_BS: the sensor's frame in the body's.
std::string extrinsics(const SE3& T_body_sensor) {
  std::ostringstream text;
  text << "T_BS:\n  cols: 4\n  rows: 4\n  data: [";
  const Eigen::Matrix4d T = T_body_sensor.matrix();
  for (int row = 0; row < 4; ++row) {
    for (int column = 0; column < 4; ++column)
      text << number_text(T(row, column)) << (row == 3 && column == 3 ? "]\n\n" : ", ");
    if (row < 3) text << "\n         ";
  }
  return text.str();
}

std::string optics(const PinholeCamera& camera, double rate_hz) {
  std::ostringstream text;
  text << "rate_hz: " << number_text(rate_hz) << "\nresolution: [" << camera.width << ", "
       << camera.height << "]\ncamera_model: pinhole\nintrinsics: [" << number_text(camera.fx)
       << ", " << number_text(camera.fy) << ", " << number_text(camera.cx) << ", "
       << number_text(camera.cy) << "]  # fu, fv, cu, cv [px]\n"
       << "distortion_model: radial-tangential\ndistortion_coefficients: [";
  for (std::size_t i = 0; i < camera.distortion.size(); ++i)
    text << (i == 0 ? "" : ", ") << number_text(camera.distortion[i]);
  text << "]  # k1, k2, p1, p2\n";
  return text.str();
}

}  // namespace

std::string camera_yaml(const PinholeCamera& camera, double rate_hz, const std::string& comment) {
  return heading("camera", comment) + extrinsics(camera.T_body_cam) + optics(camera, rate_hz);
}

std::string depth_yaml(const PinholeCamera& camera, const DepthCameraFigures& figures,
                       const std::string& comment) {
  return heading("depth", comment) + extrinsics(camera.T_body_cam) +
         optics(camera, figures.rate_hz) +
         "depth_scale: 0.001  # [m] of a unit of the 16-bit images, along the optical axis\n"
         "min_range_m: " +
         number_text(figures.min_range_m) + "\nmax_range_m: " + number_text(figures.max_range_m) +
         "\nbaseline_m: " + number_text(figures.baseline_m) +
         "  # of the stereo camera that would have its errors\n";
}

std::string imu_yaml(const ImuNoise& noise, const std::string& comment) {
  std::ostringstream text;
  text << heading("imu", comment) << extrinsics(SE3::Identity())
       << "rate_hz: " << number_text(noise.rate_hz)
       << "\ngyroscope_noise_density: " << number_text(noise.gyro_noise_density)
       << "  # [rad/s/sqrt(Hz)]\ngyroscope_random_walk: " << number_text(noise.gyro_random_walk)
       << "  # [rad/s^2/sqrt(Hz)]\naccelerometer_noise_density: "
       << number_text(noise.accel_noise_density)
       << "  # [m/s^2/sqrt(Hz)]\naccelerometer_random_walk: "
       << number_text(noise.accel_random_walk) << "  # [m/s^3/sqrt(Hz)]\n";
  return text.str();
}

}  // namespace km
