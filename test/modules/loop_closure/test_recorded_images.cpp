#include <Eigen/LU>

#include "modules/core/geometry/lie.hpp"
#include "modules/evaluation/association.hpp"
#include "modules/evaluation/trajectory_file.hpp"
#include "modules/loop_closure/keyframe_features.hpp"
#include "modules/loop_closure/verifier.hpp"
#include "modules/sensors/node/open_folder.hpp"
#include "test/support/keyframe_pairs.hpp"
#include "test/support/random_pose.hpp"
#include "test/support/recorded_kitchen.hpp"
#include "test/support/shared_data.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

// A recorded stereo pair with its features and the truth.
struct RecordedKeyframe {
  Stamp stamp = 0;
  SE3 T_world_body = SE3::Identity();
  KeyframeFeatures features;
};

// Every second of the 100 stereo keyframes of EuRoC V1_01_easy.
std::vector<RecordedKeyframe> load_v1_01(const fs::path& sequence) {
  const SensorRig rig = read_euroc_rig(sequence / "mav0");
  KeyframeFeatureExtractor extractor(rig.stereo, {});
  const auto truth = read_trajectory(sequence / "mav0/state_groundtruth_estimate0");
  ReaderReport report;
  const auto files = list_keyframe_pairs(sequence / "keyframes", report);
  std::vector<RecordedKeyframe> keyframes;
  for (std::size_t i = 0; i < files.size(); i += 2) {
    const auto pair = load_stereo_pair(files[i], rig.stereo);
    if (pair.fault) throw std::runtime_error(pair.problem);
    keyframes.push_back({files[i].stamp, pose_at(truth, files[i].stamp, 0.1, 0.0).value(),
                         extractor.extract(pair.image)});
  }
  return keyframes;
}

TEST_CASE("closures of V1_01 are many, accurate, and as uncertain as they state") {
  const auto sequence = shared_data("euroc/V1_01_easy");
  if (!sequence) return;
  const std::vector<RecordedKeyframe> keyframes = load_v1_01(*sequence);
  REQUIRE(keyframes.size() == 50);
  const Verifier verifier({});
  std::vector<double> metres, radians, squared;  // squared: Mahalanobis lengths
  for (std::size_t i = 0; i < 18; ++i)
    for (std::size_t j = 18; j < 50; ++j) {
      const RecordedKeyframe& from = keyframes[i];
      const RecordedKeyframe& to = keyframes[j];
      const Verification result = verifier.verify(from.features, to.features);
      if (result.status != VerificationStatus::kAccepted) continue;
      const SE3 T_true = from.T_world_body.inverse() * to.T_world_body;
      const Vector6 xi = se3_log(result.T_from_to.inverse() * T_true);
      metres.push_back((result.T_from_to.translation() - T_true.translation()).norm());
      radians.push_back(xi.head<3>().norm());
      squared.push_back(xi.dot(result.covariance.inverse() * xi));
    }
  REQUIRE(metres.size() >= 65);  // measured: 77
  for (auto* errors : {&metres, &radians, &squared}) std::sort(errors->begin(), errors->end());
  // Measured: 0.026 m and 0.48 degrees at the median, 0.063 m and 1.13 degrees at 90 %, 0.14 m and
  // 2.6 degrees at most.
  const std::size_t n = metres.size();
  CHECK(metres[n / 2] <= 0.04);
  CHECK(radians[n / 2] <= 0.75 * kDegree);
  CHECK(metres[n * 9 / 10] <= 0.1);
  CHECK(radians[n * 9 / 10] <= 1.75 * kDegree);
  CHECK(metres.back() <= 0.22);
  CHECK(radians.back() <= 4.0 * kDegree);
  // Half are shorter than the median of chi-squared with 6 degrees of freedom, and 95 % than its
  // quantile there, if covariances are right. They are off by less than a factor of 2, either way.
  CHECK(squared[n / 2] > 5.348 / 2.0);
  CHECK(squared[n / 2] < 5.348 * 2.0);
  CHECK(squared[n * 95 / 100] > 12.592 / 2.0);
  CHECK(squared[n * 95 / 100] < 12.592 * 2.0);
}

// Two robots in one room: frames before 500, and from 500 on; every sixth of the available frames.
// The images are not registered: colour has no intrinsics of its own (its lens is wider than that
// of depth), and its camera stands beside the depth camera. Most of the error comes from this.
TEST_CASE("closures of an RGB-D recording are in the right place") {
  const auto folder = shared_data("7scenes_redkitchen");
  if (!folder) return;
  RecordedKitchen kitchen(*folder, 24);
  KeyframeFeatureExtractor extractor(kitchen.rig(), {});
  std::vector<RecordedKeyframe> keyframes[2];
  while (const auto frame = kitchen.next())
    keyframes[frame->stamp / nanoseconds(500.0 / 30.0)].push_back(
        {frame->stamp, kitchen.T_world_cam(*frame), extractor.extract(*frame)});
  const Verifier verifier({});
  std::vector<double> metres, radians;
  for (const RecordedKeyframe& from : keyframes[0])
    for (const RecordedKeyframe& to : keyframes[1]) {
      const Verification result = verifier.verify(from.features, to.features);
      if (result.status != VerificationStatus::kAccepted) continue;
      const SE3 T_true = from.T_world_body.inverse() * to.T_world_body;
      metres.push_back((result.T_from_to.translation() - T_true.translation()).norm());
      radians.push_back(angle_of(T_true.linear().transpose() * result.T_from_to.linear()));
    }
  REQUIRE(metres.size() >= 100);  // there are 441 pairs in total
  std::sort(metres.begin(), metres.end());
  std::sort(radians.begin(), radians.end());
  const std::size_t n = metres.size();
  CHECK(metres[n / 2] <= 0.08);
  CHECK(radians[n / 2] <= 4.0 * kDegree);
  CHECK(metres[n * 8 / 10] <= 0.2);
  CHECK(radians[n * 8 / 10] <= 8.0 * kDegree);
}

}  // namespace
}  // namespace km
