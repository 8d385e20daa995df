#include "modules/sensors/sensor_yaml.hpp"

#include <Eigen/LU>
#include <cmath>
#include <utility>

#include "modules/core/lie.hpp"
#include "modules/sensors/dataset_reader.hpp"
#include "modules/sensors/text_file.hpp"

namespace km {
namespace {

constexpr double kMaxNonOrthonormality = 1e-3;

}  // namespace

SensorYaml::SensorYaml(std::filesystem::path file) : file_(std::move(file)) {
  std::string text = read_file(file_);
  if (text.starts_with('%')) text.front() = '#';  // OpenCV's "%YAML:1.0" is not YAML
  try {
    root_ = YAML::Load(text);
  } catch (const YAML::Exception& e) {
    throw DatasetError(at_line(file_, e.mark.line + 1) + ": not YAML: " + e.msg);
  }
  if (!root_.IsMap()) throw DatasetError(file_.string() + ": no keys found");
}

bool SensorYaml::has(const char* key) const {
  const YAML::Node node = root_[key];
  return node && !node.IsNull();
}

YAML::Node SensorYaml::child(const YAML::Node& map, const char* key) const {
  const YAML::Node node = map.IsMap() ? map[key] : YAML::Node(YAML::NodeType::Undefined);
  if (!node || node.IsNull()) throw DatasetError(file_.string() + ": key " + key + " is missing");
  return node;
}

std::string SensorYaml::word(const char* key) const {
  const YAML::Node node = at(key);
  if (!node.IsScalar()) fail(node, std::string(key) + " is not a word");
  return node.Scalar();
}

double SensorYaml::positive(const char* key) const {
  double value = 0.0;
  const YAML::Node node = at(key);
  if (!YAML::convert<double>::decode(node, value) || !std::isfinite(value) || value <= 0.0)
    fail(node, std::string(key) + " is not a positive number");
  return value;
}

double SensorYaml::positive(const char* key, double otherwise) const {
  return has(key) ? positive(key) : otherwise;
}

std::vector<double> SensorYaml::numbers(const YAML::Node& node, const std::string& key,
                                        std::size_t count, const char* meaning) const {
  std::vector<double> values;
  if (!node.IsSequence()) fail(node, key + " is not a list of numbers");
  if (node.size() != count)
    fail(node, key + " has " + std::to_string(node.size()) + " numbers, expected " +
                   std::to_string(count) + " (" + meaning + ')');
  for (const YAML::Node& element : node) {
    double value = 0.0;
    if (!YAML::convert<double>::decode(element, value) || !std::isfinite(value))
      fail(element, key + " holds something that is not a finite number");
    values.push_back(value);
  }
  return values;
}

SE3 SensorYaml::extrinsics() const {
  const YAML::Node data = child(at("T_BS"), "data");
  const std::vector<double> values = numbers(data, "T_BS", 16, "4x4, row by row");
  const Eigen::Matrix4d T =
      Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(values.data());
  if (T.row(3) != Eigen::RowVector4d(0, 0, 0, 1)) fail(data, "T_BS: last row is not 0 0 0 1");

  const Eigen::Matrix3d R = T.topLeftCorner<3, 3>();
  const double error = (R * R.transpose() - Eigen::Matrix3d::Identity()).norm();
  if (error > kMaxNonOrthonormality)
    fail(data, "T_BS is not a rotation: |R R^T - I| = " + std::to_string(error) + ", at most " +
                   std::to_string(kMaxNonOrthonormality) + " is accepted");
  if (R.determinant() < 0.0) fail(data, "T_BS is a reflection: det R = -1");
  return make_pose(nearest_rotation(R), T.topRightCorner<3, 1>());
}

void SensorYaml::fail(const YAML::Node& node, const std::string& problem) const {
  throw DatasetError(at_line(file_, node.Mark().line + 1) + ": " + problem);
}

}  // namespace km
