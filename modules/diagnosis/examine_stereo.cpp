#include "modules/diagnosis/examine_sensors.hpp"

#include <cmath>
#include <map>
#include <utility>

#include "modules/core/text_table.hpp"
#include "modules/diagnosis/finding.hpp"
#include "modules/diagnosis/stereo_fit.hpp"

namespace km {
namespace {

using enum Severity;

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
  result.add(kError, words.id, std::move(what),
             "depth is wrong or missing, so odometry and loop closures fail", words.to_do);
}

void examine_baseline(const StereoRig& rig, const StereoFit& fit, Examination& result) {
  constexpr double kLeast_m = 0.02, kMost_m = 1.5;
  const double baseline_m = rig.baseline_m();
  const std::string depth =
      std::isfinite(fit.depth_m) ? "median depth " + fixed(fit.depth_m, 1) + " m" : "no depth";
  result.figure("baseline",
                fixed(baseline_m, 3) + " m, " + depth + " (images do not determine the length)");
  if (!(baseline_m >= kLeast_m && baseline_m <= kMost_m))
    result.add(kWarning, "stereo.baseline",
               "a baseline of " + rounded(baseline_m, 4) + " m, outside of the usual " +
                   fixed(kLeast_m, 2) + " to " + fixed(kMost_m, 1) + " m; " + depth,
               "if its unit is wrong, all lengths are wrong by the same factor",
               "state the translation in metres, not in millimetres or inches");
}

}  // namespace

Examination examine_stereo(const SensorSample& sample, const StereoRig& rig) {
  Examination result;
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

}  // namespace km
