#include "modules/diagnosis/examine_sensors.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "modules/core/lie.hpp"
#include "modules/core/text_table.hpp"
#include "modules/diagnosis/focal_fit.hpp"
#include "modules/diagnosis/inertial_fit.hpp"
#include "modules/diagnosis/seen_rotations.hpp"
#include "modules/diagnosis/stereo_fit.hpp"
#include "modules/evaluation/statistics.hpp"
#include "modules/recordings/stamp_statistics.hpp"

namespace km {
namespace {

std::string percent(double share) {
  return fixed(100.0 * share, share < 0.1 ? 1 : 0) + " %";
}

std::string milliseconds(double seconds) {
  return fixed(1e3 * seconds, 1) + " ms";
}

// "missing images" -> "recording.missing_images"
std::string id_of(ReaderFault fault) {
  std::string id = std::string("recording.") + to_string(fault);
  std::ranges::replace(id, ' ', '_');
  return id;
}

Finding fault_finding(ReaderFault fault, const ReaderReport::Entry& entry, double of) {
  constexpr double kFew = 0.01, kHalf = 0.5;
  const double share = static_cast<double>(entry.count) / std::max(of, 1.0);
  return {.id = id_of(fault),
          .severity = share > kHalf  ? Severity::kError
                      : share > kFew ? Severity::kWarning
                                     : Severity::kNote,
          .what = std::to_string(entry.count) + ' ' + to_string(fault) + ", " + percent(share) +
                  ", first: " + entry.first,
          .means = "what is concerned is skipped",
          .to_do = "repair or record it anew, where there are many"};
}

// How many of what a fault counts there are without it. Images missing between others are counted
// camera by camera, lost messages topic by topic.
double sound_ones(ReaderFault fault, const SensorSample& sample) {
  const auto frames = static_cast<double>(sample.frames.size());
  const auto samples = static_cast<double>(sample.imu.size());
  const double images = sample.right_size.width > 0 ? 2.0 * frames : frames;
  switch (fault) {
    case ReaderFault::kNotFinite:
    case ReaderFault::kImplausible:
    case ReaderFault::kNoAcceleration:
    case ReaderFault::kImuGap:
      return samples;
    case ReaderFault::kMissingBetween:
      return images;
    case ReaderFault::kLostMessage:
      return images + samples;
    default:
      return frames;
  }
}

void examine_rate(const char* sensor, const std::string& id, const std::vector<Stamp>& stamps,
                  double least_hz, double longest_gap_s, Examination& result) {
  const StampStatistics found = stamp_statistics(stamps);
  result.figures.push_back(
      {std::string(sensor) + ", rate", fixed(found.rate_hz, 1) + " Hz, largest gap " +
                                           fixed(found.largest_gap_s, 3) + " s, jitter " +
                                           milliseconds(found.jitter_s)});
  if (found.rate_hz < least_hz)
    result.findings.push_back({.id = id + ".rate",
                               .severity = Severity::kWarning,
                               .what = std::string(sensor) + " at " + fixed(found.rate_hz, 1) +
                                       " Hz, less than " + fixed(least_hz, 0) + " Hz",
                               .means = "odometry may lose track between them in quick motion",
                               .to_do = "record at a higher rate"});
  if (found.largest_gap_s > longest_gap_s)
    result.findings.push_back(
        {.id = id + ".gap",
         .severity = Severity::kWarning,
         .what = std::string(sensor) + " with a gap of " + fixed(found.largest_gap_s, 2) + " s",
         .means = "odometry may lose track there and start anew",
         .to_do = "see why the driver or the disk stopped; --from and --to "
                  "choose a part without it"});
}

Finding image_finding(const char* id, std::string what, const char* means, const char* to_do) {
  return {.id = id,
          .severity = Severity::kWarning,
          .what = std::move(what),
          .means = means,
          .to_do = to_do};
}

std::vector<double> values_of(const std::vector<ImageLook>& looks, const auto& value) {
  std::vector<double> values;
  values.reserve(looks.size());
  for (const ImageLook& look : looks) values.push_back(static_cast<double>(value(look)));
  return values;
}

// Words for a fault of the pair.
struct FaultWords {
  const char* id;
  const char* what;
  const char* to_do;
};

FaultWords words_of(StereoFault fault) {
  switch (fault) {
    case StereoFault::kSwappedImages:
      return {"stereo.swapped", "the left images are the right camera's",
              "exchange the topics or folders of the two cameras' images"};
    case StereoFault::kInvertedPair:
      return {"stereo.inverted", "the pose of the right camera to the left one is inverted",
              "write T_left_right^-1: a pose of b in a maps b to a"};
    case StereoFault::kInvertedCameras:
      return {"stereo.inverted_cameras", "both T_body_cam (T_BS) are inverted",
              "write their inverses: T_BS maps the camera's points to the body's"};
    case StereoFault::kInvertedLeft:
      return {"stereo.inverted_left", "T_body_cam (T_BS) of the left camera is inverted",
              "write its inverse"};
    case StereoFault::kInvertedRight:
      return {"stereo.inverted_right", "T_body_cam (T_BS) of the right camera is inverted",
              "write its inverse"};
    case StereoFault::kExchangedLenses:
      return {"stereo.exchanged_lenses",
              "focal lengths, centre and distortion of the two cameras are exchanged",
              "exchange them"};
    case StereoFault::kFocalLength:
      return {"stereo.focal", "the focal lengths of the two cameras do not go together",
              "calibrate them anew, at the resolution of the images"};
    case StereoFault::kNone:
      break;
  }
  return {"stereo.epipolar", "points lie far from their epipolar lines",
          "calibrate the pair anew, at the resolution of the images, with its lens model"};
}

std::string fit_text(const StereoFit& fit) {
  return percent(fit.on_line) + " of " + std::to_string(fit.points) + " points within " +
         fixed(kOnLine_px, 0) + " px of their epipolar line, median " + fixed(fit.error_px, 2) +
         " px";
}

constexpr double kSoundShare = 0.5;  // on_line: sound pairs have 0.65 to 0.97
constexpr std::size_t kMinPoints = 100;

bool is_sound(const StereoFit& fit) {
  return fit.points >= kMinPoints && fit.on_line >= kSoundShare;
}

void examine_pair(const StereoAlternative& found, const StereoFit& given, Examination& result) {
  const bool is_named = found.fault != StereoFault::kNone;
  if (!is_named && is_sound(given)) return;
  const FaultWords words = words_of(found.fault);
  std::string what = std::string(words.what) + ": " + fit_text(given);
  if (is_named) what += "; with that undone " + percent(found.fit.on_line);
  if (found.fault == StereoFault::kFocalLength)
    what += " with the right one times " + fixed(found.focal_ratio, 3);
  result.findings.push_back({.id = words.id,
                             .severity = Severity::kError,
                             .what = std::move(what),
                             .means = "depth is wrong or missing: neither odometry nor closures "
                                      "work",
                             .to_do = words.to_do});
}

void examine_baseline(const StereoRig& rig, const StereoFit& fit, Examination& result) {
  constexpr double kLeast_m = 0.02, kMost_m = 1.5;
  const double baseline_m = rig.baseline_m();
  const std::string depth = std::isfinite(fit.depth_m)
                                ? "points at a median of " + fixed(fit.depth_m, 1) + " m by it"
                                : "no depth by it";
  result.figures.push_back(
      {"baseline", fixed(baseline_m, 3) + " m, " + depth + " (images do not tell its length)"});
  if (baseline_m < kLeast_m || baseline_m > kMost_m)
    result.findings.push_back({.id = "stereo.baseline",
                               .severity = Severity::kWarning,
                               .what = "a baseline of " + rounded(baseline_m, 4) +
                                       " m, where robots have " + fixed(kLeast_m, 2) + " to " +
                                       fixed(kMost_m, 1) + " m; " + depth,
                               .means = "all lengths are wrong by the same factor if its unit is",
                               .to_do = "metres, not millimetres or inches"});
}

double angle_between(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
  return so3_log(a.transpose() * b).norm();
}

// What the fit to the gyroscope needs to say anything, and where it says more.
constexpr double kToldRate_radps = 0.02;
constexpr double kRelated = 0.6, kUnrelated = 0.3;  // share explained
constexpr double kSecondAxis_radps = 0.02;          // about a second axis, for directions

void examine_relation(const InertialFit& fit, Examination& result) {
  if (fit.explained > kRelated) return;
  result.findings.push_back(
      {.id = "imu.unrelated",
       .severity = fit.explained < kUnrelated ? Severity::kError : Severity::kWarning,
       .what = "the gyroscope explains " + percent(std::max(fit.explained, 0.0)) +
               " of the rotation that images show (" + fixed(kDegrees * fit.image_rms, 1) +
               " degrees/s), at any offset within " + milliseconds(kMaxOffset_s),
       .means = "it is not this camera's sensor, or stamps differ by more, or samples are broken",
       .to_do = "see that both have one clock and are of one robot"});
}

void examine_scale(const InertialFit& fit, Examination& result) {
  constexpr double kPerDegree = 1.0 / kDegrees, kSlack = 0.1;
  const double off = std::abs(fit.scale - 1.0);
  if (off < kSlack) return;
  const bool in_degrees = std::abs(fit.scale / kPerDegree - 1.0) < kSlack;
  result.findings.push_back(
      {.id = in_degrees ? "imu.gyro_in_degrees" : "imu.gyro_scale",
       .severity = Severity::kError,
       .what = "images turn " + rounded(fit.scale, 4) + " times as fast as the gyroscope says" +
               (in_degrees ? ", and 1 degree is 0.01745 rad" : ""),
       .means = in_degrees ? "the gyroscope is in degrees/s: odometry takes it for rad/s"
                           : "the gyroscope or the focal length is off by this factor",
       .to_do = in_degrees ? "divide by 57.2958 where the samples are written"
                           : "check the range that the gyroscope is set to"});
}

void examine_direction(const InertialFit& fit, const Camera& left, Examination& result) {
  const Eigen::Matrix3d R_cam_body = left.T_body_cam.linear().transpose();
  constexpr double kClose = 5.0 / kDegrees, kFar = 20.0 / kDegrees, kOff = 2.0 / kDegrees;
  if (fit.Q.determinant() < 0.0) {
    result.findings.push_back(
        {.id = "imu.mirrored",
         .severity = Severity::kError,
         .what = "the gyroscope's axes are left-handed: with one of them the other way round, " +
                 percent(fit.mirror_gain) + " more of the rotation of images are explained",
         .means = "no mounting of the camera makes that good",
         .to_do = "change the sign of the axis that is mirrored; see the sensor's data sheet"});
    return;
  }
  const double angle = angle_between(R_cam_body, fit.Q);
  result.figures.push_back({"camera to inertial sensor", "turned by " + fixed(kDegrees * angle, 1) +
                                                             " degrees against T_body_cam"});
  if (angle < kOff) return;
  const bool is_inverse = angle > kFar && angle_between(R_cam_body.transpose(), fit.Q) < kClose;
  result.findings.push_back(
      {.id = is_inverse ? "extrinsics.inverted" : "extrinsics.rotation",
       .severity = angle > kFar ? Severity::kError : Severity::kWarning,
       .what = is_inverse ? "the rotation of T_body_cam (T_BS) is inverted: as it is, it is " +
                                fixed(kDegrees * angle, 0) + " degrees off, its inverse " +
                                fixed(kDegrees * angle_between(R_cam_body.transpose(), fit.Q), 1)
                          : "the left camera is turned by " + fixed(kDegrees * angle, 1) +
                                " degrees against what T_body_cam says",
       .means = "odometry turns the wrong way, or drifts",
       .to_do = is_inverse ? "write its inverse: T_BS maps the camera's points to the body's"
                           : "calibrate cameras and inertial sensor together (Kalibr); "
                             "vio.calibrate makes a few degrees good"});
}

void examine_offset(const InertialFit& fit, Examination& result) {
  constexpr double kSmall_s = 3e-3, kLarge_s = 5e-3, kSure = 4.0;
  if (fit.offset_at_limit) {
    result.figures.push_back(
        {"time offset", "not told: none within " + milliseconds(kMaxOffset_s) + " fits best"});
    return;
  }
  result.figures.push_back({"time offset", milliseconds(fit.offset_s) + " +- " +
                                               milliseconds(fit.offset_sigma_s) +
                                               ", to be added to stamps of images"});
  if (std::abs(fit.offset_s) < std::max(kSmall_s, kSure * fit.offset_sigma_s)) return;
  result.findings.push_back(
      {.id = "imu.time_offset",
       .severity = std::abs(fit.offset_s) < kLarge_s ? Severity::kNote : Severity::kWarning,
       .what = "stamps of the inertial sensor are " + milliseconds(std::abs(fit.offset_s)) +
               " (+- " + milliseconds(fit.offset_sigma_s) +
               (fit.offset_s > 0.0 ? ") later" : ") earlier") + " than those of the images",
       .means = "odometry is worse by the motion in that time until vio.calibrate has found it",
       .to_do = "camera_time_offset_s: " + rounded(fit.offset_s, 3) +
                " in the rig file, or stamp both at one instant"});
}

void examine_focal(const SensorSample& sample, const StereoRig& rig, const SeenRotations& seen,
                   const InertialFit& inertial, Examination& result) {
  constexpr double kSlack = 0.015, kSure = 2.0, kToldSigma = 0.01;
  constexpr const char* kName = "focal length by the gyroscope";
  const bool has_depth = 2 * seen.with_depth > seen.steps.size();
  const auto fit = has_depth ? fit_focal(sample.steps, rig, sample.imu, inertial) : std::nullopt;
  if (!fit || !(fit->sigma < kToldSigma)) {
    result.figures.push_back({kName, std::string("not told: ") +
                                         (has_depth ? "too little rotation across the optical axis"
                                                    : "no stereo depth that fits")});
    return;
  }
  const std::string factor = fixed(fit->factor, 3) + " +- " + fixed(fit->sigma, 3);
  result.figures.push_back({kName, "times " + factor + " of the calibration's"});
  if (std::abs(fit->factor - 1.0) < std::max(kSlack, kSure * fit->sigma)) return;
  result.findings.push_back(
      {.id = "camera.focal",
       .severity = Severity::kWarning,
       .what = "images move as the gyroscope turns if the focal lengths are " + factor +
               " times the calibration's",
       .means = "distances and turns are off by as much",
       .to_do = "calibrate the cameras anew, at the resolution of the images; or the gyroscope's "
                "scale is off"});
}

void examine_gravity(const SensorSample& sample, Examination& result) {
  std::vector<double> norms;
  norms.reserve(sample.imu.size());
  for (const ImuSample& measured : sample.imu) norms.push_back(measured.accel.norm());
  constexpr double kGravity = 9.81;
  const double found = quantile(std::move(norms), 0.5);
  result.figures.push_back({"accelerometer", "median norm " + fixed(found, 2) + " m/s^2"});
  const auto is_about = [found](double value) { return std::abs(found / value - 1.0) < 0.15; };
  if (is_about(kGravity) || std::isnan(found)) return;
  Finding finding{.id = "imu.gravity", .severity = Severity::kError};
  finding.what = "the accelerometer measures " + rounded(found, 3) + " in the median, gravity is " +
                 fixed(kGravity, 2) + " m/s^2";
  finding.means = "odometry finds no gravity, or a wrong one";
  finding.to_do = "samples are specific force in m/s^2, gravity included";
  if (is_about(1.0) || is_about(1e3)) {
    finding.id = "imu.accel_in_g";
    finding.means = is_about(1.0) ? "it is in g" : "it is in thousandths of g";
    finding.to_do = "multiply by " + std::string(is_about(1.0) ? "9.80665" : "0.00980665");
  } else if (found < 0.3 * kGravity) {
    finding.id = "imu.no_gravity";
    finding.means = "gravity was taken off, or it is in another unit";
    finding.to_do = "the driver has an option for raw acceleration";
  }
  result.findings.push_back(std::move(finding));
}

}  // namespace

Examination examine_streams(const SensorSample& sample, const ReaderReport& report) {
  Examination result;
  if (sample.frames.empty())
    result.findings.push_back({.id = "recording.no_frames",
                               .severity = Severity::kError,
                               .what = "0 frames could be read",
                               .means = "there is nothing to estimate a motion from",
                               .to_do = "see the findings below for what was skipped"});
  for (const auto& [fault, entry] : report.entries())
    result.findings.push_back(
        fault_finding(fault, entry, sound_ones(fault, sample) + static_cast<double>(entry.count)));
  constexpr double kFrames_hz = 8.0, kFrameGap_s = 0.25, kSamples_hz = 80.0, kSampleGap_s = 0.05;
  if (sample.frames.size() > 1)
    examine_rate("images", "frames", sample.frames, kFrames_hz, kFrameGap_s, result);
  std::vector<Stamp> stamps;
  stamps.reserve(sample.imu.size());
  for (const ImuSample& measured : sample.imu) stamps.push_back(measured.stamp);
  if (stamps.size() > 1)
    examine_rate("inertial samples", "imu", stamps, kSamples_hz, kSampleGap_s, result);
  return result;
}

Examination examine_images(const SensorSample& sample) {
  Examination result;
  if (sample.looks.empty()) return result;
  const auto median = [&](const auto& value) {
    return quantile(values_of(sample.looks, value), 0.5);
  };
  const double level = median([](const ImageLook& look) { return look.mean_level; });
  const double saturated = median([](const ImageLook& look) { return look.saturated_share; });
  const double sharpness = median([](const ImageLook& look) { return look.sharpness; });
  const double corners =
      quantile(values_of(sample.looks, [](const ImageLook& look) { return look.corners; }), 0.2);
  result.figures.push_back({"exposure", "mean level " + fixed(level, 0) + " of 255, " +
                                            percent(saturated) + " saturated"});
  result.figures.push_back({"sharpness", fixed(sharpness, 2) + " (0.5 blurred, 1 sharp)"});
  result.figures.push_back({"corners", fixed(corners, 0) + " in four images of five, or more"});
  constexpr double kDark = 25.0, kBright = 225.0, kSaturated = 0.35, kBlurred = 0.58;
  constexpr double kFewCorners = 100.0;
  if (level < kDark)
    result.findings.push_back(image_finding(
        "images.dark", "a mean grey level of " + fixed(level, 0) + " of 255",
        "few features, and noise among them", "a longer exposure, more gain, or light"));
  if (level > kBright || saturated > kSaturated)
    result.findings.push_back(image_finding(
        "images.bright",
        percent(saturated) + " of the pixels are saturated, mean level " + fixed(level, 0),
        "what is saturated has no features", "a shorter exposure, or automatic exposure"));
  if (sharpness < kBlurred)
    result.findings.push_back(image_finding(
        "images.blurred", "edges are blurred: sharpness " + fixed(sharpness, 2) + ", below 0.58",
        "features are found less exactly, and fewer again",
        "focus, a clean lens, or a shorter "
        "exposure in motion"));
  if (corners < kFewCorners)
    result.findings.push_back(
        image_finding("images.few_corners",
                      "less than " + fixed(corners + 1.0, 0) + " corners in one image of five",
                      "odometry may lose track where there is nothing to see",
                      "more texture or light, or tracker.fast_threshold"));
  return result;
}

Examination examine_stereo(const SensorSample& sample, const StereoRig& rig) {
  Examination result;
  if (rig.depth_source != DepthSource::kRightImage) return result;
  const StereoFit given = fit_of(sample.stereo, rig);
  if (given.points < kMinPoints) {
    result.figures.push_back(
        {"stereo", "not told: " + std::to_string(given.points) + " points in both images"});
    return result;
  }
  result.figures.push_back({"stereo", fit_text(given)});
  examine_pair(best_alternative(sample.stereo, rig), given, result);
  examine_baseline(rig, given, result);
  return result;
}

Examination examine_inertial(const SensorSample& sample, const StereoRig& rig) {
  Examination result;
  if (sample.imu.empty()) return result;
  examine_gravity(sample, result);
  const bool use_depth =
      rig.depth_source == DepthSource::kRightImage && is_sound(fit_of(sample.stereo, rig));
  const SeenRotations seen = seen_rotations(sample.steps, rig, use_depth);
  const auto fit = fit_inertial(seen.steps, sample.imu);
  if (!fit || fit->image_rms < kToldRate_radps) {
    result.figures.push_back({"images against the gyroscope",
                              fit ? "not told: the camera turns by " +
                                        fixed(kDegrees * fit->image_rms, 2) + " degrees/s only"
                                  : "not told: " + std::to_string(seen.steps.size()) +
                                        " pairs of images close in time"});
    return result;
  }
  result.figures.push_back({"images against the gyroscope",
                            percent(fit->explained) + " explained, " + std::to_string(fit->steps) +
                                " steps at " + fixed(kDegrees * fit->image_rms, 1) + " degrees/s"});
  examine_relation(*fit, result);
  if (fit->explained < kRelated) return result;
  examine_scale(*fit, result);
  examine_offset(*fit, result);
  if (fit->gyro_rms[1] * fit->scale > kSecondAxis_radps)
    examine_direction(*fit, rig.cameras[0], result);
  else
    result.figures.push_back(
        {"camera to inertial sensor", "not told: the camera turns about one axis only"});
  if (std::abs(fit->scale - 1.0) < 0.1) examine_focal(sample, rig, seen, *fit, result);
  return result;
}

}  // namespace km
