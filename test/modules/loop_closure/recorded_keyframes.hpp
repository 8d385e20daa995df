#pragma once

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "modules/core/lie.hpp"
#include "modules/loop_closure/keyframe_features.hpp"
#include "modules/sensors/euroc_rig.hpp"
#include "modules/sensors/stereo_pairs.hpp"

namespace km {

/// Ground truth of the body over time.
struct TruthRow {
  Stamp stamp = 0;
  SE3 T_world_body = SE3::Identity();
};

/// Rows `t, p_x, p_y, p_z, quaternion` separated by commas or blanks; t in nanoseconds if it has no
/// point, else in seconds. EuRoC files have q_w first, TUM files last.
inline std::vector<TruthRow> read_truth(const std::filesystem::path& file, bool w_first) {
  std::vector<TruthRow> rows;
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    if (line.empty() || line[0] == '#') continue;
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream fields(line);
    std::string time;
    Eigen::Vector3d p;
    Eigen::Vector4d q;
    fields >> time >> p.x() >> p.y() >> p.z() >> q[0] >> q[1] >> q[2] >> q[3];
    if (!fields) throw std::runtime_error(file.string() + ": cannot read " + line);
    const Eigen::Vector4d xyzw = w_first ? Eigen::Vector4d(q[1], q[2], q[3], q[0]) : q;
    const std::size_t point = time.find('.');
    Stamp stamp = std::stoll(time.substr(0, point));
    if (point != std::string::npos) {
      const std::string fraction = (time.substr(point + 1) + "000000000").substr(0, 9);
      stamp = stamp * 1'000'000'000 + std::stoll(fraction);
    }
    rows.push_back({stamp, make_pose(Eigen::Quaterniond(xyzw).normalized().toRotationMatrix(), p)});
  }
  return rows;
}

/// Interpolated on the geodesic. Throws std::out_of_range outside the rows.
inline SE3 truth_at(const std::vector<TruthRow>& rows, Stamp stamp) {
  const auto after = std::lower_bound(rows.begin(), rows.end(), stamp,
                                      [](const TruthRow& r, Stamp s) { return r.stamp < s; });
  if (after == rows.end()) throw std::out_of_range("truth_at: after the last row");
  if (after->stamp == stamp) return after->T_world_body;
  if (after == rows.begin()) throw std::out_of_range("truth_at: before the first row");
  const TruthRow& before = *std::prev(after);
  const double share =
      seconds_between(before.stamp, stamp) / seconds_between(before.stamp, after->stamp);
  const Vector6 xi = se3_log(before.T_world_body.inverse() * after->T_world_body);
  return before.T_world_body * se3_exp(share * xi);
}

/// A recorded stereo pair with its features and the truth.
struct RecordedKeyframe {
  Stamp stamp = 0;
  SE3 T_world_body = SE3::Identity();
  KeyframeFeatures features;
};

inline RecordedKeyframe record_of(const StereoPairFile& files, const SensorRig& rig,
                                  const KeyframeFeatureExtractor& extractor,
                                  const std::vector<TruthRow>& truth) {
  const StereoPairResult pair = load_stereo_pair(files, rig.stereo);
  if (pair.status != ImageStatus::kOk) throw std::runtime_error(pair.problem);
  return {files.stamp, truth_at(truth, files.stamp), extractor.extract(pair.frame)};
}

/// The 100 stereo keyframes of EuRoC V1_01_easy.
inline std::vector<RecordedKeyframe> load_v1_01(const std::filesystem::path& sequence,
                                                const KeyframeFeaturesConfig& config) {
  const SensorRig rig = read_euroc_rig(sequence / "mav0");
  const KeyframeFeatureExtractor extractor(rig.stereo, config);
  const auto truth = read_truth(sequence / "mav0/state_groundtruth_estimate0/data.csv", true);
  ReaderReport report;
  std::vector<RecordedKeyframe> keyframes;
  for (const StereoPairFile& files : list_keyframe_pairs(sequence / "keyframes", report))
    keyframes.push_back(record_of(files, rig, extractor, truth));
  return keyframes;
}

/// Stereo pairs of the first 15 s of EuRoC MH_01_easy, where the vehicle moves, at 2 Hz.
inline std::vector<RecordedKeyframe> load_mh_01(const std::filesystem::path& sequence,
                                                const KeyframeFeaturesConfig& config) {
  const SensorRig rig = read_euroc_rig(sequence / "mav0");
  const KeyframeFeatureExtractor extractor(rig.stereo, config);
  const auto truth =
      read_truth(sequence / "mav0/state_groundtruth_estimate0/groundtruth_tum.txt", false);
  ReaderReport report;
  std::vector<RecordedKeyframe> keyframes;
  const auto pairs = list_euroc_pairs(sequence / "mav0", 0.001, report);
  Stamp next = pairs.front().stamp;
  for (const StereoPairFile& files : pairs) {
    if (files.stamp < next || seconds_between(pairs.front().stamp, files.stamp) >= 15.0) continue;
    keyframes.push_back(record_of(files, rig, extractor, truth));
    next = files.stamp + nanoseconds(0.475);  // of a 20 Hz camera every tenth image
  }
  return keyframes;
}

}  // namespace km
