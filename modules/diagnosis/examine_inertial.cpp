#include "modules/diagnosis/examine_sensors.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "modules/core/lie.hpp"
#include "modules/core/text_table.hpp"
#include "modules/diagnosis/finding.hpp"
#include "modules/diagnosis/focal_fit.hpp"
#include "modules/diagnosis/image_rotation.hpp"
#include "modules/diagnosis/inertial_fit.hpp"
#include "modules/diagnosis/stereo_fit.hpp"
#include "modules/evaluation/statistics.hpp"

namespace km {
namespace {

using enum Severity;

double angle_between(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
  return so3_log(a.transpose() * b).norm();
}

// Least rotation for statements on the gyroscope, and bounds for further statements.
constexpr double kMinRate_radps = 0.02;
constexpr double kRelated = 0.6, kUnrelated = 0.3;  // bounds on InertialFit::explained
constexpr double kSecondAxis_radps = 0.02;          // least rate about a second axis

void examine_relation(const InertialFit& fit, Examination& result) {
  if (fit.explained > kRelated) return;
  result.add(fit.explained < kUnrelated ? kError : kWarning, "imu.unrelated",
             "the gyroscope explains " + percent(std::max(fit.explained, 0.0)) +
                 " of the rotation in the images (" + fixed(kDegrees * fit.image_rms, 1) +
                 " degrees/s), at any time offset within " + milliseconds(kMaxOffset_s),
             "the gyroscope is of another device, its stamps are off by more, or its samples "
             "are wrong",
             "check that camera and gyroscope are on one robot and use one clock");
}

void examine_scale(const InertialFit& fit, Examination& result) {
  constexpr double kPerDegree = 1.0 / kDegrees, kSlack = 0.1;
  const double off = std::abs(fit.scale - 1.0);
  if (off < kSlack) return;
  const bool in_degrees = std::abs(fit.scale / kPerDegree - 1.0) < kSlack;
  result.add(
      kError, in_degrees ? "imu.gyro_in_degrees" : "imu.gyro_scale",
      "the images rotate " + rounded(fit.scale, 4) + " times as fast as the gyroscope states" +
          (in_degrees ? ", and 1 degree is 0.01745 rad" : ""),
      in_degrees ? "the gyroscope states degrees/s, but odometry expects rad/s"
                 : "the gyroscope or the focal length is wrong by this factor",
      in_degrees ? "divide the samples by 57.2958" : "check the configured range of the gyroscope");
}

void examine_direction(const InertialFit& fit, const Camera& left, Examination& result) {
  const Eigen::Matrix3d R_cam_body = left.T_body_cam.linear().transpose();
  constexpr double kClose = 5.0 / kDegrees, kFar = 20.0 / kDegrees, kOff = 2.0 / kDegrees;
  if (fit.Q.determinant() < 0.0) {
    result.add(kError, "imu.mirrored",
               "the gyroscope's axes are left-handed: with one axis inverted it explains " +
                   percent(fit.mirror_gain) + " more of the rotation in the images",
               "no mounting of the camera explains this",
               "invert the mirrored axis; the data sheet of the sensor shows the axes");
    return;
  }
  const double angle = angle_between(R_cam_body, fit.Q);
  result.figure("camera to inertial sensor",
                "rotated by " + fixed(kDegrees * angle, 1) + " degrees against T_body_cam");
  if (angle < kOff) return;
  const bool is_inverse = angle > kFar && angle_between(R_cam_body.transpose(), fit.Q) < kClose;
  result.add(angle > kFar ? kError : kWarning,
             is_inverse ? "extrinsics.inverted" : "extrinsics.rotation",
             is_inverse ? "the rotation of T_body_cam (T_BS) is inverted: it is " +
                              fixed(kDegrees * angle, 0) + " degrees off, and its inverse " +
                              fixed(kDegrees * angle_between(R_cam_body.transpose(), fit.Q), 1)
                        : "the left camera is rotated by " + fixed(kDegrees * angle, 1) +
                              " degrees against T_body_cam",
             "odometry rotates in the wrong direction, or drifts",
             is_inverse ? "replace it by its inverse: T_BS maps points from the camera to the body"
                        : "calibrate cameras and inertial sensor together (Kalibr); "
                          "vio.calibrate corrects a few degrees");
}

void examine_offset(const InertialFit& fit, Examination& result) {
  constexpr double kSmall_s = 3e-3, kLarge_s = 5e-3, kSure = 4.0;
  if (fit.offset_at_limit) {
    result.figure("time offset",
                  "not determined: no best offset within " + milliseconds(kMaxOffset_s));
    return;
  }
  result.figure("time offset", milliseconds(fit.offset_s) + " +- " +
                                   milliseconds(fit.offset_sigma_s) +
                                   ", to be added to stamps of images");
  if (std::abs(fit.offset_s) < std::max(kSmall_s, kSure * fit.offset_sigma_s)) return;
  result.add(std::abs(fit.offset_s) < kLarge_s ? kNote : kWarning, "imu.time_offset",
             "stamps of the inertial sensor are " + milliseconds(std::abs(fit.offset_s)) + " (+- " +
                 milliseconds(fit.offset_sigma_s) + (fit.offset_s > 0.0 ? ") later" : ") earlier") +
                 " than those of the images",
             "odometry is less accurate until vio.calibrate has estimated the offset",
             "set camera_time_offset_s: " + rounded(fit.offset_s, 3) +
                 " in the rig file, or stamp both sensors by one clock");
}

void examine_focal(const SensorSample& sample, const StereoRig& rig, const VisualRotations& seen,
                   const InertialFit& inertial, Examination& result) {
  constexpr double kSlack = 0.015, kSure = 2.0, kMaxSigma = 0.01;
  constexpr const char* kName = "focal length by the gyroscope";
  const bool has_depth = 2 * seen.with_depth > seen.steps.size();
  const auto fit = has_depth ? fit_focal(sample.steps, rig, sample.imu, inertial) : std::nullopt;
  if (!fit || !(fit->sigma < kMaxSigma)) {
    result.figure(kName, std::string("not determined: ") +
                             (has_depth ? "too little rotation across the optical axis"
                                        : "no stereo depth that fits"));
    return;
  }
  const std::string factor = fixed(fit->factor, 3) + " +- " + fixed(fit->sigma, 3);
  result.figure(kName, "times " + factor + " of the calibration's");
  if (std::abs(fit->factor - 1.0) < std::max(kSlack, kSure * fit->sigma)) return;
  result.add(kWarning, "camera.focal",
             "the images agree with the gyroscope if the focal lengths are " + factor +
                 " times those of the calibration",
             "distances and rotations are wrong by this factor",
             "calibrate the cameras again at the resolution of the images, or check the scale of "
             "the gyroscope");
}

void examine_gravity(const SensorSample& sample, Examination& result) {
  std::vector<double> norms;
  norms.reserve(sample.imu.size());
  for (const ImuSample& measured : sample.imu) norms.push_back(measured.accel.norm());
  constexpr double kGravity = 9.81;
  const double found = quantile(std::move(norms), 0.5);
  result.figure("accelerometer", "median norm " + fixed(found, 2) + " m/s^2");
  const auto is_about = [found](double value) { return std::abs(found / value - 1.0) < 0.15; };
  if (is_about(kGravity) || std::isnan(found)) return;
  Finding finding{.id = "imu.gravity", .severity = kError};
  finding.what = "the accelerometer measures " + rounded(found, 3) + " in the median, gravity is " +
                 fixed(kGravity, 2) + " m/s^2";
  finding.means = "odometry estimates a wrong direction of gravity";
  finding.to_do = "write specific force in m/s^2, including gravity";
  if (is_about(1.0) || is_about(1e3)) {
    finding.id = "imu.accel_in_g";
    finding.means =
        is_about(1.0) ? "the accelerometer states g" : "the accelerometer states thousandths of g";
    finding.to_do =
        "multiply the samples by " + std::string(is_about(1.0) ? "9.80665" : "0.00980665");
  } else if (found < 0.3 * kGravity) {
    finding.id = "imu.no_gravity";
    finding.means = "the driver has subtracted gravity, or uses another unit";
    finding.to_do = "set the driver to raw acceleration";
  }
  result.findings.push_back(std::move(finding));
}

}  // namespace

Examination examine_inertial(const SensorSample& sample, const StereoRig& rig) {
  Examination result;
  if (sample.imu.empty()) return result;
  examine_gravity(sample, result);
  const bool use_depth =
      rig.depth_source == DepthSource::kRightImage && is_sound(fit_of(sample.stereo, rig));
  const VisualRotations seen = visual_rotations(sample.steps, rig, use_depth);
  const auto fit = fit_inertial(seen.steps, sample.imu);
  if (!fit || !(fit->image_rms >= kMinRate_radps)) {
    result.figure("images against the gyroscope",
                  fit ? "not determined: the camera turns by only " +
                            fixed(kDegrees * fit->image_rms, 2) + " degrees/s"
                      : "not determined: " + std::to_string(seen.steps.size()) +
                            " pairs of images close in time");
    return result;
  }
  result.figure("images against the gyroscope",
                percent(fit->explained) + " explained, " + std::to_string(fit->steps) +
                    " steps at " + fixed(kDegrees * fit->image_rms, 1) + " degrees/s");
  examine_relation(*fit, result);
  if (!(fit->explained >= kRelated)) return result;
  examine_scale(*fit, result);
  examine_offset(*fit, result);
  if (fit->gyro_rms[1] * fit->scale > kSecondAxis_radps)
    examine_direction(*fit, rig.cameras[0], result);
  else
    result.figure("camera to inertial sensor",
                  "not determined: the camera turns about one axis only");
  if (std::abs(fit->scale - 1.0) < 0.1) examine_focal(sample, rig, seen, *fit, result);
  return result;
}

}  // namespace km
