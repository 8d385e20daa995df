#include "modules/diagnosis/examine_sensors.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "modules/core/geometry/lie.hpp"
#include "modules/core/io/text_table.hpp"
#include "modules/core/quantile.hpp"
#include "modules/diagnosis/acceleration_fit.hpp"
#include "modules/diagnosis/doubt_finding.hpp"
#include "modules/diagnosis/focal_fit.hpp"
#include "modules/diagnosis/image_rotation.hpp"
#include "modules/diagnosis/inertial_fit.hpp"
#include "modules/diagnosis/stereo_fit.hpp"
#include "modules/recordings/bag_summary.hpp"
#include "modules/sensors/sample_streams.hpp"
#include "modules/sensors/stream_stamps.hpp"
#include "modules/sensors/usual_numbers.hpp"

namespace km {
namespace {

using enum Severity;

// Number of items of the kind that a fault counts, with the `faulty` ones. Images are counted per
// camera, lost messages per topic.
double item_count(ReaderFault fault, double faulty, const SensorSample& sample) {
  const auto frames = static_cast<double>(sample.frames.size());
  const auto samples = static_cast<double>(sample.imu.size());
  const double images = sample.right_size.width > 0 ? 2.0 * frames : frames;
  using enum ReaderFault;
  // A frame without its depth or label image remains.
  if (fault == kWrongImageFormat || fault == kUnknownColor) return std::max(frames, faulty);
  if (fault >= kNotFinite && fault <= kNoAcceleration) return samples + faulty;
  if (fault == kMissingBetween) return images + faulty;
  return (fault == kLostMessage ? images + samples : frames) + faulty;
}

void examine_rate(const char* sensor, const std::string& id, const std::vector<Stamp>& stamps,
                  Stamp start, double least_hz, double longest_gap_s, Examination& result) {
  StampStatistics found = stamp_statistics(stamps);
  const bool is_jump = found.largest_gap_s > kLongestPause_s;
  if (is_jump) found.rate_hz = 1.0 / found.median_s;
  result.figure(std::string(sensor) + ", rate", fixed(found.rate_hz, 1) + " Hz, largest gap " +
                                                    fixed(found.largest_gap_s, 3) + " s, jitter " +
                                                    milliseconds(found.jitter_s));
  const std::string place =
      ", " + fixed(seconds_between(start, found.gap_from), 1) + " s after the first image";
  if (is_jump)
    result.add(kWarning, id + ".clock",
               std::string(sensor) + " whose stamps jump by " + fixed(found.largest_gap_s, 1) +
                   " s" + place + ": the clock was set",
               "odometry starts again there, and charts show a gap",
               "set the clock before the recording, or choose a part by --from and --to");
  const UsualNumber rate = id == "imu" ? UsualNumber::kImuRate_hz : UsualNumber::kImageRate_hz;
  if (const auto unusual = rate_doubt(rate, found.rate_hz, found.median_s);
      unusual && found.rate_hz > least_hz)
    return result.findings.push_back(finding_of(*unusual));
  if (!(found.rate_hz >= least_hz))
    result.add(kWarning, id + ".rate",
               std::string(sensor) + " at " + fixed(found.rate_hz, 1) + " Hz, less than " +
                   fixed(least_hz, 0) + " Hz",
               "odometry may lose track in fast motion", "record at a higher rate");
  if (!is_jump &&
      found.largest_gap_s > std::max(longest_gap_s, ImuStream::kGapPeriods * found.median_s))
    result.add(
        kWarning, id + ".gap",
        std::string(sensor) + " with a gap of " + fixed(found.largest_gap_s, 2) + " s" + place,
        "odometry may lose track in the gap and start again",
        "find out why the driver or the disk stopped; --from and --to choose a part "
        "without the gap");
}

std::vector<double> values_of(const std::vector<ImageQuality>& qualities, const auto& value) {
  std::vector<double> values;
  values.reserve(qualities.size());
  for (const ImageQuality& image : qualities) values.push_back(static_cast<double>(value(image)));
  return values;
}

// Texts of the finding for a StereoFault.
struct FaultWords {
  const char* id;
  const char* what;
  const char* to_do;
};

const std::map<StereoFault, FaultWords> kFaultWords = {
    {StereoFault::kNone,
     {"stereo.epipolar", "points are far from their epipolar lines",
      "calibrate the pair again at the resolution of the images, with its lens model"}},
    {StereoFault::kSwappedImages,
     {"stereo.swapped", "the images of the left and the right camera are exchanged",
      "exchange the topics or folders of the two cameras"}},
    {StereoFault::kInvertedPair,
     {"stereo.inverted", "the pose of the right camera relative to the left one is inverted",
      "replace T_left_right by its inverse: it maps points from the right camera to the left one"}},
    {StereoFault::kInvertedCameras,
     {"stereo.inverted_cameras", "both T_body_cam (T_BS) are inverted",
      "replace them by their inverses: T_BS maps points from the camera to the body"}},
    {StereoFault::kInvertedLeft,
     {"stereo.inverted_left", "T_body_cam (T_BS) of the left camera is inverted",
      "replace it by its inverse"}},
    {StereoFault::kInvertedRight,
     {"stereo.inverted_right", "T_body_cam (T_BS) of the right camera is inverted",
      "replace it by its inverse"}},
    {StereoFault::kExchangedLenses,
     {"stereo.exchanged_lenses",
      "focal lengths, centre and distortion of the two cameras are exchanged", "exchange them"}},
    {StereoFault::kFocalLength,
     {"stereo.focal", "the focal lengths of the two cameras do not fit each other",
      "calibrate them again at the resolution of the images"}},
    {StereoFault::kOtherMode,
     {"stereo.other_mode", "the calibration is that of images of another size",
      "multiply focal lengths and centres of both cameras by this factor, or use the calibration "
      "of this mode of the driver"}},
};

std::string fit_text(const StereoFit& fit) {
  return percent(fit.inlier_ratio) + " of " + std::to_string(fit.points) + " points within " +
         fixed(kEpipolarInlier_px, 0) + " px of their epipolar line, median " +
         fixed(fit.error_px, 2) + " px";
}

void examine_pair(const StereoAlternative& found, const StereoFit& given, Examination& result) {
  const bool is_named = found.fault != StereoFault::kNone;
  if (!is_named && is_sound(given)) return;
  const FaultWords& words = kFaultWords.at(found.fault);
  std::string what = std::string(words.what) + ": " + fit_text(given);
  if (is_named) what += "; with this fault undone " + percent(found.fit.inlier_ratio);
  if (found.fault == StereoFault::kFocalLength)
    what += ", with the right focal length times " + fixed(found.focal_ratio, 3);
  if (found.fault == StereoFault::kOtherMode)
    what += ", with focal lengths and centres times " + fixed(found.focal_ratio, 1);
  result.add(kError, words.id, std::move(what),
             "depth is wrong or missing, so odometry and loop closures fail", words.to_do);
}

void examine_baseline(const StereoRig& rig, const StereoFit& fit, Examination& result) {
  const std::string depth =
      std::isfinite(fit.depth_m) ? "median depth " + fixed(fit.depth_m, 1) + " m" : "no depth";
  result.figure("baseline", fixed(rig.baseline_m(), 3) + " m, " + depth);
}

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

std::optional<Doubt> examine_gravity(const SensorSample& sample, Examination& result) {
  result.figure("accelerometer",
                "median norm " + fixed(median_acceleration(sample.imu), 2) + " m/s^2");
  auto unusual = gravity_doubt(sample.imu);
  if (unusual) result.findings.push_back(finding_of(*unusual));
  return unusual;
}

// Compares accelerations by images and depth with those of the accelerometer. Vibration and errors
// of tracking make the scale smaller, so only a larger one and another sign are faults.
void examine_acceleration(const SensorSample& sample, const StereoRig& rig,
                          const VisualRotations& seen, const InertialFit& inertial,
                          Examination& result) {
  constexpr double kMost = 1.6, kNegated = -0.5, kSure = 5.0;
  constexpr const char* kName = "accelerations by images and depth";
  const auto fit = fit_acceleration(seen.steps, sample.imu, rig.cameras[0].T_body_cam,
                                    inertial.offset_at_limit ? 0.0 : inertial.offset_s);
  if (!fit || !(kSure * fit->sigma < std::abs(fit->scale))) {
    result.figure(kName, "not determined: too little acceleration, or no depth");
    return;
  }
  const std::string factor = rounded(fit->scale, 3) + " +- " + rounded(fit->sigma, 2);
  result.figure(kName, "times " + factor + " of the accelerometer's");
  if (fit->scale < kNegated)
    result.add(kError, "imu.accel_negated",
               "accelerations by images and depth are " + factor +
                   " times those of the accelerometer: its sign is inverted",
               "odometry takes up for down, and drifts or restarts",
               "multiply accelerations by -1: specific force points up at rest (gravity vectors "
               "and NED or FRD axes point down)");
  if (fit->scale > kMost)
    result.add(
        kError, "depth.scale",
        "accelerations by images and depth are " + factor + " times those of the accelerometer",
        "lengths are wrong by about this factor: the baseline or the scale of depth",
        "check the unit of the baseline (P[3] of CameraInfo) or of depth (depth: {scale_m})");
}

}  // namespace

Finding finding_of(ReaderFault fault, const ReaderReport::Entry& entry, double of) {
  using enum ReaderFault;
  constexpr double kFew = 0.01, kHalf = 0.5, kNearlyAll = 0.95;
  const double share = static_cast<double>(entry.count) / std::max(of, 1.0);
  std::string id = std::string("recording.") + to_string(fault);  // "recording.missing_images"
  std::ranges::replace(id, ' ', '_');
  Finding finding{.id = std::move(id),
                  .severity = share > kHalf  ? kError
                              : share > kFew ? kWarning
                                             : kNote,
                  .what = std::to_string(entry.count) + ' ' + to_string(fault) + ", " +
                          percent(share) + ", first: " + entry.first,
                  .means = "the affected parts are skipped",
                  .to_do = "repair the recording, or record again if there are many"};
  // imu.rate judges the other samples.
  if ((fault == kUnorderedSample || fault == kRepeatedSample) && share < kNearlyAll) {
    finding.severity = std::min(finding.severity, kWarning);
    finding.means = fault == kUnorderedSample
                        ? "samples behind a later one are skipped: odometry uses the others"
                        : "odometry uses the first sample of each stamp";
    finding.to_do =
        "set the driver to write each sample in order, with the time of its measurement";
  }
  if (fault == kClockSetBack) {
    finding.severity = kWarning;
    finding.means = "poses from there on have stamps that true poses, fixes and programs lack";
    finding.to_do = "set the clock before the recording";
  }
  return finding;
}

Examination examine_streams(const SensorSample& sample, const ReaderReport& report) {
  Examination result;
  if (sample.frames.empty())
    result.add(kError, "recording.no_frames", "no frame could be read",
               "there are no images to estimate motion from",
               "the other findings state the skipped parts");
  for (const auto& [fault, entry] : report.entries())
    result.findings.push_back(
        finding_of(fault, entry, item_count(fault, static_cast<double>(entry.count), sample)));
  const Stamp start = sample.frames.empty() ? 0 : sample.frames.front();
  constexpr double kFrames_hz = 8.0, kFrameGap_s = 0.25, kSamples_hz = 80.0, kSampleGap_s = 0.05;
  if (sample.frames.size() > 1)
    examine_rate("images", "frames", sample.frames, start, kFrames_hz, kFrameGap_s, result);
  std::vector<Stamp> stamps;
  stamps.reserve(sample.imu.size());
  for (const ImuSample& measured : sample.imu) stamps.push_back(measured.stamp);
  if (stamps.size() > 1)
    examine_rate("inertial samples", "imu", stamps, start, kSamples_hz, kSampleGap_s, result);
  return result;
}

Examination examine_images(const SensorSample& sample) {
  Examination result;
  if (sample.qualities.empty()) return result;
  const auto median = [&](const auto& value) {
    return quantile(values_of(sample.qualities, value), 0.5);
  };
  const double level = median([](const ImageQuality& image) { return image.mean_level; });
  const double saturated = median([](const ImageQuality& image) { return image.saturated_share; });
  const double sharpness = median([](const ImageQuality& image) { return image.sharpness; });
  const double corners = quantile(
      values_of(sample.qualities, [](const ImageQuality& image) { return image.corners; }), 0.2);
  result.figure("exposure",
                "mean level " + fixed(level, 0) + " of 255, " + percent(saturated) + " saturated");
  result.figure("sharpness", fixed(sharpness, 2) + " (0.5 blurred, 1 sharp)");
  result.figure("corners", fixed(corners, 0) + " in four images of five, or more");
  constexpr double kDark = 25.0, kBright = 225.0, kSaturated = 0.35, kBlurred = 0.58;
  constexpr double kFewCorners = 100.0;
  if (level < kDark)
    result.add(
        kWarning, "images.dark", "a mean grey level of " + fixed(level, 0) + " of 255",
        "few features are found, and some of them are noise",
        "use a longer exposure, more gain or more light; 10 or 14 bits must fill the 16 bits of "
        "mono16");
  if (level > kBright || saturated > kSaturated)
    result.add(kWarning, "images.bright",
               percent(saturated) + " of the pixels are saturated, mean level " + fixed(level, 0),
               "saturated areas have no features", "use a shorter or automatic exposure");
  if (sharpness < kBlurred)
    result.add(kWarning, "images.blurred",
               "edges are blurred: sharpness " + fixed(sharpness, 2) + ", below 0.58",
               "features are less accurate, and fewer are tracked",
               "focus and clean the lens, or use a shorter exposure");
  if (corners < kFewCorners)
    result.add(kWarning, "images.few_corners",
               "less than " + fixed(corners + 1.0, 0) + " corners in one image of five",
               "odometry may lose track in areas without texture",
               "add texture or light, or lower tracker.fast_threshold");
  return result;
}

Examination examine_words(std::span<const std::vector<BinaryDescriptor>> images,
                          const Vocabulary& vocabulary) {
  std::map<std::uint32_t, double> counts;
  double features = 0.0;
  for (const std::vector<BinaryDescriptor>& image : images)
    for (const std::uint32_t word : vocabulary.words(image)) {
      ++counts[word];
      ++features;
    }
  constexpr double kEnough = 1000.0;
  if (features < kEnough)
    return {.figures = {{"vocabulary", "not determined: " + fixed(features, 0) + " features"}},
            .findings = {}};
  double entropy = 0.0;
  for (const auto& [word, count] : counts) entropy -= count / features * std::log(count / features);
  const double words = std::exp(entropy);
  const double most = std::min(features, static_cast<double>(vocabulary.size()));
  Examination result;
  result.figure("vocabulary", fixed(words, 0) + " words distinguish " + fixed(features, 0) +
                                  " features, of " + std::to_string(vocabulary.size()));
  constexpr double kLeastWords = 200.0, kLeastShare = 0.05;
  if (words < kLeastWords || words < kLeastShare * most)
    result.add(kWarning, "vocabulary.coverage",
               "the vocabulary distinguishes " + fixed(features, 0) + " features by only " +
                   fixed(words, 0) + " words",
               "different places look alike, so candidates are few or wrong",
               "train a vocabulary on images like these: kimera_multi_vocabulary "
               "train");
  return result;
}

Examination examine_stereo(const SensorSample& sample, const StereoRig& rig) {
  Examination result;
  for (const Doubt& unusual : rig_doubts(rig)) result.findings.push_back(finding_of(unusual));
  if (rig.depth_source != DepthSource::kRightImage) return result;
  const StereoFit given = fit_of(sample.stereo, rig);
  if (given.points < kLeastStereoPoints) {
    result.figure("stereo",
                  "not determined: " + std::to_string(given.points) + " points in both images");
    return result;
  }
  result.figure("stereo", fit_text(given));
  examine_pair(best_alternative(sample.stereo, rig), given, result);
  examine_baseline(rig, given, result);
  return result;
}

Examination examine_depth(const SensorSample& sample, const StereoRig& rig) {
  Examination result;
  const SE3 T_right_left = rig.T_left_right().inverse();
  std::vector<double> depths_m, ratios;
  for (const TrackedStep& step : sample.steps)
    for (const TrackedPoint& point : step.points) {
      if (!(point.depth_m > 0.0)) continue;
      depths_m.push_back(point.depth_m);
      if (!point.right || rig.depth_source != DepthSource::kRightImage) continue;
      const auto seen = stereo_point(rig, T_right_left, {point.from, *point.right});
      const bool is_good = seen && seen->error_px < kEpipolarInlier_px && seen->depth_m > 0.0;
      if (is_good) ratios.push_back(point.depth_m / seen->depth_m);
    }
  if (depths_m.size() < kLeastStereoPoints) return result;
  const double depth_m = quantile(std::move(depths_m), 0.5);
  result.figure("depth images", "median depth " + fixed(depth_m, 2) + " m at corners");
  if (ratios.size() < kLeastStereoPoints) return result;
  const double ratio = quantile(std::move(ratios), 0.5);
  constexpr double kMostOff = 1.25;
  result.figure("depth images against stereo", "times " + rounded(ratio, 3));
  if (ratio > kMostOff || ratio < 1.0 / kMostOff)
    result.add(kError, "depth.stereo",
               "depth images state " + rounded(ratio, 3) + " times the depth by the two cameras",
               "map and odometry have different scales",
               "divide depth: {scale_m} in the rig file by this factor, or correct the baseline");
  return result;
}

Examination examine_inertial(const SensorSample& sample, const StereoRig& rig) {
  Examination result;
  if (sample.imu.empty()) return result;
  const std::optional<Doubt> unusual = examine_gravity(sample, result);
  if (unusual && unusual->id == "imu.exchanged") return result;
  const bool has_right = rig.depth_source == DepthSource::kRightImage;
  const bool fits = !has_right || is_sound(fit_of(sample.stereo, rig));
  const StereoFault fault =
      fits ? StereoFault::kSwappedImages : best_alternative(sample.stereo, rig).fault;
  if (fault == StereoFault::kOtherMode || fault == StereoFault::kNone) {
    result.figure("images against the gyroscope",
                  "not determined: the calibration does not fit the images");
    return result;
  }
  const bool use_depth = fits && (!has_right || rig_doubts(rig).empty());
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
  if (!rig_doubts(rig).empty())
    result.figure("camera to inertial sensor", "not determined: wrong lengths change it");
  else if (fit->gyro_rms[1] * fit->scale > kSecondAxis_radps)
    examine_direction(*fit, rig.cameras[0], result);
  else
    result.figure("camera to inertial sensor",
                  "not determined: the camera turns about one axis only");
  if (std::abs(fit->scale - 1.0) > 0.1) return result;
  examine_focal(sample, rig, seen, *fit, result);
  if (!unusual && rig_doubts(rig).empty()) examine_acceleration(sample, rig, seen, *fit, result);
  return result;
}

}  // namespace km
