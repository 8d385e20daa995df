#pragma once

#include <filesystem>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

#include "modules/core/lie.hpp"
#include "modules/evaluation/association.hpp"
#include "modules/evaluation/trajectory_file.hpp"
#include "modules/loop_closure/keyframe_features.hpp"
#include "modules/sensors/node/euroc_rig.hpp"
#include "test/support/keyframe_pairs.hpp"

namespace km {

/// A recorded stereo pair with its features and the truth.
struct RecordedKeyframe {
  Stamp stamp = 0;
  SE3 T_world_body = SE3::Identity();
  KeyframeFeatures features;
};

inline RecordedKeyframe record_of(const StereoPairFile& files, const SensorRig& rig,
                                  KeyframeFeatureExtractor& extractor,
                                  const std::vector<StampedPose>& truth) {
  const auto pair = load_stereo_pair(files, rig.stereo);
  if (pair.status != ImageStatus::kOk) throw std::runtime_error(pair.problem);
  return {files.stamp, pose_at(truth, files.stamp, 0.1, 0.0).value(),
          extractor.extract(pair.image)};
}

/// Every n-th of the 100 stereo keyframes of EuRoC V1_01_easy; n is `every`.
inline std::vector<RecordedKeyframe> load_v1_01(const std::filesystem::path& sequence,
                                                const KeyframeFeaturesConfig& config,
                                                std::size_t every = 1,
                                                std::optional<KeypointDescriber> describer = {}) {
  const SensorRig rig = read_euroc_rig(sequence / "mav0");
  KeyframeFeatureExtractor extractor(rig.stereo, config, std::move(describer));
  const auto truth = read_trajectory(sequence / "mav0/state_groundtruth_estimate0");
  ReaderReport report;
  const auto files = list_keyframe_pairs(sequence / "keyframes", report);
  std::vector<RecordedKeyframe> keyframes;
  for (std::size_t i = 0; i < files.size(); i += every)
    keyframes.push_back(record_of(files[i], rig, extractor, truth));
  return keyframes;
}

/// Stereo pairs of the first 15 s of EuRoC MH_01_easy, where the vehicle moves, at 2 Hz.
inline std::vector<RecordedKeyframe> load_mh_01(const std::filesystem::path& sequence,
                                                const KeyframeFeaturesConfig& config,
                                                std::optional<KeypointDescriber> describer = {}) {
  const SensorRig rig = read_euroc_rig(sequence / "mav0");
  KeyframeFeatureExtractor extractor(rig.stereo, config, std::move(describer));
  const auto truth = read_trajectory(sequence / "mav0/state_groundtruth_estimate0");
  ReaderReport report;
  std::vector<RecordedKeyframe> keyframes;
  const auto pairs = list_euroc_pairs(sequence / "mav0", report).pairs;
  Stamp next = pairs.front().stamp;
  for (const StereoPairFile& files : pairs) {
    if (files.stamp < next || seconds_between(pairs.front().stamp, files.stamp) >= 15.0) continue;
    keyframes.push_back(record_of(files, rig, extractor, truth));
    next = files.stamp + nanoseconds(0.475);  // every tenth image of a 20 Hz camera
  }
  return keyframes;
}

}  // namespace km
