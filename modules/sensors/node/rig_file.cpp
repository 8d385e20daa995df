#include "modules/sensors/node/rig_file.hpp"

#include <utility>

#include "modules/sensors/node/calibration_map.hpp"
#include "modules/sensors/node/rig_calibration.hpp"
#include "runtime/config_text.hpp"
#include "runtime/yaml_config.hpp"

namespace km {
namespace {

using RowMajor4 = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>;

// "/left" from "/left/image_raw" and from "/left/image_raw/compressed".
std::pair<std::string, std::string> split_topic(std::string topic) {
  for (const char* transport : {"/compressed", "/compressedDepth"})
    if (topic.ends_with(transport)) topic.resize(topic.size() - std::string(transport).size());
  const std::size_t slash = topic.rfind('/');
  if (slash == topic.npos) return {"", topic};
  return {topic.substr(0, slash), topic.substr(slash + 1)};
}

RosImages images_of(const RigFile::Camera& camera) {
  const bool named = split_topic(camera.topic).second.find("rect") != std::string::npos;
  return camera.rectified.value_or(named) ? RosImages::kRectified : RosImages::kRaw;
}

RigChoice choice_of(const RigFile& file) {
  RigChoice choice{.left = static_cast<std::size_t>(file.left.camera),
                   .may_be_partial = true,
                   .rectified = images_of(file.left) == RosImages::kRectified};
  choice.right.reset();
  if (!file.right.topic.empty()) choice.right = static_cast<std::size_t>(file.right.camera);
  if (!file.depth.topic.empty())
    choice.depth =
        DepthChoice{{file.depth.min_range_m, file.depth.max_range_m}, file.depth.baseline_m};
  return choice;
}

// The calibration in the rig file itself, or in files that it names, or an empty one that topics
// complete.
RigCalibration read_calibration(const std::filesystem::path& path, bool is_inline,
                                const RigFile& file) {
  const RigChoice choice = choice_of(file);
  if (is_inline) return read_inline_rig(CalibrationMap(path).map("calibration"), choice);
  if (!file.calibration.empty()) return read_rig(file.calibration, choice);
  RigCalibration calibration;
  calibration.has_cameras = calibration.has_extrinsics = calibration.has_pair = false;
  if (choice.depth) calibration.rig.depth = choice.depth->range;
  if (file.has_imu() && !file.has_odometry())
    calibration.notes.push_back(path.string() +
                                ": no calibration: the noise of EuRoC's inertial sensor is used");
  return calibration;
}

// Adds a note if a calibration names other topics than the rig file, because the calibration may be
// that of other cameras.
void note_topics(const RigFile& file, const std::string& path, RigCalibration& calibration) {
  const std::pair<const std::string&, const std::string&> topics[] = {
      {calibration.image_topics[0], file.left.topic},
      {calibration.image_topics[1], file.right.topic},
      {calibration.imu_topic, file.imu.topic}};
  for (const auto& [calibrated, used] : topics)
    if (!calibrated.empty() && !used.empty() && calibrated != used)
      calibration.notes.push_back(path + ": " + used + " is calibrated as " + calibrated);
}

// If nothing names a body, it is the left camera.
void choose_body(const RigFile& file, RigCalibration& calibration) {
  if (calibration.has_extrinsics || file.has_imu() || file.has_odometry() ||
      !file.body_frame.empty())
    return;
  calibration.has_extrinsics = true;
}

// Transform from 16 numbers of a 4x4 matrix, row by row; the identity from none.
SE3 transform_of(const std::filesystem::path& path, const char* key,
                 const std::vector<double>& numbers) {
  if (numbers.empty()) return SE3::Identity();
  const Eigen::Matrix4d T = Eigen::Map<const RowMajor4>(numbers.data());
  if (const auto problem = transform_problem(T))
    throw ConfigError(path.string() + ": " + key + *problem);
  return rigid_transform(T);
}

// Makes paths absolute, because the file may be read from another folder.
void make_absolute(YAML::Node node, const std::filesystem::path& folder) {
  if (!node) return;
  if (node.IsScalar()) node = (folder / node.as<std::string>()).lexically_normal().string();
  if (node.IsSequence())
    for (YAML::Node part : node) make_absolute(part, folder);
}

}  // namespace

PartialRig read_rig_file(const std::filesystem::path& path) {
  ConfigProblems problems;
  const ConfigContext context{problems, std::filesystem::absolute(path).parent_path()};
  RigFile file;
  YAML::Node root = load_yaml(path);
  const YAML::Node written = root.IsMap() ? root["calibration"] : YAML::Node();
  const bool is_inline = written && written.IsMap();
  if (is_inline) root.remove("calibration");
  fill_config(read_section(root, "", path.string(), context), "", context, file);
  problems.finish();
  RigCalibration calibration = read_calibration(path, is_inline, file);
  note_topics(file, path.string(), calibration);
  choose_body(file, calibration);
  const auto info_topic = [](const RigFile::Camera& camera) {
    return camera.info_topic.empty() ? camera_info_beside(camera.topic) : camera.info_topic;
  };
  return {.rig = {.topics = {.left = file.left.topic,
                             .right = file.right.topic,
                             .depth = file.depth.topic,
                             .imu = file.imu.topic,
                             .gyro = file.imu.gyro_topic,
                             .accel = file.imu.accel_topic,
                             .odometry = file.odometry.topic},
                  .sensors = std::move(calibration.rig),
                  .depth_scale_m = file.depth.scale_m,
                  .camera_time_offset_s = file.correction.camera_time_offset_s.value_or(
                      calibration.image_time_offset_s.value_or(0.0)),
                  .T_child_body =
                      transform_of(path, "odometry.T_child_body", file.odometry.T_child_body),
                  .notes = std::move(calibration.notes)},
          .has_cameras = calibration.has_cameras,
          .has_extrinsics = calibration.has_extrinsics,
          .has_pair = calibration.has_pair,
          .is_depth_aligned = file.depth.aligned,
          .virtual_baseline_m = file.depth.baseline_m,
          .info_topics = {info_topic(file.left), info_topic(file.right)},
          .images = {images_of(file.left), images_of(file.right)},
          .depth_info_topic = camera_info_beside(file.depth.topic),
          .body_frame = file.body_frame,
          .T_body_rig = transform_of(path, "T_body_rig", file.correction.T_body_rig),
          .pose_file = file.odometry.file.value_or("")};
}

CameraCalibration read_rig_correction(const std::filesystem::path& path) {
  const YAML::Node root = load_yaml(path);
  for (const char* key : {"left", "right", "imu", "depth", "odometry", "calibration"})
    if (root.IsMap() && root[key])
      throw ConfigError(path.string() + ": " + key +
                        " is for a bag or live topics: a EuRoC folder has its own calibration, in "
                        "its sensor.yaml files; leave --rig out, or name one of "
                        "camera_time_offset_s and T_body_rig alone (rig_estimated.yaml of a run)");
  ConfigProblems problems;
  const ConfigContext context{problems, std::filesystem::absolute(path).parent_path()};
  RigCorrectionFile file;
  fill_config(read_section(root, "", path.string(), context), "", context, file);
  problems.finish();
  return {file.camera_time_offset_s.value_or(0.0),
          transform_of(path, "T_body_rig", file.T_body_rig)};
}

std::string corrected_rig_text(const std::filesystem::path& base,
                               const CameraCalibration& correction) {
  YAML::Node root;
  if (!base.empty()) {
    root = load_yaml(base);
    const std::filesystem::path folder = std::filesystem::absolute(base).parent_path();
    if (!root["calibration"].IsMap()) make_absolute(root["calibration"], folder);
    if (root["odometry"]) make_absolute(root["odometry"]["file"], folder);
  }
  root["camera_time_offset_s"] = correction.offset_s;
  const RowMajor4 T = correction.T_body_rig.matrix();
  root["T_body_rig"] = std::vector<double>(T.data(), T.data() + T.size());
  root["T_body_rig"].SetStyle(YAML::EmitterStyle::Flow);
  YAML::Emitter text;
  text << root;
  return std::string(text.c_str()) + '\n';
}

std::string camera_info_beside(const std::string& topic) {
  return split_topic(topic).first + "/camera_info";
}

std::string rig_file_text(RigFile rig) {
  ConfigText text("");
  rig.visit_fields(text);
  return text.text();
}

}  // namespace km
